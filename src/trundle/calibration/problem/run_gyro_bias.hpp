#pragma once

#include <optional>
#include <span>
#include <string>

#include "trundle/calibration/problem/problem.hpp"
#include "trundle/odometry/rest.hpp"

namespace trundle::calibration {

/// Whether the bias of the gyro is a parameter of each run (run_parameters.hpp), about the one that all runs
/// share: more than one tells it.
[[nodiscard]] bool have_own_gyro_bias(const CalibrationProblem& problem);

/// Takes so much more of the gyro's bias out of the readings of a run.
void move_gyro_bias(double step_rad_s, Run& run);
/// The same of readings that were summed.
void move_gyro_bias(double step_rad_s, Increments& increments);
/// Takes so many sigmas more of each harmonic of the run's walk out of its readings.
void move_gyro_walk(const BiasWalk& walk, const Eigen::VectorXd& step, Run& run);
/// The same of readings that were summed.
void move_gyro_walk(const BiasWalk& walk, const Eigen::VectorXd& step, Increments& increments);
/// With the gyro's readings as they were recorded.
[[nodiscard]] Run as_recorded(Run run);

/// Where runs have biases that differ by more than chance: which, in words; nothing: they do not. Each is
/// nothing where its run does not show it.
[[nodiscard]] std::optional<std::string> words_of_biases(std::span<const Run> runs,
                                                         std::span<const std::optional<GyroBias>> biases);

}  // namespace trundle::calibration
