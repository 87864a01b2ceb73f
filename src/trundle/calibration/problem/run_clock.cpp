#include "trundle/calibration/problem/run_clock.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "trundle/calibration/problem/problem.hpp"
#include "trundle/io/words.hpp"
#include "trundle/odometry/odometer.hpp"

namespace trundle::calibration {
namespace {

/// Leaves out the epochs that the reference does not show, with its stamps as they are and earlier and later
/// by `slack_s`.
void leave_out_unseen_epochs(const Robot& robot, double slack_s, Run& run) {
  std::vector<std::size_t> epochs, jumps;
  bool jumped = false;
  for (std::size_t epoch = 0; epoch < run.epochs.size(); ++epoch) {
    jumped = jumped || std::ranges::binary_search(run.jumps, epoch);
    const double time_s = run.epoch_time(epoch) - robot.reference_time_offset_s;
    const auto is_unseen = [&](double at_s) { return sample_reference(run.reference, at_s).empty(); };
    if (is_unseen(time_s - slack_s) || is_unseen(time_s) || is_unseen(time_s + slack_s)) continue;
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

void move_clock(const ClockStep& step, const Robot& robot, Run& run) {
  move_stamps(step.step_s, run.reference);
  run.clock_moved_s += step.step_s;
  run.clock_sigma_s = step.sigma_s;
  const std::size_t start = run.epochs.front();
  leave_out_unseen_epochs(robot, 0.0, run);
  if (run.epochs.empty() || run.epochs.front() != start) run.start_heading_rad.reset();
}

void let_clocks_move(const Robot& robot, std::span<Run> runs) {
  for (Run& run : runs) leave_out_unseen_epochs(robot, kClockPrior_s, run);
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
