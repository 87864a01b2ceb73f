#pragma once

#include <optional>
#include <string>

#include "trundle/recording/time_offset.hpp"

namespace trundle::slam {

/// Sets the landmark sensor's clock to what sighting_time_offset found, where the robot's is off. Returns
/// what was done, in words; nothing: it stays as it is.
[[nodiscard]] std::optional<std::string> set_sensor_clock(const std::optional<TimeOffset>& found,
                                                          Robot& robot);

}  // namespace trundle::slam
