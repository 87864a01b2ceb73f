#include "trundle/inspection/steering_unit.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "trundle/calibration/preparation/reversed_wheel.hpp"
#include "trundle/chassis/rows.hpp"
#include "trundle/chassis/without_wheel.hpp"
#include "trundle/geometry/angle.hpp"
#include "trundle/inspection/reference_turns.hpp"
#include "trundle/io/error.hpp"
#include "trundle/recording/csv/detail/streams.hpp"

namespace trundle::inspection {
namespace {

bool is_in_radians(const WheelSeries& steering) {
  return steering.unit == WheelUnit::radians;
}

bool shows_turns(const Chassis& chassis) {
  return observability(rows_of(chassis, false)).rank == 3;
}

constexpr double kAgree = 0.9;  // correlation: 81 % of the variance

/// Whether the wheels would turn the robot as what else sees it turn, the angles being so many times as
/// large.
bool agrees_if_times(double factor, const Recording& recording, const Robot& robot) {
  Recording reread = recording;
  for (WheelSeries& steering : reread.wheels.steering)
    if (is_in_radians(steering))
      for (double& angle : steering.value) angle *= factor;
  try {
    const auto turns = turns_beside(reread, robot, overview_of(reread, robot).turns);
    return turns && std::abs(turns->correlation()) > kAgree && turns_agree(turns->in_one_sense(), robot);
  } catch (const InputError&) {
    return false;
  }
}

/// How many angles lie outside of the arc in which most lie, wherever its middle is: a reading's zero is
/// anywhere.
std::size_t outside_of_an_arc(std::vector<double> angles, double arc_rad) {
  std::erase_if(angles, [](double angle) { return std::isnan(angle); });
  for (double& angle : angles) angle = wrap_angle(angle);
  std::ranges::sort(angles);
  const std::size_t n = angles.size();
  std::size_t most = 0;
  for (std::size_t first = 0, end = 0; first < n; ++first) {
    const auto at = [&](std::size_t i) { return i < n ? angles[i] : angles[i - n] + 2.0 * kPi; };
    while (end < first + n && at(end) <= angles[first] + arc_rad) ++end;
    most = std::max(most, end - first);
  }
  return n - most;
}

/// By how much a steered wheel turns for one unit of its column; nothing where the robot file does not say.
std::optional<double> turned_by_a_unit(const WheelSeries& steering, const Robot& robot) {
  const auto wheels = robot.chassis.all_wheels();
  std::size_t index = 0;
  while (index < wheels.size() && wheel_name(robot, index) != steering.wheel) ++index;
  if (index == wheels.size() || !wheels[index].steering) return std::nullopt;
  const SteeringSensor& sensor = *wheels[index].steering;
  if (is_in_radians(steering)) return sensor.scale;
  return sensor.scale * 2.0 * kPi / sensor.ticks_per_revolution;
}

/// No wheel beside one that rolls straight ahead is steered to all sides, as angles in degrees would have it.
std::optional<Finding> all_round(const Recording& recording, const Robot& robot) {
  constexpr double kArc_rad = 4.8;       // from side to side, and the same driving back
  constexpr double kShare = 0.02;        // of readings, that noise does not put there
  constexpr double kHalfTurn_rad = 3.3;  // where angles begin again, and no farther
  const auto is_straight = [](const Wheel& wheel) {
    return wheel.kind == WheelKind::fixed && !wheel.steering;
  };
  if (std::ranges::none_of(robot.chassis.all_wheels(), is_straight)) return std::nullopt;
  for (const WheelSeries& steering : recording.wheels.steering) {
    const std::optional<double> turned_rad = turned_by_a_unit(steering, robot);
    if (!turned_rad) continue;
    std::vector<double> angles = steering.value;
    double farthest_rad = 0.0;
    for (double& angle : angles) {
      angle *= *turned_rad;
      farthest_rad = std::fmax(farthest_rad, std::abs(angle));
    }
    if (farthest_rad < kHalfTurn_rad) continue;
    const auto outside = static_cast<double>(outside_of_an_arc(std::move(angles), kArc_rad));
    if (outside < kShare * static_cast<double>(steering.value.size())) continue;
    Finding finding{.code = FindingCode::steering_unit,
                    .place = recording.wheels.origin.file,
                    .subjects = {steering_column_name(steering)},
                    .payload = payload::Amount{farthest_rad}};
    if (!is_in_radians(steering))
      finding.payload = payload::Excess{.farthest = farthest_rad, .limit = kArc_rad};
    return finding;
  }
  return std::nullopt;
}

std::vector<std::string> columns_in_radians(const Recording& recording) {
  std::vector<std::string> names;
  for (const WheelSeries& steering : recording.wheels.steering)
    if (is_in_radians(steering)) names.push_back(steering_column_name(steering));
  return names;
}

/// Of angles with which the wheels do not turn the robot as it turns.
std::optional<Finding> in_another_unit(const PairedSums& turns, const Recording& recording,
                                       const Robot& robot) {
  Finding finding{.code = FindingCode::steering_unit,
                  .place = recording.wheels.origin.file,
                  .subjects = columns_in_radians(recording)};
  if (finding.subjects.empty()) return std::nullopt;
  const double degree = kPi / 180.0;
  // Angles 57 times too large turn it to all sides; wheels that are too large turn it too far, and rightly.
  const bool turns_rightly = std::abs(turns.correlation()) > kAgree;
  if (!turns_rightly && agrees_if_times(degree, recording, robot))
    finding.payload = payload::Times{degree};
  else if (agrees_if_times(1.0 / degree, recording, robot))
    finding.payload = payload::Share{1.0 / degree};
  else
    return std::nullopt;
  return finding;
}

}  // namespace

std::optional<Finding> wrong_steering_unit(const Recording& recording, const Robot& robot,
                                           const Overview& overview) {
  if (recording.wheels.steering.empty()) return std::nullopt;
  const std::optional<PairedSums> turns =
      shows_turns(robot.chassis) ? turns_beside(recording, robot, overview.turns) : std::nullopt;
  if (turns && turns_agree(*turns, robot)) {  // or those of the wheels that are not steered do
    const std::optional<Chassis> others = without_steering(robot.chassis);
    if (!others || !shows_turns(*others)) return std::nullopt;
  } else if (turns) {
    if (const auto unit = in_another_unit(*turns, recording, robot)) return unit;
  }
  return all_round(recording, robot);
}

}  // namespace trundle::inspection
