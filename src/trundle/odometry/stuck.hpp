#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "trundle/odometry/motion_model.hpp"
#include "trundle/odometry/rest.hpp"

namespace trundle::odometry {

/// What the other sensors say of a wheel whose counter stands still.
struct StillWheel {
  double still_s = 0.0;   ///< since it stands still
  double travel_m = 0.0;  ///< that it should have rolled since, the first lag_s aside
  double variance = 0.0;  ///< of that, from noise and from the rounding of the others' counts [m²]
  double by_bias = 0.0;   ///< its derivative by the gyro's bias [m s/rad]
};

/// All that StuckWheels remembers: plain numbers.
struct StuckState {
  std::array<StillWheel, kMaxWheels> still{};
  std::uint64_t stuck = 0;  ///< one bit for each wheel
};

/// Finds dead encoders: wheels that read nothing while the other sensors say that they roll. A flag stays
/// until the wheel reads something again or the robot rests. Needs a gyro or more wheels than the motion
/// needs; where every wheel of a robot is dead, its turning alone shows it. Its functions never allocate.
/// docs/theory/gyro.md, eq. 4.
class StuckWheels {
 public:
  StuckWheels(const Chassis& chassis, const RestOptions& options);

  /// `octave`: of the robot's speed, see RollingGauge.
  void watch(StuckState& state, const Increment& increment, const GyroBias& bias, std::size_t octave) const;

 private:
  /// The chassis without one of its wheels, where that still sees the motion.
  struct Others {
    Chassis chassis;
    std::optional<MotionModel> with_gyro;
    std::optional<MotionModel> without_gyro;
  };
  void expect(StillWheel& still, std::size_t wheel, const Increment& increment, bool all_still,
              std::size_t octave) const;

  double sigmas_;
  double lag_s_;
  std::vector<Wheel> wheels_;
  std::vector<double> unseen_m_;  ///< a wheel may roll so far without a count
  std::vector<Others> others_;
  Gyro gyro_;
  bool has_gyro_ = false;
};

}  // namespace trundle::odometry
