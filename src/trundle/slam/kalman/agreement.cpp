#include "trundle/slam/kalman/agreement.hpp"

#include <cmath>

#include <Eigen/LU>

#include "trundle/statistics/distribution.hpp"

namespace trundle {
namespace {

constexpr std::size_t kLeast = 3;  // two are taken to where two others are by some motion, nearly always
constexpr double kTail = 1e-3;     // probability of what is not taken for chance

/// The motion of least squares: about the centroids, by the angle of the summed products.
Pose2 motion_between(std::span<const SeenAndMapped> landmarks) {
  Vector2 seen = Vector2::Zero(), mapped = Vector2::Zero();
  for (const SeenAndMapped& l : landmarks) {
    seen += l.seen / static_cast<double>(landmarks.size());
    mapped += l.mapped / static_cast<double>(landmarks.size());
  }
  double along = 0.0, across = 0.0;
  for (const SeenAndMapped& l : landmarks) {
    const Vector2 a = l.seen - seen, b = l.mapped - mapped;
    along += a.dot(b);
    across += a.x() * b.y() - a.y() * b.x();
  }
  const double turn = std::atan2(across, along);
  const Vector2 shift = mapped - rotation(turn) * seen;
  return {shift.x(), shift.y(), turn};
}

}  // namespace

std::optional<Pose2> agreed_motion(std::span<const SeenAndMapped> landmarks) {
  if (landmarks.size() < kLeast) return std::nullopt;
  const Pose2 motion = motion_between(landmarks);
  const Matrix2 R = rotation(motion.heading);
  double misfit = 0.0;
  for (const SeenAndMapped& l : landmarks) {
    const Vector2 apart = l.mapped - motion * l.seen;
    const Matrix2 errors = l.seen_covariance + R * l.seen_covariance * R.transpose();
    misfit += apart.dot(errors.inverse() * apart);
  }
  const double limit = chi_squared_limit(kTail, 2.0 * static_cast<double>(landmarks.size()) - 3.0);
  return misfit < limit ? std::optional(motion) : std::nullopt;
}

}  // namespace trundle
