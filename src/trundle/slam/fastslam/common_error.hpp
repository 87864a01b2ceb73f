#pragma once

#include <optional>
#include <span>
#include <vector>

#include "trundle/slam/fastslam/loop_closing.hpp"
#include "trundle/slam/fastslam/lost_covariance.hpp"
#include "trundle/slam/fastslam/particle_belief.hpp"
#include "trundle/slam/fastslam/particle_kernels.hpp"
#include "trundle/slam/observation.hpp"

namespace trundle::slam {

/// A sighting of a landmark that is in the map, and no outlier.
struct MatchedSighting {
  std::size_t observation;
  LandmarkId landmark;
  ReadingTerms reading;
};

/// What the particles of a filter have wrong in common, of which their scatter says nothing: the covariance
/// of the odometry since the start, that which resampling has taken from them, and the loops that show how
/// much it was. docs/theory/resampling.md, eq. 60 to 62 and 68 to 70; docs/theory/loop-closing.md, eq. 63
/// to 67.
class CommonError {
 public:
  CommonError(const LandmarkSensor& sensor, std::size_t particles);

  /// What the odometry may have erred by since the start: A of eq. 66.
  [[nodiscard]] const FrameCovariance& drift() const { return drift_; }
  [[nodiscard]] const LostCovariance& lost() const { return lost_; }
  /// The particles' mean, and the covariance of what they differ in or have lost by resampling.
  [[nodiscard]] PoseEstimate estimate(const ParticleBelief& belief) const;

  /// The body has moved.
  void predict(const Motion& motion, const ParticleBelief& belief);
  /// What is seen in a step, before it improves anything.
  void add_sightings(std::span<const MatchedSighting> matched, const StepReport& report,
                     ParticleBelief& belief);
  /// A resampling is near, and has been. Eq. 61.
  void before_resampling(ParticleBelief& belief);
  void after_resampling(const StepReport& report, ParticleBelief& belief);
  /// A loop that the step's sightings close, and where the robot is taken to be.
  struct ClosedLoop {
    LoopCorrection correction;
    Pose2 here;
  };
  /// At the end of a step.
  std::optional<ClosedLoop> close_loop(std::span<const Observation> observations, const StepReport& report,
                                       ParticleBelief& belief);

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.coalescence_, self.lost_, self.loop_, self.drift_);
  }

 private:
  /// An old landmark that fits, as the most probable particle had it before the step.
  struct MatchedRevisit {
    std::size_t observation;
    LandmarkId landmark;
    Submap seen_in;
    LandmarkEstimate mapped;
  };

  void find_revisits(std::span<const MatchedSighting> matched, ParticleBelief& belief);
  void inflate_if_few(std::size_t matched, const StepReport& report, const ParticleBelief& belief);
  [[nodiscard]] Submap present_submap(const Pose2& here, const ParticleBelief& belief) const;
  [[nodiscard]] Revisit revisit_of(LandmarkId landmark, const Observation& observation, const Pose2& from,
                                   const ParticleMap& map) const;
  void update_from_revisits(std::span<const Observation> observations, const ParticleBelief& belief);

  LandmarkSensor sensor_;
  Coalescence coalescence_;
  LostCovariance lost_;
  LoopClosing loop_;
  FrameCovariance drift_;
  std::vector<MatchedRevisit> revisited_;  ///< in this step
};

/// Every particle's present submap moves to where the sightings say, within what they leave open. Submaps in
/// between follow; those of an ancestor by the mean of its descendants. Eq. 65 and 66.
void correct_loop(const CommonError::ClosedLoop& closed, const Draw& draw, ParticleBelief& belief);

}  // namespace trundle::slam
