#pragma once

#include <optional>
#include <string_view>

#include "trundle/calibration/result.hpp"
#include "trundle/calibration/squares/square_fit.hpp"

namespace trundle::calibration {

/// "classic", "orientation" or "ml".
std::string_view name_of(SquareMethod method);
std::optional<SquareMethod> square_method_named(std::string_view name);

/// The systematic errors of a robot from square runs both ways: docs/theory/umbmark.md.
/// Parameters: the diameter of every wheel (those of one side share a scale), the track, and "mean_diameter"
/// where it could not be measured: held at nominal, the sigmas of the others then hold given that mean.
/// 'After' is "predicted": the robot, as all that was measured shows it, drives the square again under the
/// new parameters. Throws CannotAnswer: one sense missing, headings wrapped, a robot without sides, errors
/// that no robot makes.
CalibrationResult umbmark(const SquareSheet& sheet, const Robot& nominal,
                          SquareMethod method = SquareMethod::orientation);

/// Fills what follows from the rest of such a result: the summary and the calibrated robot's record.
void finish_square_result(CalibrationResult& result);

/// E_max,syst: the larger distance of the two centres of gravity of the end-point errors from the start [m].
double e_max(const SquareMeans& means);

/// The end-pose errors were the robot to drive every run again under `changed` instead of `nominal`:
/// predicted for the drive that explains the sheet best, plus what even that leaves unexplained.
SquareSheet predict_sheet(const SquareSheet& sheet, const SidedDrive& nominal, const SidedDrive& changed);

}  // namespace trundle::calibration
