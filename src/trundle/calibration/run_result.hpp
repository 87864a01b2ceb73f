#pragma once

#include "trundle/calibration/estimator.hpp"
#include "trundle/calibration/result.hpp"

namespace trundle::calibration {

/// What became of a run: its errors before and after, and the NEES of its trajectory under the calibrated
/// robot, with both parts of the covariance and with the white part alone. `calibrated` carries its
/// CalibrationRecord.
RunResult run_result(const Run& run, const Robot& nominal, const Robot& calibrated,
                     const ReferenceNoise& noise, bool hold_out);

/// Root mean square, over runs, of position errors; the largest; and how they changed. Empty where no run has
/// errors.
std::vector<ErrorBeforeAfter> errors_of(const std::vector<RunResult>& runs, bool hold_out);

/// E_max,syst of square runs, reprocessed: the larger distance of the centres of gravity of cw and ccw end
/// errors. Nothing unless there are closed runs both ways.
struct MaximumError {
  double before_m = 0.0;
  double after_m = 0.0;
};
std::optional<MaximumError> maximum_error_of(const std::vector<RunResult>& runs);

}  // namespace trundle::calibration
