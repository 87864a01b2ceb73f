#include "trundle/calibration/preparation.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "trundle/calibration/initial_scale.hpp"
#include "trundle/chassis/rows.hpp"
#include "trundle/io/error.hpp"
#include "trundle/io/words.hpp"
#include "trundle/recording/time_offset.hpp"
#include "trundle/recording/turns.hpp"

namespace trundle::calibration {
namespace {

// Of the gyro's clock: at 1 rad/s, less than 0.3° of heading between its turns and the wheels'.
constexpr double kSmallOffset_s = 0.005;

/// What the logs say of the gyro's clock.
struct ClockOffset {
  double offset_s = 0.0;
  double sigma_s = 0.0;
  int recordings = 0;
};

std::optional<ClockOffset> clock_offset(std::span<const Recording> recordings, const Robot& robot) {
  double weights = 0.0;
  double sum = 0.0;
  ClockOffset clock;
  for (const Recording& recording : recordings) {
    const auto offset = gyro_time_offset(recording, robot);
    if (!offset) continue;
    const double weight = 1.0 / (offset->sigma_s * offset->sigma_s);
    weights += weight;
    sum += weight * offset->offset_s;
    ++clock.recordings;
  }
  if (clock.recordings == 0) return std::nullopt;
  clock.offset_s = sum / weights;
  clock.sigma_s = 1.0 / std::sqrt(weights);
  return clock;
}

/// Sets the gyro's clock by the logs, where they show it wrong. Returns what was done, in words.
std::optional<std::string> set_clock(std::span<const Recording> recordings, Robot& robot) {
  const auto clock = clock_offset(recordings, robot);
  if (!clock) return std::nullopt;
  double& time_offset_s = robot.chassis.gyro->time_offset_s;
  const double given_s = time_offset_s;
  if (std::abs(clock->offset_s - given_s) < std::max(kSmallOffset_s, 3.0 * clock->sigma_s))
    return std::nullopt;
  time_offset_s = clock->offset_s;
  return fmt::format("gyro.time_offset_s {} s (was {}), from the turns of gyro and wheels in {}",
                     with_sigma(clock->offset_s, clock->sigma_s), fixed(given_s, 4),
                     counted(static_cast<std::size_t>(clock->recordings), "recording"));
}

/// A fit would take one of two explanations, and a robot mirrored in its own middle is one of them: what only
/// somebody who looks at the robot can tell is not decided here.
void require_one_sense_of_turning(std::span<const Recording> recordings, std::span<const Run> runs,
                                  const Robot& robot) {
  for (std::size_t i = 0; i < runs.size(); ++i)
    if (turns_contradict(recordings[i], robot, runs[i].readings))
      throw CannotAnswer(fmt::format(
          "run {}: the gyro turns the other way than the wheels, and nothing measured from outside "
          "tells which of them is right: if the gyro is upside down write scale = {:g} under "
          "[gyro] of the robot file; if left and right are swapped swap their columns in "
          "recording.toml, or the wheels in the robot file; if all wheels count backwards turn "
          "the sign of ticks_per_revolution",
          runs[i].name, -robot.chassis.gyro->scale));
}

/// Whether the run measures anything from outside, or its readings check each other.
bool tells_something(const Run& run, const Robot& robot) {
  const bool with_gyro = robot.chassis.gyro.has_value();
  const auto is_complete = [&](const Increment& increment) { return increment.has_gyro || !with_gyro; };
  return run.measures_anything() ||
         (observability(rows_of(robot.chassis, with_gyro)).degrees_of_freedom > 0 &&
          std::ranges::any_of(run.readings.increments, is_complete));
}

/// Runs that tell nothing are no evidence of little scatter: they do not count among those that tell. Returns
/// which, in words; where no run tells anything all stay, to be told what is missing.
std::vector<std::string> leave_out_silent(const Robot& robot, std::vector<Run>& runs) {
  const auto is_silent = [&](const Run& run) { return !tells_something(run, robot); };
  std::vector<std::string> words;
  if (std::ranges::all_of(runs, is_silent)) return words;
  for (const Run& run : runs)
    if (is_silent(run))
      words.push_back(
          fmt::format("run {} tells nothing of what is calibrated: no reference{}; it is left out", run.name,
                      robot.chassis.gyro ? ", no gyro" : ", and no readings that check each other"));
  std::erase_if(runs, is_silent);
  return words;
}

/// The fit finds the minimum next to where it starts: wheels that are far off by the references start right.
/// Returns what is wrong, in words. Throws CannotAnswer where a unit is.
std::string set_scale(std::span<const Run> runs, Robot& robot) {
  const std::optional<ScaleFault> fault = scale_fault(runs, robot);
  if (!fault) return {};
  std::string words = describe({.code = FindingCode::scale, .payload = fault->ratio});
  if (fault->is_of_unit) throw CannotAnswer(words);
  scale_wheels(fault->times, robot);
  return words;
}

}  // namespace

std::vector<Run> prepare_runs(std::span<const Recording> recordings, const Robot& robot) {
  std::vector<Run> runs;
  for (const Recording& recording : recordings) runs.push_back(prepare_run(recording, robot));
  return runs;
}

Preparation prepare(std::span<const Recording> recordings, const Robot& given) {
  Preparation ready{.channels = check_channels(recordings, given),
                    .start = {},
                    .runs = {},
                    .clock = {},
                    .scale = {},
                    .silent = {}};
  ready.start = ready.channels.robot;
  ready.clock = set_clock(recordings, ready.start);
  ready.runs = prepare_runs(recordings, ready.start);
  require_one_sense_of_turning(recordings, ready.runs, ready.start);
  ready.silent = leave_out_silent(ready.start, ready.runs);
  ready.scale = set_scale(ready.runs, ready.start);
  if (ready.scale.empty()) return ready;
  ready.runs = prepare_runs(recordings, ready.start);
  leave_out_silent(ready.start, ready.runs);
  return ready;
}

}  // namespace trundle::calibration
