#include "trundle/recording/gyro_clock.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "trundle/recording/alignment/gyro_turns.hpp"
#include "trundle/recording/alignment/replay.hpp"
#include "trundle/recording/csv/detail/table.hpp"
#include "trundle/recording/detail/offset_search.hpp"
#include "trundle/statistics/nth_smallest.hpp"

namespace trundle::recording {
namespace {

using Vector = Eigen::VectorXd;

// Half a window is at least so many steps of the slower sensor: twice the golden ratio, so that no two
// windows begin at the same place between two samples. Then what is read off between them is no less noisy at
// one offset than at another.
constexpr double kStepsOfHalfAWindow = 3.2360679774997897;

/// Windows that overlap by half, one after the other.
struct Windows {
  double start_s = 0.0;
  double half_s = 0.0;
  std::size_t count = 0;

  double time_s(std::size_t half) const { return start_s + half_s * static_cast<double>(half); }
};

/// None of a stream that is mostly gap, with fewer stamps than halves of windows: one wrong stamp makes
/// years.
Windows windows_of(const TurnIntegral& sensor, double half_s) {
  const double halves = std::floor((sensor.last_s() - sensor.first_s()) / half_s);
  if (halves > static_cast<double>(sensor.stamps())) return {sensor.first_s(), half_s, 0};
  return {sensor.first_s(), half_s, static_cast<std::size_t>(std::max(halves - 1.0, 0.0))};
}

/// What a sensor turned in each window, its stamps moved by `offset_s`, each instant weighed by a triangle: a
/// window with sharp ends would be as noisy as the samples that lie there. Windows that it misses are not
/// used any more.
Vector turns_in(const Windows& windows, const TurnIntegral& sensor, double offset_s,
                std::vector<bool>& used) {
  Vector turns = Vector::Zero(static_cast<Eigen::Index>(windows.count));
  std::size_t near = 0;
  TurnIntegral::Reading start = sensor.at(windows.time_s(0) - offset_s, near);
  TurnIntegral::Reading middle = sensor.at(windows.time_s(1) - offset_s, near);
  for (std::size_t w = 0; w < windows.count; ++w) {
    const TurnIntegral::Reading end = sensor.at(windows.time_s(w + 2) - offset_s, near);
    if (start.known && middle.known && end.known && start.lost_before == end.lost_after)
      turns[static_cast<Eigen::Index>(w)] = (end.area - 2.0 * middle.area + start.area) / windows.half_s;
    else
      used[w] = false;
    start = middle;
    middle = end;
  }
  return turns;
}

/// What a sensor turned in windows of its own.
struct OwnTurns {
  Windows windows;
  std::vector<bool> known;
  Vector turns;
};

OwnTurns own_turns(const TurnIntegral& sensor, double half_s) {
  OwnTurns own{windows_of(sensor, half_s), {}, {}};
  own.known.assign(own.windows.count, true);
  own.turns = turns_in(own.windows, sensor, 0.0, own.known);
  return own;
}

/// How noisy a sensor is: how much its turns jump to and fro, of how much they change. 3 of nothing but
/// noise.
double roughness(const OwnTurns& own) {
  double jumps = 0.0, changes = 0.0;
  for (Eigen::Index w = 1; w + 1 < own.turns.size(); ++w) {
    const auto i = static_cast<std::size_t>(w);
    if (!own.known[i - 1] || !own.known[i] || !own.known[i + 1]) continue;
    jumps += std::pow(own.turns[w + 1] - 2.0 * own.turns[w] + own.turns[w - 1], 2);
    changes += std::pow(own.turns[w + 1] - own.turns[w], 2);
  }
  return changes > 0.0 ? jumps / changes : 0.0;
}

TurnIntegral integral_of_gyro(const GyroStream& gyro, const Gyro& sensor) {
  const GyroSamples samples(gyro, sensor);
  Turns turns;
  turns.turn_rad.reserve(gyro.time_s.size());
  for (std::size_t i = 0; i < gyro.time_s.size(); ++i) {
    if (samples.is_lost[i]) turns.lost.push_back(i);
    turns.turn_rad.push_back(i == 0 ? 0.0 : gyro.yaw_rate_rad_s[i] * (gyro.time_s[i] - gyro.time_s[i - 1]));
  }
  return {Stamps::of(gyro.time_s), std::move(turns)};
}

/// Where increments end, if there is one for each row.
std::span<const double> rows_after_the_first(const WheelStream& wheels) {
  return std::span(wheels.time_s).last(std::max<std::size_t>(wheels.time_s.size(), 1) - 1);
}

}  // namespace

GyroClock::GyroClock(const Recording& recording, const Robot& robot, const TimeOffsetOptions& options)
    : recording_(recording),
      robot_(robot),
      options_(options),
      rows_(rows_of(robot.chassis, false)),
      is_observable_(robot.chassis.gyro && recording.gyro.time_s.size() >= 2 &&
                     observability(rows_).rank == 3),
      ends_s_(rows_after_the_first(recording.wheels), robot.chassis.wheels_time_offset_s) {}

void GyroClock::add(const Increment& increment, bool bridged) {
  if (!is_observable_) return;
  if (ends_s_.size() == 0) turns_.turn_rad.reserve(recording_.wheels.time_s.size());
  if (bridged) turns_.lost.push_back(ends_s_.size());
  turns_.turn_rad.push_back(twist_of(robot_.chassis, rows_, increment).dtheta);
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
  const double half_s = std::max(options_.window_s, kStepsOfHalfAWindow * slower_s);
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
                   .duration_s = Vector::Constant(static_cast<Eigen::Index>(windows.count), half_s),
                   .used = std::move(fixed.known),
                   .moved = [&](double offset_s, std::vector<bool>& seen) {
                     return std::vector{turns_in(windows, moved, sense * offset_s, seen)};
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
  return clock.take_offset(replay.start_s());
}

}  // namespace trundle::recording
