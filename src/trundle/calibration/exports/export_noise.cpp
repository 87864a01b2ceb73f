#include "trundle/calibration/exports/export_noise.hpp"

#include <array>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "trundle/calibration/exports/export_words.hpp"
#include "trundle/chassis/rows.hpp"

namespace trundle::calibration {
namespace {

// robot_localization's covariances are constants, a wheel's is in proportion to its way: they are equal at
// one speed and rate.
constexpr double kSpeed_m_s = 0.5;
constexpr double kOdometryRate_hz = 50.0;  ///< of ros2_control's wheel odometry
constexpr double kGyroRate_hz = 100.0;     ///< of most drivers of an IMU
constexpr double kFilterRate_hz = 30.0;    ///< robot_localization's own default

// What wheels and gyro measure follows the robot at these accelerations; nothing here measures them.
constexpr double kAcceleration_m_s2 = 1.0;
constexpr double kTurnAcceleration_rad_s2 = 2.0;  ///< of a wheel half a metre from the axis

constexpr int kDigits = 4;  ///< of a covariance

constexpr std::size_t kStates = 15;  ///< position, angles, their rates, acceleration: three each
enum State : std::size_t { kForward = 6, kLeft = 7, kYawRate = 11 };  ///< those that wheels and gyro measure

/// Covariance of the twist over a metre ahead, by the wheels alone [m²/m, m·rad/m, rad²/m].
Matrix3 covariance_per_metre(const Robot& robot) {
  const Rows rows = rows_of(robot.chassis, false);
  if (robot.chassis.wheel_count == 0 || observability(rows).rank < 3)
    refuse_export("robot_localization", robot, "its wheels alone do not see all of the motion");
  constexpr double kMetre = 1.0, kSecond = 1.0;  // units
  return estimate_twist(
             rows, {RowVector::Zero(rows.count()), weighing_variances(robot.chassis, rows, kMetre, kSecond)})
      .covariance;
}

/// fmt's list of so many states, of which these are true.
std::string config_of(std::initializer_list<State> used) {
  std::array<std::string_view, kStates> flags;
  flags.fill("false");
  for (const State state : used) flags[state] = "true";
  return fmt::format("[{}]", fmt::join(flags, ", "));
}

/// The matrix row by row, of which only these are above next to nothing.
std::string process_noise(std::initializer_list<std::pair<State, double>> diagonal) {
  constexpr double kNone = 1e-9;  // the filter wants a positive one
  std::array<double, kStates * kStates> matrix{};
  for (std::size_t i = 0; i < kStates; ++i) matrix[i * kStates + i] = kNone;
  for (const auto& [state, value] : diagonal) matrix[state * kStates + state] = value;
  std::string text = "    process_noise_covariance: [\n";
  for (std::size_t row = 0; row < kStates; ++row) {
    const std::string_view comma = row + 1 < kStates ? "," : "]";
    std::vector<std::string> numbers;
    for (std::size_t column = 0; column < kStates; ++column)
      numbers.push_back(ros_double(matrix[row * kStates + column], kDigits));
    text += fmt::format("      {}{}\n", fmt::join(numbers, ", "), comma);
  }
  return text;
}

}  // namespace

std::string robot_localization(const Robot& calibrated) {
  // Over an interval of 1/rate the way is speed/rate; as a velocity its variance is divided by the square of
  // the interval.
  const Matrix3 twist = covariance_per_metre(calibrated) * kSpeed_m_s * kOdometryRate_hz;
  std::string text = export_head(calibrated, "#");
  text += fmt::format(
      "# Covariances at {} m/s and {} messages a second: in proportion to speed and rate, change them for "
      "yours.\n"
      "# They are those of noise; what the calibration does not know lasts, and no filter of this kind has "
      "it.\n",
      kSpeed_m_s, kOdometryRate_hz);
  text += fmt::format(
      "diff_drive_controller:  # or whichever publishes the wheels' odometry\n  ros__parameters:\n"
      "    # vx [m2/s2], vy [m2/s2], not used: z, roll, pitch; vyaw [rad2/s2]\n"
      "    twist_covariance_diagonal: [{}, {}, 1e-9, 1e-9, 1e-9, {}]\n",
      ros_double(twist(0, 0), kDigits), ros_double(twist(1, 1), kDigits), ros_double(twist(2, 2), kDigits));
  text += fmt::format("ekf_filter_node:\n  ros__parameters:\n    frequency: {:.1f}\n    two_d_mode: true\n",
                      kFilterRate_hz);
  text +=
      "    odom0: /diff_drive_controller/odom\n    odom0_config: " + config_of({kForward, kLeft, kYawRate}) +
      "\n";
  if (const auto& gyro = calibrated.chassis.gyro) {
    const double variance = gyro->noise_rad_s_sqrt_hz * gyro->noise_rad_s_sqrt_hz * kGyroRate_hz;
    text += "    imu0: /imu\n    imu0_config: " + config_of({kYawRate}) + "\n";
    text += fmt::format(
        "    # angular_velocity_covariance[8] of /imu at {} messages a second: {:.4g} rad2/s2\n"
        "    # Its rate is wrong by a bias of {:.9g} rad/s and a scale of {:.9g}: rate = {:.9g} * (reading - "
        "bias)\n",
        kGyroRate_hz, variance, gyro->bias_rad_s, gyro->scale, gyro->scale);
  }
  text += fmt::format(
      "    # Per second. Poses get their noise from the velocities; vx and vy [m2/s3] and vyaw [rad2/s3] "
      "follow\n"
      "    # {} m/s2 and {} rad/s2: nothing here was measured of them, take your robot's.\n",
      kAcceleration_m_s2, kTurnAcceleration_rad_s2);
  const double linear = kAcceleration_m_s2 * kAcceleration_m_s2 / kFilterRate_hz;
  const double turning = kTurnAcceleration_rad_s2 * kTurnAcceleration_rad_s2 / kFilterRate_hz;
  text += process_noise({{kForward, linear}, {kLeft, linear}, {kYawRate, turning}});
  return text;
}

}  // namespace trundle::calibration
