#include "trundle/odometry/dead_reckon.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "trundle/chassis/scrub.hpp"
#include "trundle/chassis/tyre_growth.hpp"
#include "trundle/io/error.hpp"
#include "trundle/odometry/odometer.hpp"
#include "trundle/odometry/reckon_kernels.hpp"

namespace trundle::odometry {
namespace {

void require_length(std::size_t length, std::size_t expected, const std::string& column) {
  if (length != expected)
    throw InputError("dead_reckon", fmt::format("column {} has {} rows", column, length),
                     fmt::format("{} as the first column", expected));
}

/// Of a velocity whose turn has a bias: over time.
bool drifts(const Chassis& chassis) {
  return chassis.wheel_count == 0 && chassis.velocity.yaw_bias_rad_s != 0.0;
}

std::array<const double*, kMaxInputs> inputs_of(const Chassis& chassis, const TravelColumns& travel,
                                                bool with_gyro) {
  std::array<const double*, kMaxInputs> inputs{};
  const auto wheels = static_cast<std::size_t>(chassis.wheel_count > 0 ? chassis.wheel_count : 2);
  for (std::size_t i = 0; i < wheels; ++i) {
    inputs[i] = travel.turned[i].data();
    require_length(travel.turned[i].size(), travel.rows(), fmt::format("turned[{}]", i));
  }
  if (!with_gyro && !drifts(chassis) && !grows(chassis)) return inputs;
  require_length(travel.duration_s.size(), travel.rows(), "duration_s");
  inputs[wheels + 1] = travel.duration_s.data();
  inputs[wheels] = inputs[wheels + 1];  // without a gyro its column has no gain
  if (!with_gyro) return inputs;
  inputs[wheels] = travel.gyro_rad.data();
  require_length(travel.gyro_rad.size(), travel.rows(), "gyro_rad");
  return inputs;
}

/// The gyro's integral and the duration behind the places of all wheels, as SteeredSums has them.
std::array<const double*, kMaxInputs> in_fixed_places(std::array<const double*, kMaxInputs> inputs,
                                                      const Chassis& chassis) {
  const auto wheels = chassis.wheels().size();
  const std::array gyro = {std::exchange(inputs[wheels], nullptr),
                           std::exchange(inputs[wheels + 1], nullptr)};
  std::ranges::copy(gyro, inputs.begin() + kMaxWheels);
  return inputs;
}

/// Of the steered wheels.
std::array<const double*, kMaxWheels> steering_of(const Chassis& chassis, const TravelColumns& travel) {
  std::array<const double*, kMaxWheels> steering{};
  for (std::size_t i = 0; i < chassis.all_wheels().size(); ++i) {
    if (!chassis.all_wheels()[i].steering) continue;
    steering[i] = travel.steering_rad[i].data();
    require_length(travel.steering_rad[i].size(), travel.rows(), fmt::format("steering_rad[{}]", i));
  }
  return steering;
}

void step_through(const Robot& robot, const TravelColumns& travel, const Pose2& start,
                  const PoseColumns& poses) {
  Odometer odometer(robot, {.start = start, .with_covariance = false});
  const ScrubGauge scrub_gauge(robot.chassis);
  ScrubState scrub;
  const SpeedGauge speed_gauge(robot.chassis);
  SpeedState speed;
  Increment increment{.has_gyro = !travel.gyro_rad.empty()};
  for (std::size_t i = 0; i < travel.rows(); ++i) {
    for (std::size_t k = 0; k < kMaxWheels; ++k) {
      if (!travel.turned[k].empty()) increment.turned[k] = travel.turned[k][i];
      if (!travel.steering_rad[k].empty()) increment.steering_rad[k] = travel.steering_rad[k][i];
    }
    if (increment.has_gyro) increment.gyro_rad = travel.gyro_rad[i];
    if (increment.has_gyro || grows(robot.chassis)) increment.duration_s = travel.duration_s[i];
    if (scrub_gauge.applies()) scrub_gauge.add(scrub, increment);
    if (grows(robot.chassis)) speed_gauge.add(speed, increment);
    odometer.step(increment);
    poses.x_m[i] = odometer.pose().x;
    poses.y_m[i] = odometer.pose().y;
    poses.heading_rad[i] = odometer.pose().heading;
  }
}

}  // namespace

void dead_reckon(const Robot& robot, const TravelColumns& travel, const Pose2& start,
                 const PoseColumns& poses) {
  const bool with_gyro = robot.chassis.gyro && !travel.gyro_rad.empty();
  const auto inputs = inputs_of(robot.chassis, travel, with_gyro);
  const auto steering = steering_of(robot.chassis, travel);
  require_length(poses.x_m.size(), travel.rows(), "x_m");
  require_length(poses.y_m.size(), travel.rows(), "y_m");
  require_length(poses.heading_rad.size(), travel.rows(), "heading_rad");
  require_observable(robot, with_gyro);
  if (robot.chassis.scrub != 0.0 || grows(robot.chassis)) return step_through(robot, travel, start, poses);
  const MotionModel model(robot.chassis, {}, with_gyro);
  if (const auto& steered = model.steered(); steered && steered->has_one_weighing())
    return reckon(
        SteeredReckoning{*steered, in_fixed_places(inputs, robot.chassis), steering, travel.rows(), start},
        poses);
  if (!model.has_one_gain()) return step_through(robot, travel, start, poses);
  const LinearisedChassis linearised = model.linearised();
  const auto given = static_cast<std::size_t>(std::ranges::find(inputs, nullptr) - inputs.begin());
  reckon({linearised.twist.data(), inputs, given, travel.rows(), start}, poses);
}

}  // namespace trundle::odometry
