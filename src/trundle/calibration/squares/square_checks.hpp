#pragma once

#include <string>
#include <vector>

#include "trundle/calibration/squares/square_fit.hpp"

namespace trundle::calibration {

/// Half a turn between the headings of runs of one sense: some have been wrapped, and nobody can say which.
/// Then throws CannotAnswer.
void refuse_wrapped(const SquareSheet& sheet);

/// Runs that scatter so much that they tell less of the track, or of unequal wheels, than is known
/// beforehand. Then throws CannotAnswer.
void refuse_scatter(const SquareSheet& sheet, const SquareFit& fit, const SidedDrive& nominal);

/// What a person should know of a sheet before trusting what `method` makes of it, one sentence each.
std::vector<std::string> warnings_of(const SquareSheet& sheet, const SquareStatistics& statistics,
                                     SquareMethod method);

}  // namespace trundle::calibration
