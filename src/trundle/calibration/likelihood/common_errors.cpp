#include "trundle/calibration/likelihood/common_errors.hpp"

#include "trundle/calibration/likelihood/contradiction.hpp"

namespace trundle::calibration {

CommonErrors::CommonErrors(const Chassis& chassis, const Chassis& showing, const Rows& rows,
                           const Combinations& P)
    : showing_(showing), rows_(rows), P_(P), gauge_(chassis), rounding_(rounding_of(chassis, rows) / 2.0) {
  for (std::size_t octave = 0; octave < kOctaves; ++octave)
    gains_.push_back(twist_gain(rows, weighing_variances(chassis, rows, gauge_.octave_speed(octave), 1.0)));
}

CommonError CommonErrors::of(const RowVector& variance, std::size_t octave) const {
  return gains_[octave].leftCols(rows_.measured) * variance.head(rows_.measured).asDiagonal() * P_;
}

CommonError CommonErrors::of(double duration_s, const Rolled& rolled, std::size_t octave) const {
  const Increment sure{.duration_s = duration_s, .turned = rolled, .has_gyro = true};
  return of(readings_of(showing_, rows_, sure).variance - 2.0 * rounding_, octave);
}

CommonError CommonErrors::of_rounding(std::size_t octave) const {
  return of(rounding_, octave);
}

}  // namespace trundle::calibration
