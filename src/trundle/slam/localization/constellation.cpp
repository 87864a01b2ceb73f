#include "trundle/slam/localization/constellation.hpp"

#include <algorithm>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "trundle/slam/report.hpp"

namespace trundle {
namespace {

constexpr std::size_t kMostPoints = 24;
constexpr double kLargestVariance_m2 = 1.0;

bool fits(const SightedPoint& a, const SightedPoint& b) {
  const Vector2 apart = a.in_body - b.in_body;
  return apart.dot((a.covariance + b.covariance).llt().solve(apart)) <= kDefaultGate;
}

/// Nameless readings of one instant show different landmarks.
bool is_same(const SightedPoint& a, const SightedPoint& b) {
  const bool nameless = a.landmark == kUnknownLandmark && b.landmark == kUnknownLandmark;
  if (!nameless) return a.landmark == b.landmark;
  return a.step != b.step && fits(a, b);
}

/// What two sightings of one landmark say together.
void improve(SightedPoint& point, const SightedPoint& other) {
  const Matrix2 K = point.covariance * (point.covariance + other.covariance).inverse();
  point.in_body += K * (other.in_body - point.in_body);
  point.covariance -= K * point.covariance;
  point.covariance = (0.5 * (point.covariance + point.covariance.transpose())).eval();
}

}  // namespace

// Eq. 46.
void Constellation::step(const Motion& motion, std::span<const Observation> observations) {
  ++now_;
  const Pose2 back = motion.mean.inverse();
  const Matrix2 R = rotation(back.heading);
  for (SightedPoint& point : points_) {
    point.in_body = back * point.in_body;
    Eigen::Matrix<double, 2, 3> by_error;
    by_error << 1.0, 0.0, -point.in_body.y(), 0.0, 1.0, point.in_body.x();
    point.covariance =
        R * point.covariance * R.transpose() + by_error * motion.covariance * by_error.transpose();
  }
  std::erase_if(points_, [](const SightedPoint& p) { return p.covariance.trace() > kLargestVariance_m2; });
  for (const Observation& observation : observations)
    if (is_valid(observation)) add(observation);
  if (points_.size() > kMostPoints)
    points_.erase(points_.begin(), points_.end() - static_cast<std::ptrdiff_t>(kMostPoints));
}

/// Together with what it was seen as before; in place of that, where both cannot be right.
void Constellation::add(const Observation& observation) {
  const SightedLandmark sighted = sighted_landmark({}, sensor_.body_from_sensor, observation);
  SightedPoint point{sighted.in_world,
                     sighted.by_reading * reading_covariance(sensor_) * sighted.by_reading.transpose(),
                     observation.landmark, now_};
  const auto same = std::ranges::find_if(points_, [&](const SightedPoint& p) { return is_same(p, point); });
  if (same != points_.end()) {
    if (same->step < now_ && fits(*same, point)) improve(point, *same);
    points_.erase(same);
  }
  points_.push_back(point);
}

void Constellation::forget_before(std::uint64_t step) {
  std::erase_if(points_, [&](const SightedPoint& point) { return point.step < step; });
}

std::size_t Constellation::fresh() const {
  return static_cast<std::size_t>(
      std::ranges::count_if(points_, [&](const SightedPoint& p) { return p.step == now_; }));
}

}  // namespace trundle
