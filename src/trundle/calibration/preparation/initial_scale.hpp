#pragma once

#include <optional>
#include <span>

#include "trundle/calibration/problem/run.hpp"

namespace trundle::calibration {

/// How many times as far the reference moves as the wheels say: the median over all stretches between epochs,
/// each counting as its length; where that is far off, of wheels so scaled once more if stretches then agree
/// better, for chords of curves do not grow in proportion.
struct InitialScale {
  double times = 1.0;
  bool turns_too = true;  ///< the wheels are so much larger; else all lengths are, and turns are right
};
/// Nothing where no reference has positions or no wheel rolls.
std::optional<InitialScale> initial_scale(std::span<const Run> runs, const Robot& robot);

/// Whether most stretches tell about the same, and of driving more than of turning on the spot: there the
/// place of the reference on the robot moves it.
bool stretches_agree(std::span<const Run> runs, const Robot& given);

/// A diameter outside of these is that of no robot's wheel [m].
inline constexpr double kLeastDiameter_m = 0.005;
inline constexpr double kGreatestDiameter_m = 3.0;

/// Wheels and reference tell lengths apart by more than any wheel wears.
struct ScaleFault {
  InitialScale scale;
  bool is_of_unit = false;     ///< wheels so scaled would be no wheels: a unit is wrong, not a size
  payload::LengthRatio ratio;  ///< what a Finding of it says
};
std::optional<ScaleFault> scale_fault(std::span<const Run> runs, const Robot& robot);

/// All wheels' diameters, times the factor.
void scale_wheels(double factor, Robot& robot);

}  // namespace trundle::calibration
