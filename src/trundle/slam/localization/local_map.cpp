#include "trundle/slam/localization/local_map.hpp"

#include <algorithm>
#include <limits>

#include <Eigen/LU>

#include "trundle/geometry/gaussian.hpp"

namespace trundle::slam {
namespace {

double squared_distance(const SightedPoint& a, const SightedPoint& b) {
  const Vector2 apart = a.in_body - b.in_body;
  return squared_mahalanobis(apart, a.covariance + b.covariance);
}

/// Unidentified readings of one instant show different landmarks.
bool may_be_same(const SightedPoint& a, const SightedPoint& b) {
  const bool unidentified = a.landmark == kUnknownLandmark && b.landmark == kUnknownLandmark;
  return unidentified ? a.step != b.step : a.landmark == b.landmark;
}

bool is_new_look(const SightedPoint& before) {
  return has_parallax(before.seen_from.norm(), (before.in_body - before.seen_from).norm());
}

/// What two sightings of one landmark from one place say together, whose errors may be the same: the
/// covariance intersection of both, weighted as if they were about as sure [Niehsen 2002].
void repeat(SightedPoint& point, const SightedPoint& other) {
  const double share = other.covariance.trace() / (point.covariance.trace() + other.covariance.trace());
  const Matrix2 of_point = share * point.covariance.inverse();
  const Matrix2 of_other = (1.0 - share) * other.covariance.inverse();
  point.covariance = (of_point + of_other).inverse();
  point.in_body = point.covariance * (of_point * point.in_body + of_other * other.in_body);
  point.seen_from = other.seen_from;
}

/// What two sightings of one landmark from different places say together.
void improve(SightedPoint& point, const SightedPoint& other) {
  const Matrix2 K = point.covariance * (point.covariance + other.covariance).inverse();
  point.in_body += K * (other.in_body - point.in_body);
  // Joseph's form: what is much surer afterwards is no difference of large numbers.
  const Matrix2 A = Matrix2::Identity() - K;
  point.covariance = (A * point.covariance * A.transpose() + K * other.covariance * K.transpose()).eval();
}

}  // namespace

bool are_one_place(const SightedPoint& a, const SightedPoint& b) {
  return squared_distance(a, b) <= kDefaultGate;
}

// Eq. 46.
void LocalMap::step(const Motion& motion, std::span<const Observation> observations,
                    const SystematicCovariance& systematic) {
  ++now_;
  const Pose2 back = motion.mean.inverse();
  const Matrix2 R = rotation(back.heading);
  const Eigen::Index n = systematic.rows();
  const BySystematic S = motion.by_first(n);
  const BySystematic with_motion = S * systematic;
  for (SightedPoint& point : points_) {
    point.in_body = back * point.in_body;
    point.seen_from = back * point.seen_from;
    Eigen::Matrix<double, 2, 3> by_error;
    by_error << 1.0, 0.0, -point.in_body.y(), 0.0, 1.0, point.in_body.x();
    point.covariance =
        R * point.covariance * R.transpose() + by_error * motion.covariance * by_error.transpose();
    if (n == 0) continue;
    if (point.with_systematic.cols() != n) point.with_systematic.setZero(2, n);
    point.with_systematic = (R * point.with_systematic).eval();
    const Matrix2 mixed = point.with_systematic * S.transpose() * by_error.transpose();
    point.covariance +=
        mixed + mixed.transpose() + by_error * with_motion * S.transpose() * by_error.transpose();
    point.with_systematic += by_error * with_motion;
  }
  const double largest_variance = options_.largest_sigma_m * options_.largest_sigma_m;
  std::erase_if(points_, [&](const SightedPoint& p) { return p.covariance.trace() > largest_variance; });
  novelty_.clear();
  for (const Observation& observation : observations)
    novelty_.push_back(is_valid(observation) ? add(observation) : 0.0);
  if (points_.size() > options_.most_points)
    points_.erase(points_.begin(), points_.end() - static_cast<std::ptrdiff_t>(options_.most_points));
}

/// Eq. 46a: it says how far the points were carried wrong.
void LocalMap::read_bias(const BiasReading& reading, const Systematic& systematic,
                         const SystematicCovariance& covariance) {
  if (systematic.size() == 0) return;
  const double S = covariance(0, 0) + reading.variance;
  if (S <= 0.0) return;
  for (SightedPoint& point : points_) {
    if (point.with_systematic.cols() == 0) continue;
    const Vector2 K = point.with_systematic.col(0) / S;
    point.in_body -= K * (reading.rad_s - systematic[0]);
    point.covariance -= S * K * K.transpose();
    point.with_systematic -= K * covariance.row(0);
  }
}

/// Together with what it was seen as before; in place of that, where both cannot be right. Returns its
/// novelty.
double LocalMap::add(const Observation& observation) {
  const SightedLandmark sighted = sighted_landmark({}, sensor_.body_from_sensor, observation);
  SightedPoint point{sighted.in_world, sighted.spread(reading_covariance(sensor_)), observation.landmark,
                     now_};
  const bool repeats = std::ranges::any_of(
      points_, [&](const SightedPoint& p) { return are_one_place(p, point) && !is_new_look(p); });
  const auto same = same_as(point);
  if (same != points_.end()) {
    if (same->step < now_ && are_one_place(*same, point))
      is_new_look(*same) ? improve(point, *same) : repeat(point, *same);
    points_.erase(same);
  }
  points_.push_back(point);
  return repeats ? 0.0 : 1.0;
}

/// What has the same name; of those without names the nearest in that place.
std::vector<SightedPoint>::iterator LocalMap::same_as(const SightedPoint& point) {
  auto same = points_.end();
  double least = std::numeric_limits<double>::infinity();
  for (auto p = points_.begin(); p != points_.end(); ++p) {
    if (!may_be_same(*p, point)) continue;
    const double squared = squared_distance(*p, point);
    if (squared >= least) continue;
    least = squared;
    same = p;
  }
  const bool fits = point.landmark != kUnknownLandmark || least <= kDefaultGate;
  return fits ? same : points_.end();
}

void LocalMap::forget_before(std::uint64_t step) {
  std::erase_if(points_, [&](const SightedPoint& point) { return point.step < step; });
}

}  // namespace trundle::slam
