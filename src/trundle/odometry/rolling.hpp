#pragma once

#include <array>
#include <cstdint>

#include "trundle/chassis/chassis.hpp"

namespace trundle::odometry {

/// How far each wheel rolled and how fast the robot drives, as free of the noise of single readings as the
/// weights and variances of odometry need it: plain numbers.
struct Rolling {
  std::array<double, kMaxWheels>
      pending{};             ///< signed, too short yet to be called travel; as Increment::turned
  double speed_m_s = 0.0;    ///< mean of the wheels' over the last second
  std::uint64_t octave = 0;  ///< of that speed, see octave_speed()
};

/// |travel| of each input of an Increment that became sure in an interval, as Increment::turned.
using Rolled = std::array<double, kMaxWheels>;

/// Octaves of speed at which rows are weighed: from 1 cm/s to 20 m/s.
inline constexpr std::size_t kOctaves = 12;

/// Adds up travel. The sum of |reading| grows with the sampling rate where noise or rounding let a counter go
/// back and forth; what a wheel rolled between two places that are farther apart than either does not.
/// docs/theory/odometry.md, eq. 9. Its functions never allocate.
class RollingGauge {
 public:
  explicit RollingGauge(const Chassis& chassis);

  /// The ways that became sure.
  Rolled add(Rolling& state, const Increment& increment) const {
    Rolled rolled{};
    for (std::size_t k = 0; k < inputs_; ++k) {
      const double pending = state.pending[k] + increment.turned[k];
      const double length = pending < 0.0 ? -pending : pending;
      const bool sure = length >= grain_[k];
      state.pending[k] = sure ? 0.0 : pending;
      rolled[k] = sure ? length : 0.0;
    }
    return rolled;
  }
  /// The speed after them: needed where rows are weighed.
  void follow(Rolling& state, const Rolled& rolled, double duration_s) const {
    if (duration_s <= 0.0) return;
    double travel_m = 0.0;
    for (std::size_t k = 0; k < inputs_; ++k) travel_m += metres_[k] * rolled[k];
    state.speed_m_s += (travel_m - state.speed_m_s * duration_s) / (kSpeedTime_s + duration_s);
    const double middle_m_s = octave_speed(state.octave);
    if (state.speed_m_s > 2.0 * middle_m_s || state.speed_m_s < 0.5 * middle_m_s)
      state.octave = octave_of(state.speed_m_s);
  }
  /// The speed at the middle of an octave [m/s].
  double octave_speed(std::size_t octave) const { return slowest_m_s_ * static_cast<double>(1U << octave); }
  /// Whose middle is nearest.
  std::size_t octave_of(double speed_m_s) const;

 private:
  static constexpr double kSpeedTime_s = 1.0;
  std::size_t inputs_ = 0;
  std::array<double, kMaxWheels> grain_{};   ///< shortest length that counts as travel, as Increment::turned
  std::array<double, kMaxWheels> metres_{};  ///< of mean travel, per unit of each input
  double slowest_m_s_ = 0.0;
};

}  // namespace trundle::odometry
