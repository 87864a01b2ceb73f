#include "trundle/inspection/clocks.hpp"

#include <algorithm>
#include <utility>

#include "trundle/chassis/rows.hpp"
#include "trundle/recording/csv/detail/streams.hpp"

namespace trundle::inspection {
namespace {

/// A clock of a sensor: the tables where its offset stands, and what stands there.
struct GivenOffset {
  std::string_view robot_table, map_table;
  std::string_view key = "time_offset_s";
  double by_robot_s = 0.0;
  double by_map_s = 0.0;
};

/// Where `off_s` more sets the clock right, and what stands there.
payload::ClockOffset clock_offset(const Recording& recording, const Robot& robot, const GivenOffset& given,
                                  double off_s, double sigma_s) {
  const std::string map = recording_toml_of(recording);
  const std::string robot_file = robot.file.empty() ? "the robot file" : robot.file;
  const bool in_map = given.by_map_s != 0.0 && !map.empty();
  const bool in_both = in_map && given.by_robot_s != 0.0;
  return {.table = in_map && !in_both ? given.map_table : given.robot_table,
          .key = given.key,
          .off_s = off_s,
          .sigma_s = sigma_s,
          .by_robot_s = given.by_robot_s,
          .by_map_s = given.by_map_s,
          .file = in_map && !in_both ? map : robot_file,
          .map = in_both ? map : ""};
}

/// The comparison with its problem, `found` with the payload, where the offset is not the given one.
ClockComparison judged(ClockComparison clocks, const GivenOffset& given, const Recording& recording,
                       const Robot& robot, Finding found) {
  if (!clocks.offset || !is_off(*clocks.offset, given.by_robot_s)) return clocks;
  found.payload = clock_offset(recording, robot, given, clocks.offset->offset_s - given.by_robot_s,
                               clocks.offset->sigma_s);
  clocks.problem = std::move(found);
  return clocks;
}

/// A gyro, and turns that something else measures.
bool has_two_clocks(const Recording& recording, const Robot& robot) {
  return robot.chassis.wheel_count > 0 && !recording.wheels.time_s.empty() && robot.chassis.gyro &&
         !recording.gyro.time_s.empty() &&
         (observability(rows_of(robot.chassis, false)).rank == 3 || recording.reference.has_headings());
}

/// That the clocks of two sensors differ, where the motion does not tell which of them is wrong.
std::optional<Finding> are_apart(const std::optional<TimeOffset>& apart, FindingCode code,
                                 const std::string& place, std::string_view other) {
  if (!apart || !is_off(*apart, 0.0)) return std::nullopt;
  return Finding{.code = code,
                 .place = place,
                 .subjects = {std::string(other)},
                 .payload = payload::Offset{apart->offset_s, apart->sigma_s}};
}

std::vector<std::string> steering_columns(const Recording& recording) {
  std::vector<std::string> names;
  for (const WheelSeries& steering : recording.wheels.steering)
    names.push_back(steering_column_name(steering));
  return names;
}

}  // namespace

std::string recording_toml_of(const Recording& recording) {
  const auto is_map = [](const InputFile& input) { return input.path.ends_with("recording.toml"); };
  const auto map = std::ranges::find_if(recording.inputs, is_map);
  return map == recording.inputs.end() ? std::string() : map->path;
}

BoardClocks compare_clocks(const Recording& recording, const Robot& robot,
                           const std::optional<TimeOffset>& by_unsteered) {
  const SteeringClocks steering = steering_clocks(recording, robot);
  const GyroClocks by_reference = gyro_and_reference_clocks(recording, robot);
  const auto is_reference_off = [&](const std::optional<TimeOffset>& reference) {
    return reference && is_off(*reference, robot.reference_time_offset_s);
  };
  BoardClocks clocks;
  if (has_two_clocks(recording, robot)) {
    const std::optional<TimeOffset>& otherwise = steering.gyro ? steering.gyro : by_reference.gyro;
    const std::string& file = recording.gyro.origin.file;
    clocks.gyro =
        judged({.is_possible = true, .offset = by_unsteered ? by_unsteered : otherwise, .problem = {}},
               {.robot_table = "gyro",
                .map_table = "gyro",
                .by_robot_s = robot.chassis.gyro->time_offset_s,
                .by_map_s = recording.gyro.origin.time_offset_s},
               recording, robot, {.code = FindingCode::time_offset, .place = file});
    if (!clocks.gyro.problem && !is_reference_off(by_reference.reference))
      clocks.gyro.problem = are_apart(by_reference.apart, FindingCode::time_offset, file, "reference");
  }
  if (!steering.is_possible) return clocks;
  const std::string& file = recording.wheels.origin.file;
  clocks.steering = judged(
      {.is_possible = true, .offset = steering.steering, .problem = {}},
      {.robot_table = "[wheel]",
       .map_table = {},
       .key = "steering_time_offset_s",
       .by_robot_s = steering_time_offset_s(robot.chassis)},
      recording, robot,
      {.code = FindingCode::steering_time_offset, .place = file, .subjects = steering_columns(recording)});
  if (!clocks.steering.problem && !clocks.gyro.problem && !is_reference_off(steering.reference))
    clocks.steering.problem = are_apart(steering.apart, FindingCode::steering_time_offset, file, steering.by);
  return clocks;
}

ClockComparison compare_reference_clock(const Recording& recording, const AlignedReadings& readings,
                                        const Robot& robot) {
  const ReferenceStream& reference = recording.reference;
  const bool has_motion = !recording.wheels.time_s.empty() || !recording.velocity.time_s.empty();
  return judged({.is_possible = has_motion && !reference.time_s.empty(),
                 .offset = reference_time_offset(reference, readings, robot),
                 .problem = {}},
                {.robot_table = "reference_sensor",
                 .map_table = "reference",
                 .by_robot_s = robot.reference_time_offset_s,
                 .by_map_s = reference.origin.time_offset_s},
                recording, robot,
                {.severity = Severity::note,
                 .code = FindingCode::reference_time_offset,
                 .place = reference.origin.file});
}

ClockComparison compare_sighting_clock(const Recording& recording, const AlignedReadings& readings,
                                       const Robot& robot) {
  if (!robot.landmark_sensor || recording.sightings.empty()) return {};
  return judged(
      {.is_possible = true,
       .offset = sighting_time_offset(recording.sightings, readings, robot),
       .problem = {}},
      {.robot_table = "landmark_sensor",
       .map_table = "sightings",
       .by_robot_s = robot.landmark_sensor->time_offset_s},
      recording, robot,
      {.severity = Severity::note, .code = FindingCode::sighting_time_offset, .place = "sightings"});
}

}  // namespace trundle::inspection
