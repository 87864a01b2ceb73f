#pragma once

#include <span>
#include <string>
#include <vector>

#include "trundle/calibration/problem/run.hpp"
#include "trundle/chassis/parameter.hpp"

namespace trundle::calibration {

/// What was measured from outside the robot.
struct FromOutside {
  bool length = false;  ///< in metres
  bool anything = false;
};
FromOutside from_outside(std::span<const Run> runs);

/// What is estimated unless told otherwise: of the usual parameters (chassis/usual_parameters.hpp), what was
/// measured at all.
std::vector<Parameter> default_parameters(const Robot& robot, const FromOutside& measured);

/// The default with names added (`free`) and taken away (`fix`). Throws InputError for a name this robot has
/// not.
std::vector<Parameter> choose_parameters(const Robot& robot, const FromOutside& measured,
                                         const std::vector<std::string>& free,
                                         const std::vector<std::string>& fix);

/// Those that are off by default and worth a look: of a robot that has them, neither free nor fixed by name.
[[nodiscard]] std::vector<Parameter> offered_parameters(const Robot& robot, std::span<const Parameter> free,
                                                        const std::vector<std::string>& fix);

}  // namespace trundle::calibration
