#include "trundle/inspection/detail/gyro_checks.hpp"

#include <cmath>
#include <limits>

#include "trundle/odometry/rest.hpp"
#include "trundle/recording/turns.hpp"
#include "trundle/statistics/median.hpp"

namespace trundle::inspection {
namespace {

/// 57 times too far, as well as the track is known; where wheels scrub it acts wider.
bool looks_like_degrees(double ratio, const Robot& robot) {
  constexpr double kTrackIsKnown = 1.3;  // the tape's against the one that acts: usually 1 to 1.05
  constexpr double kScrub = 2.5;         // the widest that acts where wheels scrub: docs/numbers.md
  const double degrees = 180.0 / kPi;
  return ratio < degrees * kTrackIsKnown &&
         ratio > degrees / (has_skid_wheels(robot.chassis) ? kScrub : kTrackIsKnown);
}

/// Turns as they would be if a wheel counted the other way.
PairedSums with_reversed(std::size_t wheel, const Robot& robot, AlignedReadings readings) {
  for (std::size_t i = 0; i < readings.increments.size(); ++i) {
    Increment increment = readings.increments[i];
    increment.turned[wheel] = -increment.turned[wheel];
    readings.increments.set(i, increment);
  }
  return turns_of_gyro(robot, readings);
}

/// Turns that do not agree at all: of one wheel that counts the other way, or nobody knows why.
Finding disagreement(const Recording& recording, const Robot& robot, const AlignedReadings& readings) {
  constexpr double kMuchBetter = 0.9;  // correlation: 81 % of the variance, not the 25 % of kTurnsAgree
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

std::optional<Finding> wrong_gyro_unit(const Recording& recording, const Robot& robot,
                                       const AlignedReadings& readings) {
  Robot unlimited = robot;  // degrees look like a gyro beyond its limit
  if (unlimited.chassis.gyro)
    unlimited.chassis.gyro->max_rate_rad_s = std::numeric_limits<double>::infinity();
  const auto pairs = comparable_turns_anew(recording, unlimited, readings);
  constexpr double kAgreeWell = 0.8;  // correlation, which no unit changes
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

std::optional<Finding> louder_gyro(const Recording& recording, const Robot& robot,
                                   const AlignedReadings& readings) {
  constexpr std::size_t kFewest = 100;  // differences: their median is known to 8 %
  if (!robot.chassis.gyro || recording.gyro.time_s.empty()) return std::nullopt;
  const auto rests = [](const Increment& i) { return i.has_gyro && i.duration_s > 0.0 && !any_turns(i); };
  // What one rate differs from the next by, as a density: white noise of it adds up to √Δt.
  std::vector<double> density;
  for (std::size_t i = 1; i < readings.increments.size(); ++i) {
    const Increment &before = readings.increments[i - 1], &now = readings.increments[i];
    if (!rests(before) || !rests(now)) continue;
    const double step = now.gyro_rad / now.duration_s - before.gyro_rad / before.duration_s;
    density.push_back(std::abs(step) / std::sqrt(1.0 / now.duration_s + 1.0 / before.duration_s));
  }
  if (density.size() < kFewest) return std::nullopt;
  const double told = robot.chassis.gyro->noise_rad_s_sqrt_hz, seen = kSigmaOfMedian * median(density);
  if (seen <= RestOptions{}.gyro_noise_factor * told) return std::nullopt;
  return Finding{
      .code = FindingCode::noise, .place = recording.gyro.origin.file, .payload = payload::Range{told, seen}};
}

void compare_gyro(const Recording& recording, const Robot& robot, const AlignedReadings& readings,
                  std::vector<Finding>& problems) {
  constexpr double kMuchTurning = 1.0;  // [rad], root of the sum of squares
  constexpr double kFarOff = 1.8;       // slip makes less of it, wheels that scrub more
  const auto pairs = comparable_turns(recording, robot, readings);
  if (!pairs) return;
  const double slope = pairs->slope();
  if (pairs->correlation() < -kTurnsAgree)
    problems.push_back({.code = FindingCode::gyro_sign, .place = recording.gyro.origin.file});
  else if (pairs->correlation() < kTurnsAgree && pairs->lesser() > kMuchTurning)
    problems.push_back(disagreement(recording, robot, readings));
  else if (pairs->correlation() > kTurnsAgree && !has_skid_wheels(robot.chassis) &&
           (slope > kFarOff || slope < 1.0 / kFarOff))
    problems.push_back({.code = FindingCode::gyro_against_wheels,
                        .place = recording.wheels.origin.file,
                        .payload = payload::Times{slope}});
}

}  // namespace trundle::inspection
