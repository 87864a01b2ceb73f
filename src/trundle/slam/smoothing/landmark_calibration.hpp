#pragma once

#include <span>

#include "trundle/calibration/calibrate.hpp"

namespace trundle::slam {

/// The parameters of any chassis from what the robot saw, without any reference: the smoother (smoother.hpp)
/// with the parameters among its unknowns. Every recording has a map of its own; landmarks without names are
/// distinguished with the robot found so far, until it stays. Lengths are those of the landmark sensor's
/// ranges. A reference is not used, only compared with. docs/theory/landmark-calibration.md. Throws as
/// slam_input, CannotAnswer when nothing is seen or nothing can be estimated, InputError for unknown
/// parameter names.
CalibrationResult calibrate_from_landmarks(std::span<const Recording> training,
                                           std::span<const Recording> hold_out, const Robot& nominal,
                                           const CalibrateOptions& options = {});

}  // namespace trundle::slam
