#include "trundle/calibration/solve/contradicting_share.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <vector>

#include "trundle/calibration/likelihood/parity_windows.hpp"
#include "trundle/calibration/noise/level_search.hpp"
#include "trundle/geometry/decompositions.hpp"
#include "trundle/statistics/distribution.hpp"
#include "trundle/statistics/median.hpp"

namespace trundle::calibration {
namespace {

// A variance from so many is known to √(2/10), a weight to a fifth.
constexpr std::size_t kFewestWindows = 10;
// Parts of a run, of three windows at least, whose sizes the median is taken of.
constexpr double kWindowsOfABlock = 3.0;
constexpr int kMostBlocks = 20;  // for a median that ten bad ones do not move
// A hundredth of the wheels' sigma: less is nothing beside what else is read wrong.
constexpr double kLeastContradictingShare = 1e-4;
// Between that and all of it: to 1 %.
constexpr int kHalvings = 10;

/// The sum of readings over a window, and the variances that the least and all of the noise make of it.
struct Window {
  Eigen::VectorXd y;
  Eigen::MatrixXd least, all;

  /// Variances go with the share.
  double chi2(double share) const {
    const Eigen::MatrixXd S =
        least + (share - kLeastContradictingShare) / (1.0 - kLeastContradictingShare) * (all - least);
    return y.dot(inverse_of(S) * y);
  }
};
using Block = std::vector<Window>;

/// Beside what it should be: 1 in the median.
double size_of(const Block& block, double share) {
  double chi2 = 0.0, count = 0.0;
  for (const Window& window : block) {
    chi2 += window.chi2(share);
    count += static_cast<double>(window.y.size());
  }
  return chi2 / statistics::chi_squared_limit(0.5, count);
}

double size_of(const std::vector<Block>& blocks, double share) {
  std::vector<double> sizes;
  for (const Block& block : blocks) sizes.push_back(size_of(block, share));
  return median(sizes);
}

int blocks_of(const Run& run, double window_s) {
  const auto& increments = run.readings.increments;
  const double duration_s = increments.empty() ? 0.0 : increments.back().time_s - run.readings.start_s;
  return std::clamp(static_cast<int>(duration_s / (kWindowsOfABlock * window_s)), 1, kMostBlocks);
}

/// Of windows in which the robot drives: one that stands shows nothing of its wheels' noise, and counts that
/// do not change are not rounded anew.
void add_blocks(const Run& run, const Chassis& least, const Chassis& all, double window_s,
                const WindowSums* sums, std::vector<Block>& blocks) {
  std::vector<Block> own(static_cast<std::size_t>(blocks_of(run, window_s)));
  const std::optional<WindowSums> own_sums = sums ? std::nullopt : window_sums(run, all, window_s);
  if (own_sums) sums = &*own_sums;
  ParityWindows by_least(run, least, least, {}, window_s, sums, false);
  ParityWindows by_all(run, all, all, {}, window_s, sums, false);
  const std::size_t increments = run.readings.increments.size();
  bool drives = false;
  for (std::size_t i = 0; i < increments; ++i) {
    const auto smaller = by_least.take(), larger = by_all.take();
    drives = drives || (by_all.is_within() && any_turns(run.readings.increments[i]));
    if (!larger) continue;
    const Window window{larger->y, smaller->S, larger->S};
    if (drives && std::isfinite(window.chi2(1.0)))  // not all is exact
      own[i * own.size() / increments].push_back(window);
    drives = false;
  }
  std::ranges::copy_if(own, std::back_inserter(blocks), [](const Block& block) { return !block.empty(); });
}

}  // namespace

std::optional<ContradictingShare> contradicting_share(const Likelihood& likelihood, const Robot& robot,
                                                      double window_s) {
  const Robot least = contradicting_robot(robot, likelihood, kLeastContradictingShare);
  const Robot all = contradicting_robot(robot, likelihood, 1.0);
  std::vector<Block> blocks;
  for (std::size_t i = 0; i < likelihood.runs().size(); ++i)
    add_blocks(likelihood.runs()[i], least.chassis, all.chassis, window_s,
               window_s == kParityWindow_s ? likelihood.sums_of(i) : nullptr, blocks);
  std::size_t windows = 0;
  for (const Block& block : blocks) windows += block.size();
  if (windows < kFewestWindows) return std::nullopt;
  if (const double size = size_of(blocks, 1.0); size >= 1.0) return ContradictingShare{1.0, size};
  return ContradictingShare{consistent_level(kLeastContradictingShare, 1.0, kHalvings,
                                             [&](double share) { return size_of(blocks, share); }),
                            1.0};
}

}  // namespace trundle::calibration
