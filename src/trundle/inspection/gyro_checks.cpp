#include "trundle/inspection/detail/gyro_checks.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "trundle/calibration/preparation/reversed_wheel.hpp"
#include "trundle/odometry/gyro_noise.hpp"
#include "trundle/odometry/rest.hpp"
#include "trundle/recording/alignment/align.hpp"
#include "trundle/recording/turns.hpp"
#include "trundle/statistics/distribution.hpp"

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

/// Of a wheel in counts those; what is no count has no sign of its own.
Finding reversal(std::size_t wheel, const Recording& recording, Robot robot) {
  const bool in_ticks = robot.chassis.wheels()[wheel].ticks_per_revolution != 0.0;
  Finding finding = turn_around(wheel, in_ticks, robot);
  finding.place = recording.wheels.origin.file;
  return finding;
}

/// By which keys of the robot file, besides those of travel, its wheels turn it farther or less far.
std::vector<std::string> sizes_of_turns(const Chassis& chassis) {
  std::vector<std::string> keys = {"y_m (half the track)"};
  if (is_steered(chassis)) keys.emplace_back("x_m and steering_scale of steered wheels");
  return keys;
}

/// Whether the gyro sees the robot turn by more than its bias, as the robot file knows it, may make: else
/// what it says beside the wheels' noise is chance.
bool sees_turns(const Gyro& gyro, const Overview& overview) {
  const double by_bias_rad = gyro.bias_sigma_rad_s * overview.turns_of_a_bias_s;
  return std::sqrt(overview.turns.yy) > std::max(kLeastTurning_rad, kSignificant * by_bias_rad);
}

}  // namespace

std::optional<Finding> wrong_gyro_unit(const Recording& recording, const Robot& robot,
                                       const Overview& overview) {
  const auto pairs = if_enough(overview.turns_unlimited);  // degrees look like a gyro beyond its limit
  constexpr double kAgreeWell = 0.8;                       // correlation, which no unit changes
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

std::optional<Finding> louder_gyro(const Recording& recording, const Robot& robot) {
  if (!robot.chassis.gyro) return std::nullopt;
  const double told = robot.chassis.gyro->noise_rad_s_sqrt_hz;
  const std::optional<GyroNoise> seen = gyro_noise(recording, robot.chassis);
  if (!seen || !is_louder(*seen, RestOptions{}.gyro_noise_factor * told)) return std::nullopt;
  return Finding{.code = FindingCode::noise,
                 .place = recording.gyro.origin.file,
                 .payload = payload::Range{told, seen->noise_rad_s_sqrt_hz}};
}

void compare_gyro(const Recording& recording, const Robot& robot, const Overview& overview,
                  std::vector<Finding>& problems) {
  constexpr double kMuchTurning = 1.0;  // [rad], root of the sum of squares
  const auto pairs = if_enough(overview.turns);
  if (!pairs || !sees_turns(*robot.chassis.gyro, overview) || turns_agree(*pairs, robot)) return;
  Finding contrary{.code = FindingCode::gyro_against_wheels, .place = recording.wheels.origin.file};
  if (const auto wheel = reversed_wheel(*pairs, align(recording, robot), robot))
    problems.push_back(reversal(*wheel, recording, robot));
  else if (pairs->correlation() < -kTurnsAgree)
    problems.push_back({.code = FindingCode::gyro_sign, .place = recording.gyro.origin.file});
  else if (pairs->correlation() < kTurnsAgree && pairs->lesser() > kMuchTurning)
    problems.push_back(std::move(contrary));
  else if (pairs->correlation() > kTurnsAgree) {
    contrary.payload = payload::Times{pairs->slope()};
    contrary.subjects = sizes_of_turns(robot.chassis);
    problems.push_back(std::move(contrary));
  }
}

}  // namespace trundle::inspection
