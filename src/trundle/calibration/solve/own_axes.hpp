#pragma once

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "trundle/chassis/parameter.hpp"

namespace trundle::calibration {

/// How the parameters change, in their own units, where the robot's own axes are turned by one radian: with
/// the directions of all wheels free what is ahead is anybody's choice, unless a sensor on board is known to
/// look there. Nothing where a wheel's direction is not among them.
std::optional<Eigen::VectorXd> axes_turned(std::span<const Parameter> parameters, const Robot& robot);

/// Likewise where its origin is moved by one metre along its x axis, and along y: with the levers of all omni
/// wheels and the landmark sensor's place free, where the middle is is anybody's choice. None of any other
/// robot.
std::vector<Eigen::VectorXd> origin_moved(std::span<const Parameter> parameters, const Robot& robot);

/// What information says of parameters where directions (columns) are held: nothing along them, and of all
/// others what it says given these. `scale`: about what each parameter is known to.
Eigen::MatrixXd with_held(const Eigen::MatrixXd& directions, const Eigen::VectorXd& scale,
                          const Eigen::MatrixXd& information);

}  // namespace trundle::calibration
