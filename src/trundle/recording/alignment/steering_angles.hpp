#pragma once

#include <array>
#include <string>
#include <vector>

#include "trundle/chassis/robot.hpp"
#include "trundle/recording/alignment/wheel_sums.hpp"

namespace trundle::recording {

/// Whether a sensor is on the steering's own axis: its readings begin again after a turn.
[[nodiscard]] bool is_direct(const SteeringSensor& steering);

/// What the steerings of a robot's wheels read at any time: straight lines between their readings, each on
/// its own clock. Of a wheel that turns through ±π the short way is taken. A sensor on the steering's own
/// axis (its scale is 1 or nearly) may count from 0 to a turn, or through it: each reading is taken by less
/// than half a turn from the one before, the first from its zero.
class SteeringAngles {
 public:
  explicit SteeringAngles(const Robot& robot);

  /// Ticks or radians, before anything is added. Throws InputError where ticks are of no size.
  void set_units(const WheelUnits& units);

  /// In those units, as Chassis::all_wheels(), at a stamp of the wheels by the robot's clock; NaN: not read.
  void add(double time_s, const std::array<double, kMaxWheels>& readings);

  /// Whether a steering may still be read nearer to that time. `newest_s`: of all the wheels' readings.
  [[nodiscard]] bool is_awaited(double time_s, double newest_s, double longest_step_s) const;

  struct Reading {
    std::array<double, kMaxWheels> rad{};
    bool known = true;  ///< every steering was read within `longest_step_s` of that time
  };
  /// Before the first reading, and after the last, that one.
  [[nodiscard]] Reading at(double time_s, double longest_step_s) const;

  /// Makes every reading the mean of those within so long about it, of as many after it as before.
  void smooth(double over_s);

  /// What no time after that needs.
  void forget_before(double time_s);

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.rad_per_unit_, self.samples_);
  }

 private:
  struct Sample {
    double time_s = 0.0;
    double rad = 0.0;

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.time_s, self.rad);
    }
  };

  std::vector<Wheel> wheels_;
  std::vector<std::string> names_, places_;
  std::array<double, kMaxWheels> rad_per_unit_{};
  std::vector<std::vector<Sample>> samples_;  ///< of each wheel; none of those that are not steered
};

}  // namespace trundle::recording
