#pragma once

#include <array>

#include "trundle/chassis/robot.hpp"

namespace trundle::calibration {

/// Standard deviations of a reference stream's errors, and by how much they count for more at the reference
/// epochs because errors of neighbouring epochs are alike.
struct ReferenceNoise {
  double position_m = 0.005;
  double heading_rad = 0.02;
  double position_persistence = 1.0;
  double heading_persistence = 1.0;

  Vector3 sigma() const { return {position_m, position_m, heading_rad}; }
  Vector3 sigma_at_epochs() const {
    return sigma().cwiseProduct(Vector3(position_persistence, position_persistence, heading_persistence));
  }
};

/// The variance components of odometry held against a reference, as standard deviations.
struct NoiseLevels {
  double wheel_per_sqrt_m = 0.0;     ///< typical of the wheels [m/√m]
  double sideways_per_sqrt_m = 0.0;  ///< of 'does not skid sideways': lateral, or skid [m/√m]
  double gyro_rad_s_sqrt_hz = 0.0;
  ReferenceNoise reference = {};
  /// Of each wheel's noise, over the typical; their mean square is 1.
  std::array<double, kMaxWheels> wheel_ratio = all_alike();

  static constexpr std::array<double, kMaxWheels> all_alike() {
    std::array<double, kMaxWheels> ratio{};
    ratio.fill(1.0);
    return ratio;
  }
  bool alike() const { return wheel_ratio == all_alike(); }
};

/// How noisy the runs themselves show odometry and reference to be.
struct NoiseEstimate {
  NoiseLevels levels;
  bool from_runs = false;  ///< false: too little reference, the robot file's numbers stand
};

/// Whether the chassis assumes anything of sideways motion.
[[nodiscard]] bool has_sideways(const Robot& robot);

/// Whether headings err as the wheels do, in proportion to their level. Of a sideways wheel beside others
/// that do not skid they err by what those skid, too.
[[nodiscard]] bool owes_headings_to_wheels(const Robot& robot);

/// As the robot file has them; of the reference, the usual.
[[nodiscard]] NoiseLevels noise_levels_of(const Robot& robot);
[[nodiscard]] Robot with_noise(const Robot& robot, const NoiseLevels& levels);

/// The robot as if its counts were not rounded. Rounding errors of successive increments cancel: of a sum
/// only those of its two ends are left, and counted in every interval they would pass for much noise.
[[nodiscard]] Robot without_rounding(Robot robot);

/// The robot with the noise that its wheels' readings have at nominal diameters [m/√m]: a diameter makes a
/// reading and its error larger alike, so that no wheel is made small to make its errors small.
[[nodiscard]] Robot with_noise_of_readings(const Robot& robot, const Chassis& nominal);

}  // namespace trundle::calibration
