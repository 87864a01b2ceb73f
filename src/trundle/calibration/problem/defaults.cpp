#include "trundle/calibration/problem/defaults.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "trundle/chassis/usual_parameters.hpp"
#include "trundle/io/error.hpp"

namespace trundle::calibration {
namespace {

/// Of what is usual, what was measured at all.
bool is_default(const Parameter& parameter, const Robot& robot, const FromOutside& measured) {
  if (!is_usual(parameter, robot)) return false;
  switch (parameter.kind) {
    case ParameterKind::diameter:
    case ParameterKind::velocity_forward_scale:
      return measured.length;
    case ParameterKind::track:  // the gyro checks these
    case ParameterKind::velocity_yaw_scale:
    case ParameterKind::velocity_yaw_per_forward:
      return measured.anything || robot.chassis.gyro.has_value();
    case ParameterKind::gyro_bias:
      return true;
    default:
      return measured.anything;
  }
}

/// All that sightings tell of a landmark sensor. Of the scale of its ranges they tell nothing where no length
/// is known otherwise: that is named by itself.
bool is_observable_from_sightings(const Parameter& parameter) {
  return is_of_landmark_sensor(parameter.kind) && parameter.kind != ParameterKind::sensor_range_scale;
}

/// Those of the group "velocity" or "sensor"; of another name none.
std::vector<Parameter> group_named(const std::string& name, const Robot& robot) {
  std::vector<Parameter> group = parameters_of(robot);
  std::erase_if(group, [&](const Parameter& parameter) {
    return !(name == "sensor" && is_observable_from_sightings(parameter)) &&
           !(name == "velocity" && is_of_velocity(parameter.kind));
  });
  return group;
}

/// One parameter, or those of a group.
std::vector<Parameter> named(const std::string& name, const char* option, const Robot& robot) {
  if (const auto parameter = parameter_named(name, robot)) return {*parameter};
  if (std::vector<Parameter> group = group_named(name, robot); !group.empty()) return group;
  std::vector<std::string> known;
  for (const Parameter& parameter : parameters_of(robot)) known.push_back(name_of(parameter, robot));
  const std::string nearest = nearest_name(name, known);
  throw InputError(option, fmt::format("'{}' is no parameter of this robot", name),
                   nearest.empty() ? fmt::format("one of {}", fmt::join(known, ", "))
                                   : fmt::format("perhaps '{}'", nearest));
}

}  // namespace

FromOutside from_outside(std::span<const Run> runs) {
  return {.length = std::ranges::any_of(runs, &Run::measures_length),
          .anything = std::ranges::any_of(runs, &Run::measures_anything)};
}

std::vector<Parameter> default_parameters(const Robot& robot, const FromOutside& measured) {
  std::vector<Parameter> parameters;
  for (const Parameter& parameter : parameters_of(robot))
    if (is_default(parameter, robot, measured)) parameters.push_back(parameter);
  return parameters;
}

std::vector<Parameter> offered_parameters(const Robot& robot, std::span<const Parameter> free,
                                          const std::vector<std::string>& fix) {
  std::vector<Parameter> offered = parameters_of(robot);
  std::erase_if(offered, [&](const Parameter& parameter) {
    const bool is_rare = parameter.kind == ParameterKind::scrub || parameter.kind == ParameterKind::icr_x ||
                         parameter.kind == ParameterKind::tyre_growth;
    return !is_rare || std::ranges::find(free, parameter) != free.end() ||
           std::ranges::find(fix, name_of(parameter, robot)) != fix.end();
  });
  return offered;
}

std::vector<Parameter> choose_parameters(const Robot& robot, const FromOutside& measured,
                                         const std::vector<std::string>& free,
                                         const std::vector<std::string>& fix) {
  std::vector<Parameter> parameters = default_parameters(robot, measured);
  for (const std::string& name : free)
    for (const Parameter& parameter : named(name, "--free", robot))
      if (std::ranges::find(parameters, parameter) == parameters.end()) parameters.push_back(parameter);
  for (const std::string& name : fix)
    for (const Parameter& parameter : named(name, "--fix", robot)) std::erase(parameters, parameter);
  return parameters;
}

}  // namespace trundle::calibration
