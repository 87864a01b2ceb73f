#pragma once

#include <cmath>
#include <cstdint>
#include <string>

#include "logs/packed_writers.hpp"

/// Logs of one drive of two wheels, as robots of several kinds would write it.
namespace trundle::test {

inline constexpr double kDrivenStep_s = 0.02;
inline constexpr int kDrivenRows = 1500;

/// Half a minute that begins and ends at rest: travel of the left and of the right wheel [m], of a track of
/// 0.5 m.
struct Driven {
  double left_m = 0.0, right_m = 0.0, yaw_rate_rad_s = 0.0;
};
template <class Take>
void drive_along(Take take) {
  double left_m = 0.0, right_m = 0.0;
  for (int row = 0; row < kDrivenRows; ++row) {
    const double t = kDrivenStep_s * row;
    const bool drives = t > 3.0 && t < 27.0;
    const double speed_m_s = drives ? 0.5 : 0.0, rate_rad_s = drives ? 0.8 * std::sin(0.5 * t) : 0.0;
    left_m += kDrivenStep_s * (speed_m_s - 0.25 * rate_rad_s);
    right_m += kDrivenStep_s * (speed_m_s + 0.25 * rate_rad_s);
    take(row, Driven{left_m, right_m, rate_rad_s});
  }
}

inline std::string wpilog() {
  WpilogWriter log;
  const std::uint32_t left = log.start("NT:/Drive/LeftDistanceMeters", "double");
  const std::uint32_t right = log.start("NT:/Drive/RightDistanceMeters", "double");
  const std::uint32_t gyro = log.start("NT:/Drive/Gyro/YawRateDegPerSec", "double");
  const std::uint32_t volts = log.start("NT:/Drive/LeftVoltage", "double");
  double before_m = -1.0;
  drive_along([&](int row, const Driven& driven) {
    log.time_us = 1'000'000 + 20'000 * static_cast<std::uint64_t>(row);
    if (driven.left_m != before_m) log.record(left, bytes_of_number(driven.left_m));  // on change alone
    if (driven.left_m != before_m) log.record(right, bytes_of_number(driven.right_m));
    before_m = driven.left_m;
    log.record(gyro, bytes_of_number(driven.yaw_rate_rad_s * 180.0 / 3.14159265358979));
    log.record(volts, bytes_of_number(12.0 + 0.001 * row));
  });
  return log.bytes();
}

inline std::string dataflash() {
  DataFlashWriter log;
  log.format(128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns");
  log.format(129, 3 + 8 + 16 + 4, "PARM", "QNf", "TimeUS,Name,Value");
  log.format(130, 3 + 8 + 4 + 1 + 4 + 1, "WENC", "QfBfB", "TimeUS,Dist0,Qual0,Dist1,Qual1");
  log.format(131, 3 + 8 + 4 + 4 + 4, "IMU", "Qfff", "TimeUS,GyrX,GyrY,GyrZ");
  const auto parameter = [&](const char* name, float value) {
    log.message(129, bytes_of_number(std::uint64_t{1}) + padded(name, 16) + bytes_of_number(value));
  };
  parameter("WENC_RADIUS", 0.1F);
  parameter("WENC_CPR", 3200.0F);
  parameter("WENC_POS_Y", -0.25F);
  parameter("WENC2_RADIUS", 0.1F);
  parameter("WENC2_POS_Y", 0.25F);
  drive_along([&](int row, const Driven& driven) {
    const std::string time = bytes_of_number(1'000'000 + 20'000 * static_cast<std::uint64_t>(row));
    log.message(130, time + bytes_of_number(static_cast<float>(driven.left_m)) + "d" +
                         bytes_of_number(static_cast<float>(driven.right_m)) + "d");
    log.message(131, time + bytes_of_number(0.0F) + bytes_of_number(0.0F) +
                         bytes_of_number(static_cast<float>(-driven.yaw_rate_rad_s)));  // z down
  });
  return log.bytes();
}

}  // namespace trundle::test
