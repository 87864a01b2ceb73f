#pragma once

#include <optional>
#include <span>

#include "trundle/calibration/likelihood/common_errors.hpp"
#include "trundle/calibration/likelihood/contradiction.hpp"

namespace trundle::calibration {

/// Sums up over intervals what no motion explains of steered wheels, which is another combination of readings
/// at every angle: of each interval the one that is nearest to that with which the window began. That a wheel
/// does not skid is a reading as well: of its angle. docs/theory/calibration-redundancy.md, eq. 7a.
class SteeredWindow {
 public:
  /// As ParityWindows.
  SteeredWindow(const Chassis& chassis, const Chassis& weighing, std::span<const Parameter> parameters,
                bool with_errors)
      : chassis_(chassis), weighing_(weighing), parameters_(parameters), with_errors_(with_errors) {}

  /// Whether its rows can be compared; if not, it is not taken.
  bool take(const Increment& increment);
  /// What was summed up; it begins anew.
  std::optional<Contradiction> close();
  double duration_s() const { return duration_s_; }
  /// Of the interval that was taken last.
  const Combinations& combinations() const { return last_->P; }
  /// Of the same, G V P: what its readings make the motion of a gain that weighs rows
  /// as at that speed, and the sum, err by together. Body axes.
  CommonError common_error(double speed_m_s) const;

 private:
  const Chassis& chassis_;
  const Chassis& weighing_;
  std::span<const Parameter> parameters_;
  bool with_errors_;  ///< Contradiction::J_errors
  Combinations P_;    ///< of its first interval
  std::optional<Contradiction> sum_;
  /// The interval that was taken last.
  struct Taken {
    Increment increment;
    Rows rows;
    RowVector variance;
    Combinations P;
  };
  std::optional<Taken> last_;
  double duration_s_ = 0.0;
};

}  // namespace trundle::calibration
