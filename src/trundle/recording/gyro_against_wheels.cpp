#include "trundle/recording/detail/gyro_against_wheels.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "trundle/chassis/rows.hpp"

namespace trundle {
namespace {

PairedSums turns_of_gyro(const Robot& robot, const AlignedReadings& readings) {
  const Gyro& gyro = *robot.chassis.gyro;
  return turn_pairs(robot, readings, [&](const Increment& increment) {
    return increment.has_gyro ? (increment.gyro_rad - gyro.bias_rad_s * increment.duration_s) * gyro.scale
                              : std::numeric_limits<double>::quiet_NaN();
  });
}

/// Turns of both; nothing where the robot hardly turns, or only one of the two sees it.
std::optional<PairedSums> comparable_turns(const Recording& recording, const Robot& robot,
                                           const AlignedReadings& readings) {
  if (!robot.chassis.gyro || recording.gyro.time_s.empty() ||
      observability(rows_of(robot.chassis, false)).rank < 3)
    return std::nullopt;
  const PairedSums pairs = turns_of_gyro(robot, readings);
  if (std::sqrt(pairs.xx) < kLeastTurning_rad || pairs.yy == 0.0) return std::nullopt;
  return pairs;
}

constexpr double kAgree = 0.5;  // correlation of turns that show the same motion

/// 57 times too far, as well as the track is known; where wheels scrub it acts wider.
bool looks_like_degrees(double ratio, const Robot& robot) {
  constexpr double kTrackIsKnown = 1.3, kScrub = 2.5;
  const double degrees = 180.0 / kPi;
  return ratio < degrees * kTrackIsKnown &&
         ratio > degrees / (has_skid_wheels(robot.chassis) ? kScrub : kTrackIsKnown);
}

/// Turns as they would be if a wheel counted the other way.
PairedSums with_reversed(std::size_t wheel, const Robot& robot, AlignedReadings readings) {
  for (Increment& increment : readings.increments) increment.turned[wheel] = -increment.turned[wheel];
  return turns_of_gyro(robot, readings);
}

/// Turns that do not agree at all.
std::string disagreement(const Robot& robot, const AlignedReadings& readings) {
  constexpr double kMuchBetter = 0.9;
  for (std::size_t w = 0; w < robot.wheel_names.size(); ++w)
    if (with_reversed(w, robot, readings).correlation() > kMuchBetter)
      return fmt::format("'{}' counts backwards, as the gyro tells: write ticks_per_revolution = {:g}",
                         robot.wheel_names[w], -robot.chassis.wheels()[w].ticks_per_revolution);
  return "the wheels do not turn the robot as the gyro sees it turn: is every column that of its wheel?";
}

}  // namespace

PairedSums turn_pairs(const Robot& robot, const AlignedReadings& readings,
                      const std::function<double(const Increment&)>& other_turn) {
  constexpr double kPiece_s = 0.5;
  const Rows rows = rows_of(robot.chassis, false);
  PairedSums pairs;
  double by_wheels = 0.0, by_other = 0.0, duration_s = 0.0;
  for (const Increment& increment : readings.increments) {
    const double turn = other_turn(increment);
    if (std::isnan(turn)) continue;
    by_wheels += twist_of(robot.chassis, rows, increment).dtheta;
    by_other += turn;
    duration_s += increment.duration_s;
    if (duration_s < kPiece_s) continue;
    pairs.add(by_wheels, by_other);
    by_wheels = by_other = duration_s = 0.0;
  }
  return pairs;
}

std::optional<Problem> wrong_gyro_unit(const Recording& recording, const Robot& robot,
                                       const AlignedReadings& readings) {
  Robot unlimited = robot;  // degrees look like a gyro beyond its limit
  if (unlimited.chassis.gyro)
    unlimited.chassis.gyro->max_rate_rad_s = std::numeric_limits<double>::infinity();
  AlignedReadings all = readings;
  all.problems.clear();
  add_gyro(recording.gyro, unlimited, all);
  const auto pairs = comparable_turns(recording, unlimited, all);
  constexpr double kAgreeWell = 0.8;
  if (!pairs || std::abs(pairs->correlation()) < kAgreeWell) return std::nullopt;
  const double slope = std::abs(pairs->slope());
  const auto problem = [&](const std::string& message) {
    return Problem{Severity::warning, ProblemKind::gyro_unit, recording.gyro.origin.file, 1, message};
  };
  if (looks_like_degrees(slope, robot))
    return problem(
        fmt::format("the gyro turns {:.0f} times as far as the wheels; degrees per second would make it "
                    "57: write unit = \"deg/s\" at yaw_rate_rad_s in recording.toml",
                    slope));
  if (!has_skid_wheels(robot.chassis) &&
      looks_like_degrees(1.0 / slope, robot))  // scrubbing wheels may turn in vain
    return problem(
        fmt::format("the gyro turns {:.2g} of what the wheels do, where radians taken for degrees would "
                    "make it 1/57: leave out unit = \"deg/s\"",
                    slope));
  return std::nullopt;
}

void compare_gyro(const Recording& recording, const Robot& robot, const AlignedReadings& readings,
                  std::vector<Problem>& problems) {
  constexpr double kMuchTurning = 1.0;  // [rad], root of the sum of squares
  constexpr double kFarOff = 1.8;       // slip makes less of it, wheels that scrub more
  const auto pairs = comparable_turns(recording, robot, readings);
  if (!pairs) return;
  const auto warn = [&](ProblemKind kind, const std::string& file, const std::string& message) {
    problems.push_back({Severity::warning, kind, file, 1, message});
  };
  const double slope = pairs->slope();
  if (pairs->correlation() < -kAgree)
    warn(ProblemKind::gyro_sign, recording.gyro.origin.file,
         "the gyro turns the other way than the wheels: it is mounted upside down ([gyro] scale = -1) or "
         "left and right are swapped");
  else if (pairs->correlation() < kAgree && pairs->lesser() > kMuchTurning)
    warn(ProblemKind::gyro_against_wheels, recording.wheels.origin.file, disagreement(robot, readings));
  else if (pairs->correlation() > kAgree && !has_skid_wheels(robot.chassis) &&
           (slope > kFarOff || slope < 1.0 / kFarOff))
    warn(ProblemKind::gyro_against_wheels, recording.wheels.origin.file,
         fmt::format(
             "the gyro turns {:.3g} times as far as the wheels with the robot file as given: check y_m "
             "(half the track), ticks_per_revolution, gears and diameters",
             slope));
}

bool turns_contradict(const Recording& recording, const Robot& robot, const AlignedReadings& readings) {
  constexpr double kClearTurning = 0.5;  // [rad], root of the sum of squares
  const auto pairs = comparable_turns(recording, robot, readings);
  return pairs && pairs->correlation() < -kAgree && pairs->lesser() > kClearTurning;
}

}  // namespace trundle
