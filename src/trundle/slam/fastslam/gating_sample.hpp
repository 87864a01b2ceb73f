#pragma once

#include "trundle/slam/fastslam/landmark_kernels.hpp"
#include "trundle/slam/fastslam/particle_map.hpp"
#include "trundle/slam/models/pending_motion.hpp"

namespace trundle::slam {

/// A subset of the particles, spread over all: what they expect before poses are drawn decides whether a
/// sighting is an outlier. docs/theory/fastslam.md, eq. 14. The first member is the most probable particle,
/// whose innovations are reported; it has no weight of its own. They are predicted before the others have
/// moved or gathered anything.
class GatingSample {
 public:
  /// `systematic`: so many errors a particle has.
  GatingSample(std::size_t particles, Eigen::Index systematic);

  /// Poses and weights are those before the step; `predicted_covariance`: of the body's twist after it.
  struct Prior {
    const PoseColumns& poses;
    const SystematicColumns& systematic;
    PredictedMotion motion;
    const Column<double>& weights;
    std::size_t reporter;
    Matrix3 predicted_covariance;
    Pose2 body_from_sensor;
  };
  /// Selects the members and predicts them.
  void select(const Prior& prior);

  /// What the gate makes of a sighting.
  struct Gated {
    bool rejected = false;
    Vector2 innovation = Vector2::Zero();  ///< of the most probable particle: (range, bearing) [m, rad]
    double nis = 0.0;
  };
  /// Where members have a landmark, or a reading points from them: in the world [m].
  struct Spread {
    bool is_any = false;
    Vector2 place = Vector2::Zero();  ///< the most probable particle's, or where it has none another's
    double reach_m = 0.0;             ///< greatest distance of another member's from it
    double sigma_m = 0.0;             ///< greatest of a member's own
  };
  [[nodiscard]] Spread spread_of(const ParticleMap::Stored& landmark);
  [[nodiscard]] Spread spread_of(const ReadingTerms& reading) const;
  /// Least NIS among the members that have the landmark; infinity where none has.
  [[nodiscard]] double least_nis(const ReadingTerms& reading, const ParticleMap::Stored& landmark);

  /// Rejected where more than half of the members' weight has the NIS above the gate.
  [[nodiscard]] Gated gate(const ReadingTerms& reading, const ParticleMap::Stored& landmark, double gate);

 private:
  void add_to(Spread& spread, const LandmarkEstimate& m) const;
  void fetch(const ParticleMap::Stored& landmark);
  void set_innovations_of(const ReadingTerms& reading, const ParticleMap::Stored& landmark);

  /// 31 that are weighed: the standard error of a half is then √(0.25/31) = 0.09, so what three quarters of
  /// the particles reject passes in one case of 400. Two vectors of 16 lanes.
  static constexpr std::size_t kMembers = 32;

  std::size_t particles_;
  std::vector<std::size_t> members_;  ///< particles
  std::vector<double> weights_;
  PoseColumns poses_;
  SystematicColumns systematic_;
  PoseColumns predicted_;
  TripleColumns still_;  ///< no noise
  SensorColumns sensors_;
  Column<Ancestry::Index> whose_;  ///< landmark each has
  LandmarkColumns landmark_;
  TripleColumns innovations_;
  Matrix3 sensor_covariance_ = Matrix3::Zero();
};

}  // namespace trundle::slam
