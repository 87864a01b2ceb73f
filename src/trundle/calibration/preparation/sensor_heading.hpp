#pragma once

#include <optional>
#include <span>
#include <string>

#include "trundle/calibration/solve/estimator.hpp"

namespace trundle::calibration {

/// Where the reference sensor looks [rad, from the body's x axis], by its relative motions: the rotation that
/// lays the directions in which it moves on those in which the wheels roll, while the robot hardly turns.
/// Nothing where it hardly moves or the directions do not agree.
[[nodiscard]] std::optional<double> sensor_heading(std::span<const Run> runs, const Robot& robot);

/// Where the references' trajectories have their sensor, in words; empty: where the robot file says.
struct SensorPlace {
  std::string elsewhere = {};
  std::string advice = {};
  std::string estimated = {};     ///< that it was found, and not asked for
  std::string unobservable = {};  ///< nothing shows where it is
};
/// By the score statistic of its pose at the estimate: nothing is fitted again.
[[nodiscard]] SensorPlace sensor_place(const CalibrationProblem& problem, const Estimate& estimate);

/// The problem with what the references show of their sensor's pose free, behind all other parameters.
[[nodiscard]] CalibrationProblem with_sensor_pose(CalibrationProblem problem);

}  // namespace trundle::calibration
