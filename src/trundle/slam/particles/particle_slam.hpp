#pragma once

#include <span>
#include <vector>

#include "trundle/slam/particles/crew.hpp"
#include "trundle/slam/particles/forgotten_doubt.hpp"
#include "trundle/slam/particles/jury.hpp"
#include "trundle/slam/particles/loop_closing.hpp"
#include "trundle/slam/particles/particle_association.hpp"
#include "trundle/slam/particles/particle_kernels.hpp"
#include "trundle/slam/particles/particle_map.hpp"
#include "trundle/slam/particles/particle_paths.hpp"
#include "trundle/slam/particles/proposal_kernels.hpp"
#include "trundle/slam/particles/swarm.hpp"
#include "trundle/statistics/random.hpp"

namespace trundle {

/// How particles get their new poses.
enum class Proposal {
  motion,          ///< drawn from the motion: FastSLAM 1.0
  linearised,      ///< from a Gaussian of motion and sightings: FastSLAM 2.0
  swarm,           ///< moved by the swarm, as published: weights know nothing of it
  swarm_gaussian,  ///< from a Gaussian at the swarm's optimum, weighted for it
};

/// What a filter gives for its pose.
enum class PointEstimate {
  mean,  ///< of all particles, by their weights
  best,  ///< the particle of greatest weight
};

/// Of Random: which of its streams resampling draws from.
inline constexpr std::uint64_t kResamplingStream = 1;

struct ParticleSlamOptions {
  Proposal proposal = Proposal::linearised;
  std::size_t particles = 100;
  std::uint64_t seed = 1;
  SlamPrior prior = {};
  double gate = kDefaultGate;   ///< a sighting is rejected when most particles find its NIS above
  double resample_below = 0.5;  ///< effective particles, as a share of all
  bool keep_paths = true;       ///< false: memory does not grow with time
  Precision map_precision = Precision::float32;
  std::size_t threads = 1;  ///< results do not depend on it
  SwarmOptions swarm = {};
  PointEstimate estimate = PointEstimate::mean;
  LandmarkId first_nameless = 0;  ///< landmarks without names are numbered from here on: above all names
};

/// Rao–Blackwellised particle filter: each particle is a path, with a Kalman filter for each landmark given
/// that path. While nothing is seen the motion, which is the same for all, is only summed up; poses are drawn
/// when there is something to draw them with. Equations: docs/theory/fastslam.md.
class ParticleSlam {
 public:
  /// Throws InputError when there is no particle.
  ParticleSlam(const LandmarkSensor& sensor, const ParticleSlamOptions& options);

  const StepReport& step(const Motion& motion, std::span<const Observation> observations);
  /// What the gyro reads at rest, after a step.
  void read_bias(const BiasReading& reading);

  /// The particles' mean or best where the motion since they were last drawn has brought them, and the
  /// covariance about it of both, with what resampling has made them forget. The best is that before a
  /// resampling.
  PoseEstimate estimate() const;
  std::size_t landmarks() const { return map_.landmarks(); }
  /// Over all particles. The covariance is of what they differ in, or have forgotten, and what each is unsure
  /// of.
  MappedLandmark landmark(std::size_t index) const;
  /// Whether the most probable particle has it: those without names not all have.
  bool has_landmark(std::size_t index) const;
  /// Whether it surely exists: one without a name may be tentative.
  bool is_confirmed(std::size_t index) const {
    return association_.is_confirmed(static_cast<LandmarkId>(index));
  }

