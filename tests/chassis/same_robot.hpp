#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <optional>

#include "trundle/chassis/detail/robot_keys.hpp"

// Sameness of robots to the last bit, by the tables of keys.
namespace trundle::test {
using namespace chassis;

using robot_file::NumberKey;

template <class T, std::size_t n>
inline bool same(const std::array<NumberKey<T>, n>& keys, T a, T b) {
  return std::ranges::all_of(keys, [&](const NumberKey<T>& key) {
    return std::bit_cast<std::uint64_t>(key.in(a)) == std::bit_cast<std::uint64_t>(key.in(b));
  });
}

template <class T, class Same>
inline bool same(const std::optional<T>& a, const std::optional<T>& b, Same same_value) {
  return a.has_value() == b.has_value() && (!a || same_value(*a, *b));
}

inline bool same(const Wheel& a, const Wheel& b) {
  return same(robot_file::kWheelPlace, a, b) && same(robot_file::kWheelRoller, a, b) &&
         same(robot_file::kWheelSize, a, b) && a.kind == b.kind && a.tick_bits == b.tick_bits &&
         same(a.steering, b.steering, [](auto& x, auto& y) { return same(robot_file::kSteering, x, y); });
}

inline bool same(const CalibratedParameter& a, const CalibratedParameter& b) {
  return same(robot_file::kParameter, a, b) && a.sigma_within == b.sigma_within && a.name == b.name &&
         a.unit == b.unit && a.sigma_between == b.sigma_between && a.observable == b.observable;
}

inline bool same(const ErrorBeforeAfter& a, const ErrorBeforeAfter& b) {
  return same(robot_file::kError, a, b) && a.what == b.what && a.unit == b.unit;
}

inline bool same_record(const CalibrationRecord& a, const CalibrationRecord& b) {
  const auto same_values = [](const auto& x, const auto& y) { return same(x, y); };
  return a.provenance == b.provenance && std::ranges::equal(a.parameters, b.parameters, same_values) &&
         std::ranges::equal(a.errors, b.errors, same_values) && a.covariance.rows() == b.covariance.rows() &&
         a.covariance == b.covariance;
}

inline bool same(const Robot& a, const Robot& b) {
  return a.name == b.name && a.wheel_names == b.wheel_names && a.passive_names == b.passive_names &&
         a.chassis.wheel_count == b.chassis.wheel_count &&
         std::ranges::equal(a.chassis.all_wheels(), b.chassis.all_wheels(),
                            [](const Wheel& x, const Wheel& y) { return same(x, y); }) &&
         same(robot_file::kChassis, a.chassis, b.chassis) &&
         same(robot_file::kAllWheels, a.chassis, b.chassis) &&
         same(robot_file::kNoise, a.chassis.noise, b.chassis.noise) &&
         same(robot_file::kVelocity, a.chassis.velocity, b.chassis.velocity) &&
         same(robot_file::kReferenceSensor, a, b) && same(robot_file::kMarker, a, b) &&
         same(a.chassis.gyro, b.chassis.gyro,
              [](auto& x, auto& y) { return same(robot_file::kGyro, x, y); }) &&
         same(a.landmark_sensor, b.landmark_sensor,
              [](auto& x, auto& y) { return same(robot_file::kLandmarkSensor, x, y); }) &&
         same(a.calibration, b.calibration, same_record);
}

}  // namespace trundle::test
