#include "trundle/slam/models/sensor_clock.hpp"

#include <fmt/format.h>

#include "trundle/io/words.hpp"

namespace trundle::slam {

std::optional<std::string> set_sensor_clock(const std::optional<TimeOffset>& found, Robot& robot) {
  if (!robot.landmark_sensor || !found) return std::nullopt;
  const double given_s = robot.landmark_sensor->time_offset_s;
  if (!is_off(*found, given_s)) return std::nullopt;
  robot.landmark_sensor->time_offset_s = found->offset_s;
  return fmt::format(
      "landmark_sensor.time_offset_s {} s (was {}), from how bearings change as the robot moves",
      with_sigma(found->offset_s, found->sigma_s), fixed(given_s, 4));
}

}  // namespace trundle::slam
