#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "trundle/calibration/problem/run.hpp"
#include "trundle/chassis/parameter.hpp"

namespace trundle::calibration {

/// What is estimated, and from what.
struct CalibrationProblem {
  /// The clock of each run's reference is a parameter of that run: its stamps move to where they fit best.
  std::span<Run> runs;
  Robot nominal;                      ///< where the search starts; the mean of the prior
  std::vector<Parameter> parameters;  ///< that are free
  /// As parts of one run do. Else the gyro's bias is another one in each run, about what is estimated.
  bool share_gyro_bias = false;

  Eigen::Index size() const { return static_cast<Eigen::Index>(parameters.size()); }
};

/// Of a robot, in their own units.
[[nodiscard]] Eigen::VectorXd values_of(const Robot& robot, std::span<const Parameter> parameters);

/// 1σ of each parameter's prior: how far from nominal it may plausibly be.
[[nodiscard]] Eigen::VectorXd prior_sigmas(std::span<const Parameter> parameters, const Robot& nominal);

/// Adds a step to the parameters, in their own units. What does not move is not touched.
void move(std::span<const Parameter> parameters, const Eigen::VectorXd& step, Robot& robot);

}  // namespace trundle::calibration
