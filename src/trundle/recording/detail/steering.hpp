#pragma once

#include <string_view>

namespace trundle::recording {

/// Of what stands for the steering of a wheel: "front_steering_rad", "front_steering_ticks".
inline constexpr std::string_view kSteeringEnding = "_steering";

}  // namespace trundle::recording
