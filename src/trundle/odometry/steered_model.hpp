#pragma once

#include <array>
#include <span>
#include <vector>

#include "trundle/odometry/rolling.hpp"
#include "trundle/odometry/steered_sums.hpp"

namespace trundle::odometry {

/// A chassis whose steered wheels stand otherwise in each interval, prepared for stepping: H and with it the
/// gain are another one each time. Its functions never allocate. docs/theory/odometry.md, eq. 11 and 12.
class SteeredModel {
 public:
  /// At most kMaxModelParameters.
  SteeredModel(const Chassis& chassis, std::span<const Parameter> parameters, bool with_gyro);

  /// No gyro is weighed against wheels: one set of weights serves all speeds.
  bool has_one_weighing() const { return sums_.size() == 1; }
  const SteeredSums& sums(std::size_t octave) const { return sums_[has_one_weighing() ? 0 : octave]; }

  /// As MotionModel's.
  std::array<double, 3> twist(const Increment& increment, std::size_t octave) const;
  void twist_with_covariance(const Increment& increment, const Rolled& rolled, std::size_t octave,
                             TwistStep& step) const;
  std::array<double, 3> response_to_turn(const Increment& increment, std::size_t octave) const;

 private:
  /// 3×n.
  using Gain = TwistGain;
  /// The chassis as it stood, and all that follows from its rows.
  struct Standing {
    Chassis chassis;
    Rows rows;
    RowVector weight;
    Matrix3 inverse_normal;
    Gain gain;
  };

  SteeredSums sums_of(std::size_t octave) const;
  bool slips(const Increment& increment) const;
  Standing standing_in(const Increment& increment, std::size_t octave) const;
  RowVector variance_of(const Standing& standing, const Increment& increment, const Rolled& rolled,
                        const Vector3& twist) const;

  Chassis chassis_;
  std::vector<Parameter> parameters_;
  bool with_gyro_;
  RollingGauge gauge_;
  std::vector<SteeredSums> sums_;  ///< by octave; or one
};

}  // namespace trundle::odometry
