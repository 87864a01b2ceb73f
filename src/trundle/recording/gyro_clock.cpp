#include "trundle/recording/gyro_clock.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "trundle/chassis/without_wheel.hpp"
#include "trundle/recording/alignment/replay.hpp"
#include "trundle/recording/csv/detail/table.hpp"
#include "trundle/recording/detail/clock_comparison.hpp"
#include "trundle/recording/detail/turn_windows.hpp"
#include "trundle/statistics/nth_smallest.hpp"

namespace trundle::recording {
namespace {

/// Where increments end, if there is one for each row.
std::span<const double> rows_after_the_first(const WheelStream& wheels) {
  return std::span(wheels.time_s).last(std::max<std::size_t>(wheels.time_s.size(), 1) - 1);
}

}  // namespace

GyroClock::GyroClock(const Recording& recording, const Robot& robot, const TimeOffsetOptions& options)
    : recording_(recording),
      robot_(robot),
      chassis_(without_steering(robot.chassis).value_or(robot.chassis)),
      options_(options),
      rows_(rows_of(chassis_, false)),
      is_observable_(robot.chassis.gyro && recording.gyro.time_s.size() >= 2 && !is_steered(chassis_) &&
                     observability(rows_).rank == 3),
      ends_s_(rows_after_the_first(recording.wheels), robot.chassis.wheels_time_offset_s) {}

void GyroClock::add(const Increment& increment, bool bridged) {
  if (!is_observable_) return;
  if (ends_s_.size() == 0) turns_.turn_rad.reserve(recording_.wheels.time_s.size());
  if (bridged) turns_.lost.push_back(ends_s_.size());
  turns_.turn_rad.push_back(twist_of(chassis_, rows_, increment).dtheta);
  ends_s_.push_back(increment.time_s);
}

double GyroClock::usual_interval_s(double start_s) const {
  const std::size_t count = ends_s_.size();
  return nth_smallest(count, (count - 1) / 2,
                      [&](std::size_t i) { return ends_s_[i] - (i == 0 ? start_s : ends_s_[i - 1]); });
}

std::optional<TimeOffset> GyroClock::take_offset(double start_s) {
  if (!is_observable_ || ends_s_.size() < 2) return std::nullopt;
  const double slower_s = std::max(usual_interval_s(start_s), median_step(recording_.gyro.time_s));
  const double half_s = half_of_a_window(options_.window_s, slower_s);
  std::optional<TurnIntegral> wheels(std::in_place, std::move(ends_s_), std::move(turns_));
  std::optional<TurnIntegral> gyro = integral_of_gyro(recording_.gyro, *robot_.chassis.gyro);
  OwnTurns of_wheels = own_turns(*wheels, half_s), of_gyro = own_turns(*gyro, half_s);
  // The noisier one stays where it is: its noise would change with the offset.
  const bool gyro_stays = roughness(of_gyro) > roughness(of_wheels);
  (gyro_stays ? gyro : wheels).reset();  // it has been read off
  OwnTurns& fixed = gyro_stays ? of_gyro : of_wheels;
  const TurnIntegral& moved = gyro_stays ? *wheels : *gyro;
  const double sense = gyro_stays ? -1.0 : 1.0;  // the gyro is late where the wheels are early
  const double given_s = robot_.chassis.gyro->time_offset_s;

  const Windows& windows = fixed.windows;
  for (std::size_t w = 0; w < windows.count; ++w)  // those that the other one reaches at any offset
    fixed.known[w] = fixed.known[w] &&
                     windows.time_s(w) >= moved.first_s() + sense * given_s + options_.largest_s &&
                     windows.time_s(w + 2) <= moved.last_s() + sense * given_s - options_.largest_s;
  TwoClocks clocks{.fixed = {std::move(fixed.turns)},
                   .duration_s = Eigen::VectorXd::Constant(static_cast<Eigen::Index>(windows.count), half_s),
                   .used = std::move(fixed.known),
                   .moved = [&](double offset_s, std::vector<bool>& seen) {
                     return std::vector<Eigen::MatrixXd>{turns_in(windows, moved, sense * offset_s, seen)};
                   }};
  return find_offset({.clocks = std::move(clocks),
                      .search = {.given_s = given_s,
                                 .largest_s = options_.largest_s,
                                 .step_s = 0.25 * half_s,
                                 .change_s = 0.25 * half_s,
                                 .largest_sigma_s = options_.largest_sigma_s,
                                 .least_correlation = options_.least_correlation}});
}

std::optional<TimeOffset> gyro_time_offset(const Recording& recording, const Robot& robot,
                                           const TimeOffsetOptions& options) {
  if (!robot.chassis.gyro || recording.gyro.time_s.size() < 2) return std::nullopt;
  Replay replay(recording, robot);
  GyroClock clock(recording, robot, options);
  while (const std::optional<AlignedInterval> interval = replay.next())
    clock.add(interval->increment, interval->bridged);
  if (const auto by_wheels = clock.take_offset(replay.start_s())) return by_wheels;
  if (const auto by_steering = steering_clocks(recording, robot, options).gyro) return by_steering;
  return gyro_and_reference_clocks(recording, robot, options).gyro;
}

GyroClocks gyro_and_reference_clocks(const Recording& recording, const Robot& robot,
                                     const TimeOffsetOptions& options) {
  if (!robot.chassis.gyro || recording.gyro.time_s.size() < 2 || !recording.reference.has_headings() ||
      observability(rows_of(robot.chassis, false)).rank == 3)
    return {};
  const auto path_at = [&recording, moved = robot,
                        given_s = robot.chassis.gyro->time_offset_s](double later_s) mutable {
    moved.chassis.gyro->time_offset_s = given_s + later_s;
    return motion_path(align(recording, moved), moved);
  };
  const auto joint =
      sensor_and_reference_clocks({.path_at = path_at, .sensor_step_s = median_step(recording.gyro.time_s)},
                                  recording.reference, robot, options);
  if (!joint) return {};
  const JointOffsets found = find_offsets(*joint);
  GyroClocks clocks{.is_possible = true, .gyro = found.each[0], .reference = found.each[1]};
  clocks.apart = found.apart;
  if (clocks.gyro) clocks.gyro->offset_s += robot.chassis.gyro->time_offset_s;
  return clocks;
}

}  // namespace trundle::recording
