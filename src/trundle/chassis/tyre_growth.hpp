#pragma once

#include <array>

#include "trundle/chassis/robot.hpp"

namespace trundle::chassis {

/// Whether its wheels roll further by their speed.
[[nodiscard]] inline bool grows(const Chassis& chassis) {
  return chassis.wheel_count > 0 && chassis.tyre_growth_s2_m2 != 0.0;
}

/// Whether the speed of wheels makes a difference: they roll further by it, or a calibration says how far
/// they may.
[[nodiscard]] bool depends_on_speed(const Robot& robot);

/// By what share a wheel rolls further at a revolution per second, and so much more with the square of that
/// [s²]. docs/theory/tyre-growth.md, eq. 1.
[[nodiscard]] inline double growth_of(const Chassis& chassis, std::size_t wheel) {
  const double circumference_m = kPi * chassis.wheels()[wheel].diameter_m;
  return chassis.tyre_growth_s2_m2 * circumference_m * circumference_m;
}

/// Turns that move the ground as these would if no tyre grew: of an interval in which all turn evenly. Beyond
/// the speed at which a wheel that shrinks moves the ground fastest, those of that speed.
/// docs/theory/tyre-growth.md, eq. 4.
[[nodiscard]] std::array<double, kMaxWheels> with_growth(const Chassis& chassis,
                                                         const std::array<double, kMaxWheels>& turned,
                                                         double duration_s);
/// And the other way round: what turns amount to on the ground.
[[nodiscard]] std::array<double, kMaxWheels> without_growth(const Chassis& chassis,
                                                            const std::array<double, kMaxWheels>& turned,
                                                            double duration_s);

/// What a SpeedGauge remembers: plain numbers, those of long ago forgotten.
struct SpeedState {
  std::array<double, kMaxWheels> turned{};      ///< revolutions
  std::array<double, kMaxWheels> duration_s{};  ///< in which they were made

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.turned, self.duration_s);
  }
};

/// Fills in Increment::speed_turned. How fast a wheel turns shows in its last counts: in a single interval
/// their rounding would add to the square of the speed. docs/theory/tyre-growth.md, eq. 2. Never allocates.
class SpeedGauge {
 public:
  explicit SpeedGauge(const Chassis& chassis);

  /// Of intervals in their order.
  void add(SpeedState& state, Increment& increment) const;

 private:
  std::size_t wheels_ = 0;
  std::array<double, kMaxWheels> memory_{};  ///< [revolutions]
};

}  // namespace trundle::chassis
