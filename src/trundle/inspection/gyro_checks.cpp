#include "trundle/inspection/detail/gyro_checks.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "trundle/calibration/preparation/reversed_wheel.hpp"
#include "trundle/odometry/gyro_noise.hpp"
#include "trundle/odometry/odometer.hpp"
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

constexpr double kHardlyTurns = 0.1;  // of what the wheels turn: no track is so far off

/// What may be wrong, besides what travel is counted by, where the gyro turns so many times as far as the
/// wheels.
std::vector<std::string> sizes_of_turns(const Chassis& chassis, double times) {
  std::vector<std::string> keys;
  if (times < kHardlyTurns) keys = {"the axis of the gyro's column (up)", "the sign of each wheel"};
  keys.emplace_back("y_m (half the track)");
  if (is_steered(chassis)) keys.emplace_back("x_m and steering_scale of steered wheels");
  return keys;
}

/// Whether the robot turns by more than noise: by the gyro more than its bias, as the robot file knows it,
/// may make, or by the wheels, beside what those do that roll unevenly or not at all.
bool is_turning(const Robot& robot, const Overview& overview) {
  const double by_bias_rad = odometry::initial_bias_sigma(robot) * overview.turns_of_a_bias_s;
  return std::sqrt(overview.turns.yy) > std::max(kLeastTurning_rad, kSignificant * by_bias_rad) ||
         (overview.gyro_beside_wheels && overview.gyro_beside_wheels->wheels_turn_rad > kMuchTurning_rad);
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

std::optional<Finding> wrong_gyro_bias(const Recording& recording, const Robot& robot,
                                       const Overview& overview) {
  constexpr double kAgreeWell = 0.9;  // correlation: 81 % of the variance
  const std::optional<SteadyTurn>& steady = overview.gyro_beside_wheels;
  if (!steady || std::abs(steady->correlation) < kAgreeWell) return std::nullopt;
  const std::optional<TimeOffset>& clock = overview.gyro_time_offset;
  if (clock && is_off(*clock, robot.chassis.gyro->time_offset_s))
    return std::nullopt;  // turns of other times
  const Gyro& gyro = *robot.chassis.gyro;
  const double off_rad_s = steady->rate_rad_s / gyro.scale;
  const double likely_rad_s = std::hypot(odometry::initial_bias_sigma(robot),
                                         gyro.bias_walk_rad_s_sqrt_s * std::sqrt(steady->duration_s));
  if (std::abs(off_rad_s) < RestOptions{}.sigmas * std::hypot(likely_rad_s, steady->sigma_rad_s / gyro.scale))
    return std::nullopt;
  return Finding{.code = FindingCode::gyro_bias,
                 .place = recording.gyro.origin.file,
                 .payload = payload::SteadyRate{.duration_s = steady->duration_s,
                                                .rate_rad_s = gyro.bias_rad_s + off_rad_s,
                                                .bias_rad_s = gyro.bias_rad_s,
                                                .sigma_rad_s = likely_rad_s}};
}

std::optional<Finding> wrong_turns(const Recording& recording, const Robot& robot, const Overview& overview,
                                   bool counts_turns) {
  const PairedSums& turns = overview.turns;
  if (turns.xx < kLeastTurning_rad * kLeastTurning_rad || !is_turning(robot, overview) ||
      turns_agree(turns, robot))
    return std::nullopt;
  if (const auto wheel = reversed_wheel(turns, align(recording, robot), robot))
    return reversal(*wheel, recording, robot);
  if (turns.correlation() < -kTurnsAgree)
    return Finding{.code = FindingCode::gyro_sign, .place = recording.gyro.origin.file};
  Finding contrary{.code = FindingCode::gyro_against_wheels, .place = recording.wheels.origin.file};
  if (turns.correlation() <= kTurnsAgree && turns.lesser() > kMuchTurning_rad) return contrary;
  const bool agree = turns.correlation() > kTurnsAgree;
  const double times = agree ? turns.slope() : std::sqrt(turns.yy / turns.xx);
  if (!agree && (times > kHardlyTurns || !counts_turns)) return std::nullopt;
  contrary.payload = payload::Times{times};
  contrary.subjects = sizes_of_turns(robot.chassis, times);
  return contrary;
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

}  // namespace trundle::inspection
