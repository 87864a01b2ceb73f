#pragma once

#include "trundle/slam/fastslam/ancestry.hpp"
#include "trundle/slam/fastslam/columns.hpp"
#include "trundle/slam/models/pending_motion.hpp"
#include "trundle/statistics/random.hpp"

namespace trundle::slam {

/// The particles of a filter, but for their maps (ParticleMap): where each is, what it weighs, and from whom
/// it descends.
struct ParticleSet {
  /// `systematic`: so many errors of the odometry each knows of.
  ParticleSet(std::size_t particles, Eigen::Index systematic_errors);

  std::size_t count;
  PoseColumns poses;             ///< as they were last drawn
  PoseColumns predicted;         ///< before their noise of this step
  TripleColumns noise;           ///< that noise, whitened: n of docs/theory/fastslam.md, eq. 15
  SensorColumns sensors;         ///< at the poses
  SystematicColumns systematic;  ///< each one's mean, given its path, when its pose was drawn
  Column<double> log_weights;    ///< the largest is 0
  Column<double> weights;        ///< sum to 1
  Ancestry ancestry;
  std::size_t leading = 0;  ///< the best, or its first child after a resampling

  /// Padding included.
  [[nodiscard]] ParticleRange all() const { return {0, padded(count)}; }
  /// That of the greatest weight.
  [[nodiscard]] std::size_t best() const;
  /// Of the systematic errors, by weight.
  [[nodiscard]] Systematic mean_systematic() const;

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.poses, self.sensors, self.systematic, self.log_weights, self.weights, self.ancestry,
            self.leading);
  }
};

/// Weights from their logarithms. Returns the effective number of particles, 1/Σw²; where none can explain
/// what was seen, all weigh the same.
double normalise(ParticleSet& particles);

/// Mean and covariance of where the pending motion brings the particles, about which each is unsure; headings
/// are averaged as differences to the best particle's.
[[nodiscard]] PoseEstimate mean_of(const ParticleSet& particles, const PendingMotion& pending);
/// Where it brings one of them.
[[nodiscard]] Pose2 pose_of(std::size_t particle, const ParticleSet& particles, const PendingMotion& pending);

/// Of Random: which of its streams resampling draws from.
inline constexpr std::uint64_t kResamplingStream = 1;

/// Systematic resampling: one random number, and as many children for each particle as its weight says, to
/// within one. Afterwards all weigh the same.
class SystematicResampling {
 public:
  SystematicResampling(std::uint64_t seed, std::size_t particles);

  void resample(ParticleSet& particles);

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.random_);
  }

 private:
  Random random_;
  std::vector<Ancestry::Index> parents_;      ///< of each particle, and one more
  std::vector<Ancestry::Index> first_child_;  ///< likewise
  Column<double> spare_;
};

}  // namespace trundle::slam
