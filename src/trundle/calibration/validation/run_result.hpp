#pragma once

#include "trundle/calibration/result.hpp"
#include "trundle/calibration/solve/estimator.hpp"

namespace trundle::calibration {

/// What the run was to the calibration.
struct RunUse {
  bool hold_out = false;
  /// Of its gyro, where it has one of its own: known from the run itself, and what the run's readings were
  /// moved by.
  std::optional<GyroBias> gyro_bias = {};
};

/// What became of a run: its errors before and after, and the NEES of its trajectory under the calibrated
/// robot, with both parts of the covariance and with the white part alone. `calibrated` carries its
/// CalibrationRecord. The gyro's bias of a run that was held out is what its rests show.
RunResult run_result(const Run& run, const Robot& nominal, const Robot& calibrated,
                     const ReferenceNoise& noise, const RunUse& use);

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
