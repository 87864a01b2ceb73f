#pragma once

#include <cmath>
#include <vector>

#include "trundle/slam/steps.hpp"
#include "trundle/statistics/random.hpp"

namespace trundle::bench {
using namespace slam;

/// Workload W1: a robot on a circle of radius M/4 m, M landmarks uniform in the annulus ±10 m around its path
/// but not within 1 m of it, sensor range 10 m (about ten in view), known ids; odometry noise per step 5 % of
/// its length and 0.2°, range σ 0.1 m, bearing σ 1°. 1000 steps make a loop, 10 000 from M = 10 000 on, and
/// beyond that as many as keep a step below 1.6 m.
struct W1 {
  LandmarkSensor sensor{{}, 0.1, radians(1.0), 10.0, 0.0};
  std::vector<Vector2> landmarks;
  std::vector<SlamStep> steps;
  std::vector<Pose2> truth;      ///< after each step
  std::vector<Observation> all;  ///< every landmark as seen from the start, to fill a map with
  double sigma_m = 0.0;          ///< of a step's length
  double sigma_rad = 0.0;        ///< of its turn
  double in_view = 0.0;          ///< landmarks, on average
  std::size_t steps_per_lap = 0;

  Pose2 start() const { return {}; }
};

struct W1Options {
  int landmarks = 100;
  int steps = 2000;
  std::uint64_t seed = 1;
  double odometry_noise = 1.0;  ///< times that of W1
};

namespace w1_detail {

inline Observation seen(const W1& work, const Pose2& pose, std::size_t landmark, Random& random) {
  const ExpectedReading exact = expected_reading(pose, {}, work.landmarks[landmark]);
  return {static_cast<LandmarkId>(landmark), exact.range_m + random.normal(work.sensor.range_sigma_m),
          exact.bearing_rad + random.normal(work.sensor.bearing_sigma_rad)};
}

/// Uniform over the area: by angle, and by the square of the distance from the centre of the loop.
inline void place_landmarks(W1& work, int count, double radius, Random& random) {
  constexpr double kClearance_m = 1.0;
  const double reach = work.sensor.max_range_m;
  const double inner = std::max(0.0, radius - reach);
  const double outer = radius + reach;
  while (static_cast<int>(work.landmarks.size()) < count) {
    const double distance = std::sqrt(random.uniform(inner * inner, outer * outer));
    const double angle = random.uniform(-kPi, kPi);
    if (std::abs(distance - radius) < kClearance_m) continue;
    work.landmarks.emplace_back(distance * std::sin(angle), radius - distance * std::cos(angle));
  }
}

/// Landmarks by the angle at which the loop passes them, so that a step need not look at all of them.
class Around {
 public:
  Around(const W1& work, double radius) : radius_(radius) {
    for (std::size_t i = 0; i < work.landmarks.size(); ++i)
      by_angle_.push_back({angle_of(work.landmarks[i]), i});
    std::ranges::sort(by_angle_);
  }
  /// Those that may be in reach, ascending.
  std::vector<std::size_t> near(const Vector2& place, double reach) const {
    const double width = std::min(kPi, 2.0 * reach / radius_);
    std::vector<std::size_t> found;
    for (const double turn : {-2.0 * kPi, 0.0, 2.0 * kPi}) {
      const double angle = angle_of(place) + turn;
      auto at = std::ranges::lower_bound(by_angle_, std::pair(angle - width, std::size_t{0}));
      for (; at != by_angle_.end() && at->first < angle + width; ++at) found.push_back(at->second);
    }
    std::ranges::sort(found);
    return found;
  }

 private:
  double angle_of(const Vector2& place) const { return std::atan2(place.x(), radius_ - place.y()); }

  double radius_;
  std::vector<std::pair<double, std::size_t>> by_angle_;
};

}  // namespace w1_detail

inline W1 w1(const W1Options& options) {
  using namespace w1_detail;
  constexpr double kLongestStep_m = 1.6;
  Random random(options.seed, 1);
  W1 work;
  const double radius = options.landmarks / 4.0;
  place_landmarks(work, options.landmarks, radius, random);
  for (std::size_t i = 0; i < work.landmarks.size(); ++i) work.all.push_back(seen(work, {}, i, random));
  const double least = 2.0 * kPi * radius / kLongestStep_m;
  const double steps_per_loop = std::max(options.landmarks >= 10'000 ? 1e4 : 1e3, std::ceil(least));
  work.steps_per_lap = static_cast<std::size_t>(steps_per_loop);
  const Twist2 twist{2.0 * kPi * radius / steps_per_loop, 0.0, 2.0 * kPi / steps_per_loop};
  work.sigma_m = options.odometry_noise * 0.05 * twist.dx;
  work.sigma_rad = options.odometry_noise * radians(0.2);
  const Matrix3 covariance =
      Vector3(work.sigma_m * work.sigma_m, 1e-12, work.sigma_rad * work.sigma_rad).asDiagonal();
  const Around around(work, radius);
  Pose2 pose;
  for (int k = 0; k < options.steps; ++k) {
    const Twist2 error{random.normal(work.sigma_m), 0.0, random.normal(work.sigma_rad)};
    SlamStep step{static_cast<double>(k), {}, {}};
    if (k > 0) {
      pose = pose * exp(twist);  // exactly on the circle: the odometry errs, and not the robot
      step.motion = {exp(twist) * exp(error), covariance, Matrix3::Zero()};
    }
    for (const std::size_t i : around.near(pose.translation(), work.sensor.max_range_m))
      if ((work.landmarks[i] - pose.translation()).norm() <= work.sensor.max_range_m)
        step.observations.push_back(seen(work, pose, i, random));
    work.in_view += static_cast<double>(step.observations.size()) / options.steps;
    work.truth.push_back(pose);
    work.steps.push_back(std::move(step));
  }
  return work;
}

}  // namespace trundle::bench
