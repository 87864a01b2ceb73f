#pragma once

#include <span>

#include "trundle/calibration/calibrate.hpp"

namespace trundle::slam {

/// The parameters of any chassis from what the robot saw, without any reference: the smoother (smoother.hpp)
/// with the parameters among its unknowns. Every recording has a map of its own; landmarks without names are
/// distinguished with the robot found so far, until it stays. Lengths are those of the landmark sensor's
/// ranges, and a reference is only compared with; CalibrateOptions::with_reference: those of the positions of
/// references, by which the sensor's range scale is found. docs/theory/landmark-calibration.md. Throws as
/// slam_input, CannotAnswer when nothing is seen, nothing can be estimated or no reference has the positions
/// that are asked for, InputError for unknown parameter names.
CalibrationResult calibrate_from_landmarks(std::span<const Recording> training,
                                           std::span<const Recording> hold_out, const Robot& nominal,
                                           const CalibrateOptions& options = {});

}  // namespace trundle::slam
