#pragma once

#include <optional>
#include <span>
#include <string>

#include "trundle/calibration/run.hpp"

namespace trundle {

/// How many times as far the reference moves as the wheels say: the median over all stretches between knots,
/// each counting as its length; where that is far off, of wheels so scaled once more, for chords of curves
/// do not grow in proportion. Nothing where no reference has positions or no wheel rolls.
std::optional<double> rough_scale(std::span<const Run> runs, const Robot& robot);

/// Whether most stretches tell about the same, and of driving more than of turning on the spot: there the
/// place of the reference on the robot moves it.
bool stretches_agree(std::span<const Run> runs, const Robot& given);

/// What is wrong where they differ by more than any wheel wears, in words; empty: nothing.
std::string scale_fault(std::span<const Run> runs, const Robot& robot);

/// All wheels' diameters, times the factor.
void scale_wheels(double factor, Robot& robot);

}  // namespace trundle
