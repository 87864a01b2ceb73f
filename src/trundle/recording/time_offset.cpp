#include "trundle/recording/time_offset.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <Eigen/Core>

#include "trundle/chassis/rows.hpp"
#include "trundle/recording/alignment/gyro_turns.hpp"
#include "trundle/recording/csv/detail/table.hpp"
#include "trundle/recording/detail/offset_search.hpp"

namespace trundle::recording {
namespace {

using Vector = Eigen::VectorXd;

/// Windows of contiguous intervals, and what the wheels turned in each.
struct Windows {
  std::vector<double> time_s;  ///< where they start, and where the last one ends
  std::vector<bool> used;
  Vector by_wheels;
  Vector duration_s;

  std::size_t count() const { return used.size(); }
};

/// Windows of the wheels alone; those for which the gyro runs at any offset of the search.
Windows windows_of(const Recording& recording, const AlignedReadings& readings, const Robot& robot,
                   const TimeOffsetOptions& options) {
  Windows windows{.time_s = {readings.start_s}, .used = {}, .by_wheels = {}, .duration_s = {}};
  const Rows rows = rows_of(robot.chassis, false);
  const double gyro_offset_s = robot.chassis.gyro->time_offset_s;
  const double start_s = recording.gyro.time_s.front() + gyro_offset_s + options.largest_s;
  const double end_s = recording.gyro.time_s.back() + gyro_offset_s - options.largest_s;
  std::vector<double> turns, durations;
  double turn = 0.0, duration_s = 0.0;
  bool whole = true;
  const auto& increments = readings.increments;
  for (std::size_t i = 0; i < increments.size(); ++i) {
    const Increment increment = increments[i];
    turn += twist_of(robot.chassis, rows, increment).dtheta;
    duration_s += increment.duration_s;
    whole = whole && !readings.bridged[i];
    if (duration_s < options.window_s - 1e-9) continue;
    const double end = increment.time_s;
    windows.time_s.push_back(end);
    windows.used.push_back(whole && end - duration_s >= start_s && end <= end_s);
    turns.push_back(turn);
    durations.push_back(duration_s);
    turn = duration_s = 0.0;
    whole = true;
  }
  windows.by_wheels = Eigen::Map<const Vector>(turns.data(), static_cast<Eigen::Index>(turns.size()));
  windows.duration_s =
      Eigen::Map<const Vector>(durations.data(), static_cast<Eigen::Index>(durations.size()));
  return windows;
}

/// What the gyro turned in each window with its stamps moved by `offset_s`. Windows that it misses are not
/// used any more.
Vector turns_by_gyro(const GyroAngles& gyro, double offset_s, const Windows& windows,
                     std::vector<bool>& used) {
  Vector turns = Vector::Zero(static_cast<Eigen::Index>(windows.count()));
  std::size_t near = 0, step = 0;  // in samples; a window mostly has as many as the one before
  GyroIntegral::Reading start = gyro.at(windows.time_s.front() - offset_s, near);
  for (std::size_t w = 0; w < windows.count(); ++w) {
    const std::size_t before = near;
    near = std::min(near + step, gyro.size());
    const GyroIntegral::Reading end = gyro.at(windows.time_s[w + 1] - offset_s, near);
    step = near - before;
    const std::optional<double> turn = GyroIntegral::turn(start, end);
    if (!turn) used[w] = false;
    turns[static_cast<Eigen::Index>(w)] = turn.value_or(0.0);
    start = end;
  }
  return turns;
}

}  // namespace

std::optional<TimeOffset> gyro_time_offset(const Recording& recording, const Robot& robot,
                                           const TimeOffsetOptions& options) {
  if (!robot.chassis.gyro || recording.gyro.time_s.size() < 2) return std::nullopt;
  return gyro_time_offset(recording, align(recording, robot), robot, options);
}

std::optional<TimeOffset> gyro_time_offset(const Recording& recording, const AlignedReadings& readings,
                                           const Robot& robot, const TimeOffsetOptions& options) {
  if (!robot.chassis.gyro || recording.gyro.time_s.size() < 2) return std::nullopt;
  if (observability(rows_of(robot.chassis, false)).rank < 3) return std::nullopt;
  const double gyro_step_s = median_step(recording.gyro.time_s);
  const Windows windows = windows_of(recording, readings, robot, options);
  const GyroAngles angles(GyroSamples(recording.gyro, *robot.chassis.gyro));
  TwoClocks clocks{.fixed = {windows.by_wheels},
                   .duration_s = windows.duration_s,
                   .used = windows.used,
                   .moved = [&](double offset_s, std::vector<bool>& used) {
                     return std::vector{turns_by_gyro(angles, offset_s, windows, used)};
                   }};
  return find_offset(std::move(clocks), {.given_s = robot.chassis.gyro->time_offset_s,
                                         .largest_s = options.largest_s,
                                         .step_s = std::max(0.25 * options.window_s, 0.5 * gyro_step_s),
                                         .sample_s = gyro_step_s,
                                         .least_sigma_s = gyro_step_s / 50.0,
                                         .largest_sigma_s = options.largest_sigma_s,
                                         .least_correlation = options.least_correlation});
}

}  // namespace trundle::recording
