#pragma once

#include <vector>

#include "trundle/chassis/parameter.hpp"

namespace trundle::chassis {

/// What is wrong by a constant on any robot of this kind, and what `calibrate` estimates where everything was
/// measured: the diameters, the track, directions and levers of omni and mecanum wheels, zero, scale and
/// place of what is steered, of a robot without wheels the correction of its velocity, scale and bias of the
/// gyro.
[[nodiscard]] bool is_usual(const Parameter& parameter, const Robot& robot);

/// All of them.
[[nodiscard]] std::vector<Parameter> usual_parameters(const Robot& robot);

}  // namespace trundle::chassis
