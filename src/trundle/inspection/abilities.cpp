#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "trundle/chassis/contact.hpp"
#include "trundle/inspection/inspect.hpp"
#include "trundle/slip/parity.hpp"

namespace trundle::inspection {
namespace {

std::string name_of(const Row& row, const Robot& robot) {
  switch (row.kind) {
    case RowKind::gyro:
      return "gyro";
    case RowKind::forward:
      return "forward speed";
    case RowKind::turn:
      return "turn rate";
    default:
      return "'" + robot.wheel_names[static_cast<std::size_t>(row.wheel)] + "'";
  }
}

std::string in_words(const Vector3& direction) {
  std::vector<std::string> parts;
  constexpr std::array kNames = {"forward", "sideways", "turning"};
  for (int i = 0; i < 3; ++i)
    if (std::abs(direction[i]) > 0.1) parts.emplace_back(kNames[static_cast<std::size_t>(i)]);
  return fmt::format("{}", fmt::join(parts, " with "));
}

/// That a wheel does not skid sideways is an assumption, but where its direction is read.
bool excludes_sideways(const Rows& rows, const Chassis& chassis) {
  return std::any_of(rows.row.begin(), rows.row.begin() + rows.count(), [&](const Row& row) {
    const bool has_encoder = row.wheel >= 0 && row.wheel < chassis.wheel_count;
    return !row.measured() &&
           !(has_encoder && chassis.wheels()[static_cast<std::size_t>(row.wheel)].steering);
  });
}

void add_motion(const Rows& rows, const Observability& seen, const Robot& robot, Abilities& abilities) {
  if (seen.rank == 3)
    abilities.can.push_back(
        excludes_sideways(rows, robot.chassis)
            ? "the motion: forward and turning are measured; sideways is taken as zero, not measured"
            : "the motion: forward, sideways and turning are all measured");
  for (const Vector3& direction : seen.unobservable)
    abilities.cannot.push_back(fmt::format("{} motion: no sensor sees it", in_words(direction)));
}

void add_steering(const Robot& robot, Abilities& abilities) {
  for (std::size_t i = 0; i < robot.chassis.all_wheels().size(); ++i) {
    const bool passive = i >= robot.chassis.wheels().size();
    const auto& steering = robot.chassis.all_wheels()[i].steering;
    if (steering)
      abilities.can.push_back(fmt::format("where '{}' points: its steering is read, ± {:.2g}°{}",
                                          wheel_name(robot, i), degrees(steering->sigma_rad),
                                          passive ? "; how far it rolls is not" : ""));
    else if (passive)
      abilities.cannot.push_back(fmt::format(
          "how far '{}' rolls: it is passive, and only does not skid sideways", wheel_name(robot, i)));
  }
}

std::string name_of(const Fault& fault, const Robot& robot) {
  return fmt::format("the {} of '{}'", fault.sideways ? "angle" : "travel",
                     robot.wheel_names[static_cast<std::size_t>(fault.wheel)]);
}

/// What residuals do not show in a curve, as wide as twice the robot, they show nowhere; straight ahead it is
/// more.
void add_indistinct_faults(Robot robot, bool with_gyro, Abilities& abilities) {
  if (!with_gyro) robot.chassis.gyro.reset();
  const Parity parity(robot);
  std::vector<std::string> told;
  const auto tell = [&](const Twist2& motion, std::string_view where) {
    const IndistinctFaults faults = parity.indistinct_faults(motion);
    const auto add = [&](const std::string& sentence) {
      if (std::ranges::find(told, sentence) != told.end()) return;
      told.push_back(sentence);
      abilities.cannot.push_back(std::string(where) + sentence);
    };
    for (const Fault& fault : faults.unseen)
      add(fmt::format("an error of {}: no other sensor checks it", name_of(fault, robot)));
    for (const auto& [a, b] : faults.alike)
      add(fmt::format("{} from {}: faults of these two cannot be distinguished", name_of(a, robot),
                      name_of(b, robot)));
  };
  tell({1.0, 0.0, 0.5 / parity.size()[2]}, "");
  tell({1.0, 0.0, 0.0}, "straight ahead, ");
}

void add_slip(const Rows& rows, const Observability& seen, const Robot& robot, bool with_gyro,
              Abilities& abilities) {
  if (seen.degrees_of_freedom == 0) {
    abilities.cannot.push_back(
        fmt::format("whether a wheel slips: no redundant measurement; a gyro or another wheel{} would be one",
                    is_steered(robot.chassis) ? " with an encoder" : ""));
    return;
  }
  abilities.can.push_back(fmt::format("whether something slips: {} reading{} more than the motion needs",
                                      seen.degrees_of_freedom, seen.degrees_of_freedom == 1 ? "" : "s"));
  if (seen.degrees_of_freedom == 1 && robot.chassis.wheel_count > 0)
    abilities.can.emplace_back(
        "which wheel slips, while the motion is steady: by its change against its own recent travel");
  if (has_steered_encoders(robot.chassis)) return add_indistinct_faults(robot, with_gyro, abilities);
  std::vector<std::string> unchecked;
  for (const int row : seen.undetectable)
    unchecked.push_back(name_of(rows.row[static_cast<std::size_t>(row)], robot));
  if (!unchecked.empty())
    abilities.cannot.push_back(
        fmt::format("an error of {}: no other sensor checks it", fmt::join(unchecked, " or ")));
  for (const auto& [i, j] : seen.confusable)
    abilities.cannot.push_back(fmt::format("{} from {}: faults of these two cannot be distinguished",
                                           name_of(rows.row[static_cast<std::size_t>(i)], robot),
                                           name_of(rows.row[static_cast<std::size_t>(j)], robot)));
}

/// Errors of several wheels together that fit a motion leave no residual.
void add_common_slip(const Robot& robot, bool with_gyro, Abilities& abilities) {
  if (robot.chassis.wheel_count < 2) return;
  abilities.cannot.emplace_back(
      with_gyro
          ? "all wheels slipping together as if the robot moved without turning: no sensor on board can see "
            "it"
          : "all wheels slipping together as any motion would turn them: no sensor on board can see it");
}

bool has_wheel(const Recording& recording, const std::string& wheel) {
  const auto& series = recording.wheels.series;
  return std::any_of(series.begin(), series.end(), [&](const WheelSeries& s) { return s.wheel == wheel; });
}

void add_missing_sensors(const Recording& recording, const Robot& robot, std::vector<std::string>& missing) {
  for (const std::string& wheel : robot.wheel_names)
    if (!recording.wheels.time_s.empty() && !has_wheel(recording, wheel))
      missing.push_back(
          fmt::format("the wheel '{0}': no column {0}_ticks, {0}_rad, {0}_m or {0}_rad_s", wheel));
  for (std::size_t i = 0; i < robot.chassis.all_wheels().size(); ++i)
    if (const std::string& wheel = wheel_name(robot, i);
        robot.chassis.all_wheels()[i].steering && !recording.wheels.time_s.empty() &&
        std::ranges::find(recording.wheels.steering, wheel, &WheelSeries::wheel) ==
            recording.wheels.steering.end())
      missing.push_back(fmt::format(
          "the steering of the wheel '{0}': no column {0}_steering_rad or {0}_steering_ticks", wheel));
  if (!robot.wheel_names.empty() && recording.wheels.time_s.size() == 1)
    missing.emplace_back("more rows of wheels: one alone is no motion");
  if (!robot.wheel_names.empty() && recording.wheels.time_s.empty())
    missing.emplace_back("wheels.csv: the robot's wheels are not recorded");
  if (robot.wheel_names.empty() && recording.velocity.time_s.empty())
    missing.emplace_back("velocity.csv: the robot file has no [[wheel]]");
  if (robot.chassis.gyro && recording.gyro.time_s.empty())
    missing.emplace_back("gyro.csv: the robot has a gyro, its readings are not recorded");
  std::ranges::move(unused_in(recording, robot), std::back_inserter(missing));
}

std::string missing_reference(const Recording& recording, const Robot* robot) {
  const bool gyro = !recording.gyro.time_s.empty() && (robot == nullptr || robot->chassis.gyro);
  if (robot != nullptr && robot->landmark_sensor && !recording.sightings.empty())
    return "a reference: nothing was measured from outside the robot; calibrate --landmarks learns from what "
           "it "
           "saw instead, in proportion to the landmark sensor's ranges";
  if (!gyro)
    return "a reference: nothing was measured from outside the robot and there is no gyro, so nothing can be "
           "calibrated; add reference.csv or "
           "[reference] in recording.toml (closed, distance_m, turns, end_x_m, end_y_m, end_heading_deg)";
  const std::string track =
      robot != nullptr && has_skid_wheels(robot->chassis) ? "the effective track" : "the track";
  return fmt::format(
      "a reference: nothing was measured from outside the robot; the gyro against the wheels shows only {} "
      "in proportion to the wheel diameters "
      "and to the gyro's scale; add a straight run of known length ([reference] distance_m) for the "
      "diameters and counted full turns "
      "([reference] turns) for the gyro's scale",
      track);
}

}  // namespace

Abilities abilities_of(const Robot& robot, bool with_gyro) {
  const Rows rows = has_steered_encoders(robot.chassis) ? checking_rows(robot.chassis, with_gyro)
                                                        : rows_of(robot.chassis, with_gyro);
  const Observability seen = observability(rows);
  Abilities abilities;
  add_motion(rows, seen, robot, abilities);
  add_steering(robot, abilities);
  add_slip(rows, seen, robot, with_gyro, abilities);
  add_common_slip(robot, with_gyro, abilities);
  return abilities;
}

std::vector<std::string> unused_in(const Recording& recording, const Robot& robot) {
  std::vector<std::string> unused;
  if (!robot.chassis.gyro && !recording.gyro.time_s.empty())
    unused.emplace_back("[gyro] in the robot file: gyro.csv is there and is not used without it");
  if (!robot.landmark_sensor && !recording.sightings.empty())
    unused.emplace_back(
        "[landmark_sensor] in the robot file: sightings.csv is there and is not used without it");
  return unused;
}

std::vector<std::string> missing_in(const Recording& recording, const Robot* robot) {
  std::vector<std::string> missing;
  if (robot != nullptr) add_missing_sensors(recording, *robot, missing);
  if (robot == nullptr && recording.wheels.time_s.empty() && recording.velocity.time_s.empty())
    missing.emplace_back("wheels.csv or velocity.csv: there is no motion to integrate");
  if (!recording.has_reference()) missing.push_back(missing_reference(recording, robot));
  return missing;
}

}  // namespace trundle::inspection
