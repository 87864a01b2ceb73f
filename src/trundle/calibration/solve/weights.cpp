#include "trundle/calibration/solve/weights.hpp"

#include <algorithm>
#include <array>
#include <optional>

#include "trundle/calibration/likelihood/chassis_likelihood.hpp"
#include "trundle/calibration/likelihood/relative_likelihood.hpp"
#include "trundle/calibration/likelihood/restricted_likelihood.hpp"
#include "trundle/calibration/noise/estimate_noise.hpp"
#include "trundle/statistics/median.hpp"

namespace trundle::calibration {
namespace {

constexpr double kWindow_s = ChassisLikelihoodOptions{}.window_s;  // over which the likelihood sums it
constexpr std::array kLongerWindows_s = {4.0 * kWindow_s, 16.0 * kWindow_s};
// A variance from so many is known to √(2/10), a weight to a fifth.
constexpr int kFewestWindows = 10;
// Parts of a run, of three windows at least, whose variances the median is taken of.
constexpr double kWindowsOfABlock = 3.0;
constexpr int kMostBlocks = 20;  // for a median that ten bad ones do not move

/// How much larger than the readings' noise that is which no motion explains, summed over windows: the median
/// over blocks of the runs. Nothing where runs are too short for such windows.
std::optional<double> redundancy_factor(const Robot& noisy, const Likelihood& likelihood, double window_s) {
  std::vector<double> factors;
  int windows = 0;
  for (std::size_t i = 0; i < likelihood.runs().size(); ++i) {
    const Run& run = likelihood.runs()[i];
    const auto& increments = run.readings.increments;
    const double duration_s = increments.empty() ? 0.0 : increments.back().time_s - run.readings.start_s;
    const int blocks =
        std::clamp(static_cast<int>(duration_s / (kWindowsOfABlock * window_s)), 1, kMostBlocks);
    const WindowSums* sums = window_s == kWindow_s ? likelihood.sums_of(i) : nullptr;
    for (const Information& block :
         chassis_likelihood(run, noisy, {}, {.blocks = blocks, .window_s = window_s, .sums = sums})) {
      if (block.count == 0) continue;
      factors.push_back(block.chi2 / block.count);
      windows += block.count;
    }
  }
  if (windows < kFewestWindows) return std::nullopt;
  return std::max(median(factors), 1e-12);
}

/// Errors that last for several windows (scrubbing, rollers) teach less than the number of windows suggests:
/// summed over longer windows they are larger than independent ones would be.
void allow_for_lasting_errors(const Robot& robot, Likelihood& likelihood) {
  const Robot noisy = noisy_robot(robot, likelihood);
  for (const double window_s : kLongerWindows_s)
    if (const auto factor = redundancy_factor(noisy, likelihood, window_s))
      likelihood.redundancy_factor = std::max(likelihood.redundancy_factor, *factor);
}

/// By how many numbers residuals were fitted: of what the reference shows at some levels, and of what the
/// readings contradict each other by, which is scaled to what it is by whatever levels. Eq. 8d.
Deviance restriction_by(const Robot& robot, const Likelihood& likelihood) {
  Likelihood of_reference = likelihood;
  of_reference.takes_out_noise = false;
  std::vector<Information> of_redundancy;
  for (std::size_t i = 0; i < likelihood.runs().size(); ++i)
    of_redundancy.push_back(redundancy_information(of_reference, i, robot));
  of_reference.uses_redundancy = false;
  return [=](const NoiseLevels& levels) mutable {
    of_reference.noise = {levels, true};
    RunsInformation runs = information_of_runs(of_reference, robot);
    for (std::size_t i = 0; i < of_redundancy.size(); ++i) runs.information[i].add(of_redundancy[i]);
    return restriction(runs).log_determinant;
  };
}

}  // namespace

void set_noise(const Robot& robot, const NoiseEstimate& noise, Likelihood& likelihood) {
  likelihood.noise = noise;
  likelihood.redundancy_factor =
      redundancy_factor(noisy_robot(robot, likelihood), likelihood, kWindow_s).value_or(1.0);
}

void find_noise(const Robot& robot, Likelihood& likelihood) {
  set_noise(robot,
            estimate_noise(likelihood.runs(), robot, likelihood.noise, restriction_by(robot, likelihood)),
            likelihood);
  allow_for_lasting_errors(robot, likelihood);
  for (std::size_t i = 0; i < likelihood.runs().size(); ++i) {
    const auto residuals =
        relative_residuals(likelihood.runs()[i], robot, likelihood.problem.parameters).residual;
    if (!residuals.empty()) likelihood.relative_covariance[i] = robust_covariance(residuals);
  }
}

}  // namespace trundle::calibration
