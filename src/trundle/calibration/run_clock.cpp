#include "trundle/calibration/run_clock.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "trundle/calibration/problem.hpp"
#include "trundle/io/words.hpp"
#include "trundle/odometry/odometer.hpp"

namespace trundle::calibration {
namespace {

constexpr double kPriorPrecision = 1.0 / (kClockPrior_s * kClockPrior_s);  // s^-2

void leave_out_unseen_epochs(const Robot& robot, Run& run) {
  std::vector<std::size_t> epochs, jumps;
  bool jumped = false;
  for (std::size_t epoch = 0; epoch < run.epochs.size(); ++epoch) {
    jumped = jumped || std::ranges::binary_search(run.jumps, epoch);
    if (sample_reference(run.reference, run.epoch_time(epoch) - robot.reference_time_offset_s).empty())
      continue;
    if (jumped && !epochs.empty()) jumps.push_back(epochs.size());
    jumped = false;
    epochs.push_back(run.epochs[epoch]);
  }
  run.epochs = std::move(epochs);
  run.jumps = std::move(jumps);
}

}  // namespace

bool has_own_clock(const Run& run, std::span<const Parameter> parameters) {
  return run.reference_clock && !run.epochs.empty() && parameters.size() < kMaxParameters &&
         !contains(parameters, ParameterKind::time_offset);
}

std::vector<Parameter> with_clock(std::span<const Parameter> parameters) {
  std::vector<Parameter> all(parameters.begin(), parameters.end());
  all.push_back({ParameterKind::time_offset, -1});
  return all;
}

ClockStep clock_step(const Information& with_clock, double moved_s) {
  const Eigen::Index t = with_clock.gradient.size() - 1;
  const double precision = with_clock.matrix(t, t) + kPriorPrecision;
  return {(with_clock.gradient[t] - kPriorPrecision * moved_s) / precision, 1.0 / std::sqrt(precision)};
}

std::vector<Information> without_clock(const std::vector<Information>& blocks, double moved_s) {
  Information sum = Information::zero(blocks.front().gradient.size());
  for (const Information& block : blocks) sum.add(block);
  const Eigen::Index n = sum.gradient.size() - 1;
  const auto [step_s, sigma_s] = clock_step(sum, moved_s);
  const Eigen::VectorXd follows = -sigma_s * sigma_s * sum.matrix.col(n).head(n);  // ∂clock/∂p

  std::vector<Information> result;
  for (const Information& block : blocks) {
    const Eigen::VectorXd shared = block.matrix.col(n).head(n);
    const double own = block.matrix(n, n);
    const double gradient = block.gradient[n] - step_s * own;  // where the clock fits best
    result.push_back({.matrix = block.matrix.topLeftCorner(n, n) + shared * follows.transpose() +
                                follows * shared.transpose() + own * follows * follows.transpose(),
                      .gradient = block.gradient.head(n) - step_s * shared + gradient * follows,
                      .chi2 = block.chi2 - step_s * (block.gradient[n] + gradient),
                      .count = block.count});
  }
  const double from_prior_s = moved_s + step_s;  // one residual more
  result.push_back({.matrix = kPriorPrecision * follows * follows.transpose(),
                    .gradient = -kPriorPrecision * from_prior_s * follows,
                    .chi2 = kPriorPrecision * from_prior_s * from_prior_s,
                    .count = 1});
  return result;
}

void move_clock(const ClockStep& step, const Robot& robot, Run& run) {
  move_stamps(step.step_s, run.reference);
  run.clock_moved_s += step.step_s;
  run.clock_sigma_s = step.sigma_s;
  leave_out_unseen_epochs(robot, run);
}

std::optional<TimeOffset> clock_of(const Run& run) {
  std::optional<TimeOffset> clock = run.reference_clock;
  if (clock && run.clock_sigma_s < kClockPrior_s) {
    clock->offset_s += run.clock_moved_s;
    clock->sigma_s = run.clock_sigma_s;
  }
  return clock;
}

std::optional<std::string> words_of_clocks(std::span<const Run> runs,
                                           const std::optional<std::string>& shared) {
  std::vector<double> offsets_s;
  for (const Run& run : runs)
    if (const auto clock = clock_of(run)) offsets_s.push_back(clock->offset_s);
  if (offsets_s.empty()) return shared;
  const auto [least, most] = std::ranges::minmax(offsets_s);
  return fmt::format(
      "{}reference.time_offset_s {} s, from the ways and turns that reference and robot show in {}{}",
      shared ? *shared + "; " : "",
      offsets_s.size() == 1 ? fixed(least, 3) : fmt::format("{} to {}", fixed(least, 3), fixed(most, 3)),
      counted(offsets_s.size(), "run"),
      runs.size() == offsets_s.size() ? "" : fmt::format(" of {}", runs.size()));
}

}  // namespace trundle::calibration
