#pragma once

#include "trundle/slam/fastslam/landmark_kernels.hpp"
#include "trundle/slam/fastslam/particle_map.hpp"
#include "trundle/slam/pending_motion.hpp"

namespace trundle {

/// Some particles, spread over all: what they see before they are drawn decides whether a sighting is an
/// outlier. docs/theory/fastslam.md, eq. 14. The most probable particle reports, and has no vote of its own.
/// They meet before the others have moved or inherited anything.
class GatingSample {
 public:
  /// `systematic`: so many errors a particle has.
  GatingSample(std::size_t particles, Precision precision, Eigen::Index systematic);

  /// Poses and weights are those before the step; `predicted_covariance`: of the body's twist after it.
  struct Case {
    const PoseColumns& poses;
    const SystematicColumns& systematic;
    PredictedMotion motion;
    const Column<double>& weights;
    std::size_t reporter;
    Matrix3 predicted_covariance;
    Pose2 body_from_sensor;
  };
  void meet(const Case& at);

  struct Verdict {
    bool rejected = false;
    Vector2 innovation = Vector2::Zero();  ///< of the reporter: (range, bearing) [m, rad]
    double nis = 0.0;
  };
  /// Where jurors have a landmark, or take a reading to point: how far from the reporter they go.
  struct Whereabouts {
    bool is_somewhere = false;
    Vector2 place = Vector2::Zero();  ///< the reporter's, or where it has none that of another
    double reach_m = 0.0;             ///< greatest distance of another from it
    double sigma_m = 0.0;             ///< greatest of a juror's own
  };
  Whereabouts where_is(const ParticleMap::Inherited& landmark);
  Whereabouts where_points(const ReadingTerms& reading) const;
  /// Least NIS that a juror finds who has the landmark.
  double least_nis(const ReadingTerms& reading, const ParticleMap::Inherited& landmark);

  /// Rejected where more than half of the jurors' weight finds the NIS above the gate.
  Verdict on(const ReadingTerms& reading, const ParticleMap::Inherited& landmark, double gate);

 private:
  void add_to(Whereabouts& where, const LandmarkEstimate& m) const;
  void fetch(const ParticleMap::Inherited& landmark);
  void judge(const ReadingTerms& reading, const ParticleMap::Inherited& landmark);

  static constexpr std::size_t kSeats = 32;  ///< the first is the reporter's

  std::size_t particles_;
  std::vector<std::size_t> jurors_;
  std::vector<double> votes_;
  PoseColumns poses_;
  SystematicColumns systematic_;
  PoseColumns predicted_;
  TripleColumns still_;  ///< no noise
  SensorColumns sensors_;
  Column<Ancestry::Index> whose_;  ///< landmark each has
  LandmarkColumns landmark_;
  TripleColumns surprises_;
  Matrix3 sensor_covariance_ = Matrix3::Zero();
};

}  // namespace trundle
