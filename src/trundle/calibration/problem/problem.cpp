#include "trundle/calibration/problem/problem.hpp"

#include <algorithm>

namespace trundle::calibration {

Eigen::VectorXd values_of(const Robot& robot, std::span<const Parameter> parameters) {
  Eigen::VectorXd values(static_cast<Eigen::Index>(parameters.size()));
  for (std::size_t j = 0; j < parameters.size(); ++j)
    values[static_cast<Eigen::Index>(j)] = value_of(parameters[j], robot);
  return values;
}

Eigen::VectorXd prior_sigmas(std::span<const Parameter> parameters, const Robot& nominal) {
  Eigen::VectorXd sigmas(static_cast<Eigen::Index>(parameters.size()));
  for (std::size_t j = 0; j < parameters.size(); ++j)
    sigmas[static_cast<Eigen::Index>(j)] = prior_sigma(parameters[j], nominal);
  return sigmas;
}

void move(std::span<const Parameter> parameters, const Eigen::VectorXd& step, Robot& robot) {
  for (std::size_t j = 0; j < parameters.size(); ++j) {
    const double value = value_of(parameters[j], robot);
    const double moved = value + step[static_cast<Eigen::Index>(j)];
    if (moved != value) set_value(parameters[j], moved, robot);
  }
}

}  // namespace trundle::calibration
