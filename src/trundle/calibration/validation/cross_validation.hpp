#pragma once

#include <optional>
#include <vector>

#include "trundle/calibration/result.hpp"
#include "trundle/calibration/solve/estimator.hpp"

namespace trundle::calibration {

/// The two halves of a run; none where the reference shows too little of it.
[[nodiscard]] std::vector<Run> halves_of(const Run& run);

/// Nothing where the reference shows fewer than two parts' positions, or none of the parameters is
/// observable in them.
[[nodiscard]] std::optional<CrossValidation> cross_validate(const CalibrationProblem& problem,
                                                            const Estimate& estimate);

/// An estimate of those parameters that hold beyond the runs that they were learned from.
struct ValidatedEstimate {
  Estimate estimate;
  std::vector<Parameter> parameters;  ///< that are estimated
  GivenParameters refused;            ///< that are not, for with them runs that were left out came out worse
  std::optional<CrossValidation> validation;  ///< of those that are
  std::optional<CrossValidation> before;      ///< of all of them, where some were refused
};

/// Refuses one parameter after the other, first the one without which the parts come out best, until they are
/// no worse than with the robot as given. Where that they are worse may be chance, only those are refused
/// that may by chance be other than given, and none if that does not mend it. Where all are refused there are
/// none left. docs/theory/calibration-uncertainty.md.
[[nodiscard]] ValidatedEstimate estimate_what_holds(const CalibrationProblem& problem);

}  // namespace trundle::calibration
