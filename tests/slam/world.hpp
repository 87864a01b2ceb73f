#pragma once

#include <cmath>
#include <vector>

#include "trundle/slam/steps.hpp"
#include "trundle/statistics/random.hpp"

namespace trundle::test {
using namespace slam;

/// A robot on a circle among landmarks, its noise known: steps for a filter and the truth behind them.
struct SlamWorld {
  LandmarkSensor sensor{{0.2, 0.05, 0.1}, 0.1, radians(1.0), 8.0, 0.0};
  std::vector<Vector2> landmarks;
  std::vector<SlamStep> steps;
  std::vector<Pose2> truth;  ///< after each step
};

struct SlamWorldOptions {
  int steps = 200;
  int landmarks = 20;
  double radius_m = 5.0;
  double step_m = 0.5;
  double sigma_along_m = 0.02;
  double sigma_across_m = 0.004;
  double sigma_turn_rad = 0.01;
  std::uint64_t seed = 1;
  Vector3 systematic = Vector3::Zero();  ///< what the odometry does wrong
};

inline std::vector<Observation> look_around(const SlamWorld& world, const Pose2& pose, Random& random) {
  std::vector<Observation> seen;
  for (std::size_t i = 0; i < world.landmarks.size(); ++i) {
    const ExpectedReading exact = expected_reading(pose, world.sensor.body_from_sensor, world.landmarks[i]);
    if (exact.range_m > world.sensor.max_range_m) continue;
    seen.push_back({static_cast<LandmarkId>(i), exact.range_m + random.normal(world.sensor.range_sigma_m),
                    wrap_angle(exact.bearing_rad + random.normal(world.sensor.bearing_sigma_rad))});
  }
  return seen;
}

inline SlamWorld slam_world(const SlamWorldOptions& options = {}) {
  SlamWorld world;
  Random random(options.seed, 77);
  for (int i = 0; i < options.landmarks; ++i) {
    const double angle = random.uniform(-kPi, kPi);
    const double distance = options.radius_m + random.uniform(1.0, 4.0) * (i % 2 == 0 ? 1.0 : -0.9);
    world.landmarks.emplace_back(distance * std::sin(angle), options.radius_m - distance * std::cos(angle));
  }
  const Twist2 twist{options.step_m, 0.0, options.step_m / options.radius_m};
  Matrix3 covariance = Matrix3::Zero();
  covariance.diagonal() << std::pow(options.sigma_along_m, 2), std::pow(options.sigma_across_m, 2),
      std::pow(options.sigma_turn_rad, 2);
  Pose2 pose;
  for (int k = 0; k < options.steps; ++k) {
    const Twist2 error{random.normal(options.sigma_along_m), random.normal(options.sigma_across_m),
                       random.normal(options.sigma_turn_rad)};
    const Twist2 true_twist{twist.dx * (1.0 + options.systematic[0]), 0.0,
                            twist.dtheta * (1.0 + options.systematic[1]) + twist.dx * options.systematic[2]};
    pose = pose * exp(true_twist) * exp(error);
    world.truth.push_back(pose);
    world.steps.push_back({0.1 * (k + 1), motion_of(twist, covariance), look_around(world, pose, random)});
  }
  return world;
}

/// Root mean square distance of positions, step by step [m].
inline double position_rms(const Trajectory& trajectory, const std::vector<Pose2>& truth) {
  double sum = 0.0;
  for (std::size_t k = 0; k < truth.size(); ++k)
    sum += (trajectory.poses[k].pose.translation() - truth[k].translation()).squaredNorm();
  return std::sqrt(sum / static_cast<double>(truth.size()));
}

}  // namespace trundle::test
