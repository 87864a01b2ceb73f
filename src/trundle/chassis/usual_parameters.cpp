#include "trundle/chassis/usual_parameters.hpp"

#include <algorithm>

namespace trundle::chassis {

// A wheel with rollers has a direction and a lever of its own, the others a track together.
bool is_usual(const Parameter& parameter, const Robot& robot) {
  switch (parameter.kind) {
    case ParameterKind::direction:
    case ParameterKind::lever:
      return has_rollers(robot.chassis.wheels()[static_cast<std::size_t>(parameter.wheel)].kind);
    case ParameterKind::track:
      return !std::ranges::all_of(robot.chassis.wheels(), has_rollers, &Wheel::kind);
    case ParameterKind::diameter:
    case ParameterKind::steering_zero:
    case ParameterKind::steering_scale:
    case ParameterKind::place_x:
    case ParameterKind::velocity_forward_scale:
    case ParameterKind::velocity_yaw_scale:
    case ParameterKind::velocity_yaw_per_forward:
    case ParameterKind::velocity_yaw_bias:
    case ParameterKind::gyro_scale:
    case ParameterKind::gyro_bias:
      return true;
    default:
      return false;
  }
}

std::vector<Parameter> usual_parameters(const Robot& robot) {
  std::vector<Parameter> parameters = parameters_of(robot);
  std::erase_if(parameters, [&](const Parameter& parameter) { return !is_usual(parameter, robot); });
  return parameters;
}

}  // namespace trundle::chassis
