#include "trundle/calibration/problem/noise_levels.hpp"

#include <algorithm>
#include <cmath>

#include "trundle/chassis/rows.hpp"

namespace trundle::calibration {

bool has_sideways(const Robot& robot) {
  const Rows rows = rows_of(robot.chassis, false);
  return rows.count() > rows.measured;
}

bool owes_headings_to_wheels(const Robot& robot) {
  if (is_steered(robot.chassis)) return true;   // and to their angles
  const auto variance_at = [&](double times) {  // after a metre
    NoiseLevels levels = noise_levels_of(robot);
    levels.wheel_per_sqrt_m *= times;
    const Chassis& noisy = with_noise(robot, levels).chassis;
    const Rows rows = rows_of(noisy, false);
    const Readings readings{RowVector::Zero(rows.count()), weighing_variances(noisy, rows, 1.0, 1.0)};
    return estimate_twist(rows, readings).covariance(2, 2);
  };
  return std::abs(variance_at(2.0) / variance_at(1.0) - 4.0) < 1e-6;
}

NoiseLevels noise_levels_of(const Robot& robot) {
  const Chassis& chassis = robot.chassis;
  NoiseLevels levels{.wheel_per_sqrt_m = typical_wheel_noise(chassis),
                     .sideways_per_sqrt_m = has_skid_wheels(chassis) ? chassis.noise.skid_per_sqrt_m
                                                                     : chassis.noise.lateral_per_sqrt_m,
                     .gyro_rad_s_sqrt_hz = chassis.gyro ? chassis.gyro->noise_rad_s_sqrt_hz : 0.0};
  const auto has_its_own = [](const Wheel& wheel) { return !std::isnan(wheel.noise_per_sqrt_m); };
  if (levels.wheel_per_sqrt_m == 0.0 || std::ranges::none_of(chassis.wheels(), has_its_own)) return levels;
  for (std::size_t i = 0; i < chassis.wheels().size(); ++i)
    levels.wheel_ratio[i] = wheel_noise(chassis, i) / levels.wheel_per_sqrt_m;
  return levels;
}

Robot with_noise(const Robot& robot, const NoiseLevels& levels) {
  Robot result = robot;
  ChassisNoise& noise = result.chassis.noise;
  if (result.chassis.wheel_count == 0 && noise.wheel_per_sqrt_m > 0.0) {  // they keep their proportions
    const double times = levels.wheel_per_sqrt_m / noise.wheel_per_sqrt_m;
    noise.turn_per_sqrt_m *= times;
    noise.turn_per_sqrt_rad *= times;
  }
  noise.wheel_per_sqrt_m = levels.wheel_per_sqrt_m;
  const auto wheels = result.chassis.wheels();
  for (std::size_t i = 0; i < wheels.size(); ++i)
    wheels[i].noise_per_sqrt_m =
        levels.alike() ? Wheel{}.noise_per_sqrt_m : levels.wheel_ratio[i] * levels.wheel_per_sqrt_m;
  if (has_sideways(robot))
    (has_skid_wheels(robot.chassis) ? noise.skid_per_sqrt_m : noise.lateral_per_sqrt_m) =
        levels.sideways_per_sqrt_m;
  if (result.chassis.gyro) result.chassis.gyro->noise_rad_s_sqrt_hz = levels.gyro_rad_s_sqrt_hz;
  return result;
}

Robot without_rounding(Robot robot) {
  for (Wheel& wheel : robot.chassis.wheels())
    wheel.ticks_per_revolution = 0.0;  // then no count stands for a length
  return robot;
}

// The variance of a reading grows with the travel, and so once with the diameter; here it must grow twice.
Robot with_noise_of_readings(const Robot& robot, const Chassis& nominal) {
  Robot result = robot;
  const auto wheels = result.chassis.wheels();
  for (std::size_t i = 0; i < wheels.size(); ++i)
    wheels[i].noise_per_sqrt_m = wheel_noise(robot.chassis, i) *
                                 std::sqrt(std::abs(wheels[i].diameter_m / nominal.wheels()[i].diameter_m));
  if (!wheels.empty()) return result;
  const VelocityCorrection& now = robot.chassis.velocity;
  const double forward = std::sqrt(std::abs(now.forward_scale / nominal.velocity.forward_scale));
  const double yaw = std::sqrt(std::abs(now.yaw_scale / nominal.velocity.yaw_scale));
  ChassisNoise& noise = result.chassis.noise;
  noise.wheel_per_sqrt_m *= forward;
  noise.turn_per_sqrt_rad *= yaw;
  noise.turn_per_sqrt_m *= yaw * yaw / forward;
  return result;
}

}  // namespace trundle::calibration
