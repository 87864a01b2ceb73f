#include "trundle/inspection/clocks.hpp"

#include <algorithm>

#include "trundle/chassis/rows.hpp"

namespace trundle::inspection {
namespace {

/// Where `off_s` more sets the clock of a stream right, and what stands there.
payload::ClockOffset clock_offset(const Recording& recording, const Robot& robot, std::string_view table,
                                  const StreamOrigin& origin, double by_robot_s, double off_s) {
  const double by_map_s = origin.time_offset_s;
  const std::string map = recording_toml_of(recording);
  const std::string robot_file = robot.file.empty() ? "the robot file" : robot.file;
  const bool in_map = by_map_s != 0.0 && !map.empty();
  const bool in_both = in_map && by_robot_s != 0.0;
  return {.table = table,
          .off_s = off_s,
          .by_robot_s = by_robot_s,
          .by_map_s = by_map_s,
          .file = in_map && !in_both ? map : robot_file,
          .map = in_both ? map : ""};
}

bool has_two_clocks(const Recording& recording, const Robot& robot) {
  return robot.chassis.wheel_count > 0 && !recording.wheels.time_s.empty() && robot.chassis.gyro &&
         !recording.gyro.time_s.empty() && observability(rows_of(robot.chassis, false)).rank == 3;
}

}  // namespace

std::string recording_toml_of(const Recording& recording) {
  const auto is_map = [](const InputFile& input) { return input.path.ends_with("recording.toml"); };
  const auto map = std::ranges::find_if(recording.inputs, is_map);
  return map == recording.inputs.end() ? std::string() : map->path;
}

ClockComparison compare_clocks(const Recording& recording, const AlignedReadings& readings,
                               const Robot& robot) {
  ClockComparison clocks{.is_possible = has_two_clocks(recording, robot), .offset = {}, .problem = {}};
  if (clocks.is_possible) clocks.offset = gyro_time_offset(recording, readings, robot);
  if (!clocks.offset) return clocks;
  const double given_s = robot.chassis.gyro->time_offset_s;
  if (is_off(*clocks.offset, given_s))
    clocks.problem = Finding{.code = FindingCode::time_offset,
                             .place = recording.gyro.origin.file,
                             .payload = clock_offset(recording, robot, "gyro", recording.gyro.origin, given_s,
                                                     clocks.offset->offset_s - given_s)};
  return clocks;
}

ClockComparison compare_reference_clock(const Recording& recording, const AlignedReadings& readings,
                                        const Robot& robot) {
  ClockComparison clocks{
      .is_possible = !recording.reference.time_s.empty() &&
                     (!recording.wheels.time_s.empty() || !recording.velocity.time_s.empty()),
      .offset = reference_time_offset(recording.reference, readings, robot),
      .problem = {}};
  if (!clocks.offset) return clocks;
  const double given_s = robot.reference_time_offset_s;
  if (is_off(*clocks.offset, given_s))
    clocks.problem =
        Finding{.severity = Severity::note,
                .code = FindingCode::reference_time_offset,
                .place = recording.reference.origin.file,
                .payload = clock_offset(recording, robot, "reference", recording.reference.origin, given_s,
                                        clocks.offset->offset_s - given_s)};
  return clocks;
}

ClockComparison compare_sighting_clock(const Recording& recording, const AlignedReadings& readings,
                                       const Robot& robot) {
  ClockComparison clocks{.is_possible = robot.landmark_sensor && !recording.sightings.empty(),
                         .offset = sighting_time_offset(recording.sightings, readings, robot),
                         .problem = {}};
  if (!clocks.offset) return clocks;
  const double given_s = robot.landmark_sensor->time_offset_s;
  if (is_off(*clocks.offset, given_s))
    clocks.problem = Finding{.severity = Severity::note,
                             .code = FindingCode::sighting_time_offset,
                             .place = "sightings",
                             .payload = clock_offset(recording, robot, "landmark_sensor", {}, given_s,
                                                     clocks.offset->offset_s - given_s)};
  return clocks;
}

}  // namespace trundle::inspection
