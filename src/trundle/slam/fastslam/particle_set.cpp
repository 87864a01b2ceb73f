#include "trundle/slam/fastslam/particle_set.hpp"

#include <algorithm>
#include <limits>
#include <span>

#include "trundle/geometry/gaussian.hpp"
#include "trundle/slam/fastslam/particle_kernels.hpp"

namespace trundle::slam {
namespace {

/// Mean and covariance of the mixture, as of the poses.
void add_systematic(const ParticleSet& particles, const PendingMotion& pending, PoseEstimate& estimate) {
  estimate.systematic = Systematic::Zero(pending.systematic());
  estimate.systematic_covariance = pending.systematic_covariance();
  if (pending.systematic() == 0) return;
  const auto of = [&](std::size_t i) { return pending.systematic_of(particles.systematic.at(i)); };
  for (std::size_t i = 0; i < particles.count; ++i) estimate.systematic += particles.weights[i] * of(i);
  for (std::size_t i = 0; i < particles.count; ++i) {
    const Systematic apart = of(i) - estimate.systematic;
    estimate.systematic_covariance += particles.weights[i] * apart * apart.transpose();
  }
}

}  // namespace

ParticleSet::ParticleSet(std::size_t particles, Eigen::Index systematic_errors)
    : count(particles),
      poses(particles),
      predicted(particles),
      noise(particles),
      sensors(particles),
      systematic(particles, systematic_errors),
      log_weights(padded(particles), 0.0),
      weights(padded(particles)),
      ancestry(particles) {}

std::size_t ParticleSet::best() const {
  return static_cast<std::size_t>(std::ranges::find(log_weights, 0.0) - log_weights.begin());
}

Systematic ParticleSet::mean_systematic() const {
  Systematic mean = Systematic::Zero(systematic.count());
  for (std::size_t i = 0; i < count && mean.size() > 0; ++i) mean += weights[i] * systematic.at(i);
  return mean;
}

double normalise(ParticleSet& particles) {
  auto& log_weights = particles.log_weights;
  std::fill(log_weights.begin() + static_cast<std::ptrdiff_t>(particles.count), log_weights.end(),
            -std::numeric_limits<double>::infinity());
  const auto effective_number = [&] {
    return normalise(particles.all(), log_weights.data(), particles.weights.data());
  };
  double effective = effective_number();
  if (effective == 0.0) {
    std::fill_n(log_weights.begin(), particles.count, 0.0);
    effective = effective_number();
  }
  particles.leading = particles.best();
  return effective;
}

PoseEstimate mean_of(const ParticleSet& particles, const PendingMotion& pending) {
  PoseColumns now(particles.count);
  predict(particles.poses, particles.systematic, pending.prediction(), particles.all(), now);
  const double heading = now.at(particles.best()).heading;
  const auto numbers_of = [&](std::size_t i) {
    const Pose2 pose = now.at(i);
    return Vector3(pose.x, pose.y, heading + wrap_angle(pose.heading - heading));
  };
  Vector3 mean = Vector3::Zero();
  for (std::size_t i = 0; i < particles.count; ++i) mean += particles.weights[i] * numbers_of(i);
  PoseEstimate estimate;
  estimate.pose = {mean.x(), mean.y(), mean.z()};
  estimate.covariance = world_covariance({estimate.pose, pending.covariance()});
  for (std::size_t i = 0; i < particles.count; ++i) {
    const Vector3 apart = numbers_of(i) - mean;
    estimate.covariance += particles.weights[i] * apart * apart.transpose();
  }
  add_systematic(particles, pending, estimate);
  return estimate;
}

Pose2 pose_of(std::size_t particle, const ParticleSet& particles, const PendingMotion& pending) {
  PoseColumns pose(1);
  SystematicColumns systematic(1, pending.systematic());
  pose.set(0, particles.poses.at(particle));
  systematic.set(0, particles.systematic.at(particle));
  predict(pose, systematic, pending.prediction(), {0, padded(1)}, pose);
  return pose.at(0);
}

SystematicResampling::SystematicResampling(std::uint64_t seed, std::size_t particles)
    : random_(seed, kResamplingStream),
      parents_(particles + 1),
      first_child_(particles + 1, static_cast<Ancestry::Index>(particles)),
      spare_(padded(particles)) {}

/// Child i has the first parent up to whom the weights sum to (i + offset)/N. Numbers of children are a
/// matter of chance, so no branch asks them.
void SystematicResampling::resample(ParticleSet& particles) {
  const std::size_t count = particles.count;
  const auto all_children = static_cast<double>(count);
  const double before = 1.0 - random_.uniform();
  std::ranges::fill(parents_, Ancestry::Index{0});
  double sum = 0.0;
  Ancestry::Index first = 0;  // child of the next parent, if he has one
  for (std::size_t parent = 0; parent < count; ++parent) {
    first_child_[parent] = first;
    parents_[first] = static_cast<Ancestry::Index>(parent);
    sum += particles.weights[parent];
    first = static_cast<Ancestry::Index>(std::min(sum * all_children + before, all_children));
  }
  const std::span parents(parents_.data(), count);
  Ancestry::Index last = 0;
  for (Ancestry::Index& parent : parents) parent = last = std::max(last, parent);
  particles.poses.permute(parents, spare_);
  if (particles.systematic.count() > 0) particles.systematic.permute(parents, spare_);
  particles.ancestry.resample(first_child_);
  std::fill_n(particles.log_weights.begin(), count, 0.0);
  std::fill_n(particles.weights.begin(), count, 1.0 / static_cast<double>(count));
  particles.leading = first_child_[particles.leading];
}

}  // namespace trundle::slam
