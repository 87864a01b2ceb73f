#include "trundle/slam/ekf/agreement.hpp"

#include <vector>

#include <Eigen/LU>

#include "trundle/geometry/rigid_motion.hpp"
#include "trundle/statistics/distribution.hpp"

namespace trundle {
namespace {

constexpr std::size_t kLeast = 3;  // two are taken to where two others are by some motion, nearly always
constexpr double kTail = 1e-3;     // probability of what is not taken for chance

}  // namespace

std::optional<Pose2> agreed_motion(std::span<const SeenAndMapped> landmarks) {
  if (landmarks.size() < kLeast) return std::nullopt;
  std::vector<PointPair> places;
  for (const SeenAndMapped& l : landmarks) places.push_back({l.seen, l.mapped});
  const std::optional<Pose2> motion = rigid_motion(places);
  if (!motion) return std::nullopt;
  const Matrix2 R = rotation(motion->heading);
  double misfit = 0.0;
  for (const SeenAndMapped& l : landmarks) {
    const Vector2 apart = l.mapped - *motion * l.seen;
    const Matrix2 errors = l.seen_covariance + R * l.seen_covariance * R.transpose();
    misfit += apart.dot(errors.inverse() * apart);
  }
  const double limit = chi_squared_limit(kTail, 2.0 * static_cast<double>(landmarks.size()) - 3.0);
  return misfit < limit ? motion : std::nullopt;
}

}  // namespace trundle
