#pragma once

#include <span>
#include <vector>

#include "trundle/slam/localization/global_search.hpp"
#include "trundle/slam/localization/pose_ekf.hpp"
#include "trundle/slam/models/pending_motion.hpp"
#include "trundle/statistics/random.hpp"

namespace trundle::slam {

/// How many particles a cloud gets: so many that its distance (Kullback–Leibler) from what it stands for,
/// counted in bins, stays below `error` with probability 1 − tail [Fox 2003]. docs/theory/localization.md,
/// eq. 50.
struct ParticleNumber {
  std::size_t least = 50;
  std::size_t most = 10'000;
  double error = 0.05;
  double tail = 0.01;
  double bin_m = 0.1;
  double bin_rad = radians(3.0);
};
[[nodiscard]] std::size_t particles_for(std::size_t bins, const ParticleNumber& number);

struct PoseParticlesOptions {
  MapSightOptions sight = {};
  ParticleNumber number = {};
  std::uint64_t seed = 1;
  double resample_below = 0.5;  ///< effective particles, as a share of all
};

/// The pose on a known map as particles, drawn from motion and sightings together as `fastslam2` does. Their
/// number follows their spread at each resampling.
class PoseParticles {
 public:
  /// The map must outlive the filter.
  PoseParticles(const KnownMap& map, const LandmarkSensor& sensor, const PoseEstimate& start,
                const PoseParticlesOptions& options);

  /// `novelty`: how much of each observation is evidence for or against the pose, 0 to 1.
  const MapStepReport& step(const Motion& motion, std::span<const Observation> observations,
                            std::span<const double> novelty);

  /// What the gyro reads at rest, after a step.
  void read_bias(const BiasReading& reading);

  /// Mean and covariance of the Gaussians that the particles were drawn from, by their weights.
  [[nodiscard]] const PoseEstimate& estimate() const { return estimate_; }
  [[nodiscard]] std::span<const Pose2> poses() const { return poses_; }
  [[nodiscard]] double effective_particles() const;

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.random_, self.poses_, self.systematic_, self.log_weights_, self.weights_, self.pending_,
            self.estimate_, self.report_);
  }

 private:
  [[nodiscard]] PoseEstimate predicted(std::size_t particle) const;
  /// How well an observed step fits, against 'somewhere else'.
  struct Fitting {
    double log_all = 0.0;           ///< of all readings
    double log_new_evidence = 0.0;  ///< of what is new among them
  };
  Fitting improve(PoseEstimate& belief, std::span<const Observation> observations,
                  std::span<const double> novelty, bool reports);
  void begin_pending();
  void mix(std::span<const PoseEstimate> beliefs);
  void normalise();
  void resample();
  [[nodiscard]] double kernel_width() const;
  void make_room_for_kernels();
  void become_kernels();
  void spread();
  Pose2 draw_from(const PoseEstimate& belief);

  const KnownMap* map_;
  LandmarkSensor sensor_;
  PoseParticlesOptions options_;
  Random random_;
  std::vector<Pose2> poses_;
  std::vector<Systematic> systematic_;  ///< mean of each, given its pose, when that was drawn
  std::vector<double> log_weights_;
  std::vector<double> weights_;
  PendingMotion pending_;  ///< since the poses were drawn
  PoseEstimate estimate_;
  MapStepReport report_;
};

}  // namespace trundle::slam
