#include "trundle/recording/detail/gyro_against_wheels.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

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

/// Turns that do not agree at all: of one wheel that counts the other way, or nobody knows why.
Finding disagreement(const Recording& recording, const Robot& robot, const AlignedReadings& readings) {
  constexpr double kMuchBetter = 0.9;
  Finding finding{.code = FindingCode::gyro_against_wheels, .place = recording.wheels.origin.file};
  for (std::size_t w = 0; w < robot.wheel_names.size(); ++w) {
    if (with_reversed(w, robot, readings).correlation() <= kMuchBetter) continue;
    finding.subjects = {robot.wheel_names[w]};
    finding.payload = payload::Amount{-robot.chassis.wheels()[w].ticks_per_revolution};
    break;
  }
  return finding;
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

std::optional<Finding> wrong_gyro_unit(const Recording& recording, const Robot& robot,
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
  Finding finding{.code = FindingCode::gyro_unit, .place = recording.gyro.origin.file};
  if (looks_like_degrees(slope, robot))
    finding.payload = payload::Times{slope};
  else if (!has_skid_wheels(robot.chassis) &&
           looks_like_degrees(1.0 / slope, robot))  // scrubbing wheels may turn in vain
    finding.payload = payload::Share{slope};
  else
    return std::nullopt;
  return finding;
}

void compare_gyro(const Recording& recording, const Robot& robot, const AlignedReadings& readings,
                  std::vector<Finding>& problems) {
  constexpr double kMuchTurning = 1.0;  // [rad], root of the sum of squares
  constexpr double kFarOff = 1.8;       // slip makes less of it, wheels that scrub more
  const auto pairs = comparable_turns(recording, robot, readings);
  if (!pairs) return;
  const double slope = pairs->slope();
  if (pairs->correlation() < -kAgree)
    problems.push_back({.code = FindingCode::gyro_sign, .place = recording.gyro.origin.file});
  else if (pairs->correlation() < kAgree && pairs->lesser() > kMuchTurning)
    problems.push_back(disagreement(recording, robot, readings));
  else if (pairs->correlation() > kAgree && !has_skid_wheels(robot.chassis) &&
           (slope > kFarOff || slope < 1.0 / kFarOff))
    problems.push_back({.code = FindingCode::gyro_against_wheels,
                        .place = recording.wheels.origin.file,
                        .payload = payload::Times{slope}});
}

bool turns_contradict(const Recording& recording, const Robot& robot, const AlignedReadings& readings) {
  constexpr double kClearTurning = 0.5;  // [rad], root of the sum of squares
  const auto pairs = comparable_turns(recording, robot, readings);
  return pairs && pairs->correlation() < -kAgree && pairs->lesser() > kClearTurning;
}

}  // namespace trundle