  /// As they were last drawn: at the last step with sightings.
  std::vector<Pose2> poses() const;
  std::vector<double> weights() const;
  /// Of the particle with the largest weight: poses after each step; empty when paths are not kept.
  std::vector<Pose2> best_path() const;
  /// Of how many particles at the step with sightings so many before the last those of now descend; 1 where
  /// paths are not kept.
  std::size_t ancestors(std::size_t steps_back) const { return paths_.ancestors(steps_back, ancestry_); }
  /// Poses stored for that, by all particles together.
  std::size_t stored_poses() const { return paths_.stored(); }

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.draws_, self.resampling_, self.poses_, self.sensors_, self.log_weights_, self.weights_,
            self.ancestry_, self.map_, self.association_, self.paths_, self.kinship_, self.forgotten_,
            self.systematic_, self.pending_, self.since_drawn_, self.report_, self.loop_, self.drift_,
            self.leading_);
  }

 private:
  struct Seen {
    std::size_t observation;
    LandmarkId landmark;
    ReadingTerms reading;
  };

  /// A landmark of old that fits, as the most probable particle had it before the step.
  struct Returned {
    std::size_t observation;
    LandmarkId landmark;
    PieceOfMap seen_in;
    LandmarkEstimate mapped;
  };

  void recognise(std::span<const Observation> observations);
  /// Of the error of a particle's prediction: noise, and what is not known of the systematic errors. Eq. 9.
  const Matrix3& predicted_covariance() const { return pending_.covariance(); }
  void convene();
  void reject_outliers();
  void note_returns();
  void distrust_few();
  void look(const Draw& draw);
  void bring_up(const Draw& draw, ParticleRange range);
  void move_and_weigh();
  void draw_near_sightings(const Placement& placement, ParticleRange range);
  void learn_systematic();
  void begin_pending();
  void settle(std::span<const Observation> observations);
  void add_landmark(const Observation& observation, std::size_t index);
  void normalise();
  void resample();
  void keep_doubt();
  void keep_systematic(double share_lost);
  PoseEstimate mean_estimate() const;
  void add_systematic(PoseEstimate& estimate) const;
  void drive(const Motion& motion);
  PieceOfMap present_piece(const Pose2& here) const;
  SeenAgain seen_again(LandmarkId landmark, const Observation& observation, const Pose2& from) const;
  void watch_for_loop(std::span<const Observation> observations);
  void recall(std::span<const Observation> observations);
  void bend(const MapBend& bend, const Pose2& here);
  std::size_t best_particle() const;
  ParticleRange all() const { return {0, padded(options_.particles)}; }
  Draw next_draw() { return {options_.seed, draws_++, 0}; }

  LandmarkSensor sensor_;
  ParticleSlamOptions options_;
  Crew crew_;
  std::uint64_t draws_ = 0;  ///< so many numbers each particle has drawn
  Random resampling_;
  PoseColumns poses_;
  PoseColumns predicted_;  ///< before their noise of this step
  TripleColumns n_;        ///< that noise, whitened
  TripleColumns z_;        ///< a second draw, where n is what the swarm has found
  SensorColumns sensors_;
  Column<double> log_weights_;                ///< the largest is 0
  Column<double> weights_;                    ///< sum to 1
  std::vector<Ancestry::Index> parents_;      ///< room to resample in
  std::vector<Ancestry::Index> first_child_;  ///< likewise, of each particle and one more
  Column<double> spare_;                      ///< likewise
  Ancestry ancestry_;
  ParticleMap map_;
  Jury jury_;
  ParticleAssociation association_;
  ParticlePaths paths_;
  Kinship kinship_{options_.particles};
  ForgottenDoubt forgotten_;
  LoopClosing loop_;
  MapDoubt drift_;  ///< what the odometry may have erred by since the start
  Swarm swarm_;
  SystematicColumns systematic_;        ///< each particle's mean, given its path, when its pose was drawn
  PendingMotion pending_;               ///< since then
  Motion since_drawn_;                  ///< the same, whatever the systematic errors: for its path
  std::vector<Seen> seen_;              ///< in this step, of landmarks in the map
  std::vector<Returned> returned_;      ///< of those
  std::vector<KnownReading> readings_;  ///< of those seen
  NearReadings near_;                   ///< the same
  std::vector<std::size_t> open_;       ///< valid observations of this step that show none of them
  StepReport report_;
  std::size_t leading_ = 0;  ///< the best particle, or its first child after a resampling
};

}  // namespace trundle
