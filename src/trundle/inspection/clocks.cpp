#include "trundle/inspection/clocks.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "trundle/chassis/rows.hpp"
#include "trundle/io/words.hpp"

namespace trundle {
namespace {

constexpr double kSmallOffset_s = 0.005;  // does no harm

/// Where `off_s` more sets the clock of the gyro right, and to what. An offset may stand in either file, and
/// they add up.
std::string remedy_of_clock(const Recording& recording, const Robot& robot, double off_s) {
  const double by_robot_s = robot.chassis.gyro->time_offset_s;
  const double by_map_s = recording.gyro.origin.time_offset_s;
  const std::string map = recording_toml_of(recording);
  const std::string robot_file = robot.file.empty() ? "the robot file" : robot.file;
  const bool in_map = by_map_s != 0.0 && !map.empty();
  if (in_map && by_robot_s != 0.0)
    return fmt::format(
        "time_offset_s stands under [gyro] in both {0} ({1}) and {2} ({3}), and they add up: "
        "remove it from {0}, and write time_offset_s = {4} in {2}",
        map, fixed(by_map_s, 4), robot_file, fixed(by_robot_s, 4), fixed(by_map_s + by_robot_s + off_s, 4));
  return fmt::format("write time_offset_s = {} under [gyro] in {}", fixed(by_map_s + by_robot_s + off_s, 4),
                     in_map ? map : robot_file);
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
  const double off = clocks.offset->offset_s - robot.chassis.gyro->time_offset_s;
  if (std::abs(off) <= std::max(3.0 * clocks.offset->sigma_s, kSmallOffset_s)) return clocks;
  clocks.problem = Problem{
      Severity::warning, ProblemKind::time_offset, recording.gyro.origin.file, 1,
      fmt::format(
          "the gyro's stamps are {:.1f} ms too {} against the wheels', which looks like slip at every "
          "start of a turn: {}",
          1e3 * std::abs(off), off < 0.0 ? "late" : "early", remedy_of_clock(recording, robot, off))};
  return clocks;
}

}  // namespace trundle
