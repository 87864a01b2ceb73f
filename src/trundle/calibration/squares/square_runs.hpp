#pragma once

#include <span>

#include "trundle/calibration/squares/umbmark.hpp"
#include "trundle/recording/recording.hpp"

namespace trundle::calibration {

/// The sheet that a person would have written for these recordings, each of one run around a square of
/// `side_m`: reference minus odometry of `robot`, both from the pose at the first common stamp to the last
/// one, headings continuous, the sense found from the reference. `leg_m`: by how much the legs are longer or
/// shorter than odometry believes, where there is a reference trajectory. Without one the end pose of
/// recording.toml is taken. Throws CannotAnswer when a recording holds no end pose or is no run around a
/// square.
SquareSheet end_errors_of_square_runs(std::span<const Recording> recordings, const Robot& robot,
                                      double side_m);

/// umbmark on that sheet; 'after' is "reprocessed": the same counts with the calibrated robot.
CalibrationResult umbmark(std::span<const Recording> recordings, const Robot& nominal, double side_m,
                          SquareMethod method = SquareMethod::orientation);

}  // namespace trundle::calibration
