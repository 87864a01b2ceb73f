#pragma once

#include <span>
#include <string>

#include "trundle/calibration/result.hpp"
#include "trundle/calibration/solve/estimator.hpp"
#include "trundle/calibration/validation/sessions.hpp"

namespace trundle::calibration {

/// Throws CannotAnswer, in words, when there is none to estimate.
void require_something_free(std::span<const Parameter> parameters, std::span<const Recording> training,
                            const Robot& nominal);
/// The same when the runs can determine no parameter.
void require_something_estimated(const Estimate& estimate, std::span<const Parameter> parameters,
                                 const Robot& nominal);

/// What an estimate says of the parameters: values with error bars, what cannot be determined, the calibrated
/// robot and its record. Runs, errors and summary are still missing: conclude().
CalibrationResult result_of(const Estimate& estimate, const SessionSpread& spread,
                            std::span<const Parameter> parameters, const Robot& nominal);

/// Into the result's record, behind what was estimated.
void record(const GivenParameters& given, CalibrationResult& result);

/// Notes something, in the result and in its robot file.
void note(const std::string& words, CalibrationResult& result);

struct ConcludedRuns {
  std::span<const Run> training;
  std::span<const Run> hold_out;
};

/// Adds what became of every run under the calibrated robot, which must be final: errors before and after
/// where there is a reference, remarks, what is known of the spread between sessions, the summary.
void conclude(const ConcludedRuns& runs, const Estimate& estimate, const SessionSpread& spread,
              CalibrationResult& result);

}  // namespace trundle::calibration
