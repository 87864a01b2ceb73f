#include "trundle/slam/smoothing/together/robust_alignment.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

namespace trundle::slam {
namespace {

/// Of them each pair of two is tried: 1770, of which a quarter is right where half of the pairs are.
constexpr std::size_t kMostTried = 60;

std::vector<double> squared_residuals(const Pose2& motion, std::span<const PointPair> pairs) {
  std::vector<double> squared;
  for (const PointPair& pair : pairs) squared.push_back((motion * pair.from - pair.to).squaredNorm());
  return squared;
}

/// The larger of the middle ones: of two pairs both count.
double middle_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

std::optional<Pose2> robust_rigid_motion(std::span<const PointPair> pairs) {
  std::vector<PointPair> tried;
  const std::size_t count = std::min(pairs.size(), kMostTried);
  for (std::size_t i = 0; i < count; ++i) tried.push_back(pairs[i * pairs.size() / count]);
  std::optional<Pose2> best;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < tried.size(); ++i)
    for (std::size_t j = i + 1; j < tried.size(); ++j) {
      const std::optional<Pose2> motion = rigid_motion(std::array{tried[i], tried[j]});
      if (!motion) continue;
      const double middle = middle_of(squared_residuals(*motion, pairs));
      if (!(middle < least)) continue;
      least = middle;
      best = motion;
    }
  if (!best) return std::nullopt;
  std::vector<PointPair> half;
  for (const PointPair& pair : pairs)
    if ((*best * pair.from - pair.to).squaredNorm() <= least) half.push_back(pair);
  return rigid_motion(half);
}

}  // namespace trundle::slam
