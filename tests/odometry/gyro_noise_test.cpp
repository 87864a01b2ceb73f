#include "trundle/odometry/gyro_noise.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "trundle/statistics/random.hpp"

#include "scale.hpp"

namespace trundle::odometry {
namespace {

constexpr double kDensity = 3e-4;  // [rad/s/√Hz]

/// A robot that stands, drives for three seconds, and so on; gyro and wheels have rates of their own.
struct Stops {
  double gyro_hz = 100.0, wheels_hz = 20.0;
  double rest_s = 5.0;
  int rests = 2;
  double density = kDensity;
  double walk = 0.0;        ///< [rad/s/√s]
  double resolution = 0.0;  ///< over the sigma of a reading of kDensity
};

Recording recorded(const Stops& stops, std::uint64_t seed) {
  constexpr double kDrive_s = 3.0;
  statistics::Random random(seed, 7);
  const double period_s = stops.rest_s + kDrive_s, end_s = stops.rests * period_s;
  const auto drives = [&](double time_s) { return std::fmod(time_s, period_s) > stops.rest_s; };
  Recording recording;
  recording.wheels.series = {{"left", WheelUnit::ticks, {}}, {"right", WheelUnit::ticks, {}}};
  double ticks = 0.0;
  for (int i = 0; i <= end_s * stops.wheels_hz; ++i) {
    const double time_s = i / stops.wheels_hz;
    ticks += drives(time_s) ? 10.0 : 0.0;
    recording.wheels.time_s.push_back(time_s);
    for (WheelSeries& series : recording.wheels.series) series.value.push_back(ticks);
  }
  double bias = random.normal(0.01);
  const double step = stops.resolution * kDensity * std::sqrt(stops.gyro_hz);
  for (int i = 0; i <= end_s * stops.gyro_hz; ++i) {
    const double time_s = i / stops.gyro_hz;
    bias += random.normal(stops.walk / std::sqrt(stops.gyro_hz));
    const double rate =
        bias + random.normal(stops.density * std::sqrt(stops.gyro_hz)) + (drives(time_s) ? 0.3 : 0.0);
    recording.gyro.time_s.push_back(time_s);
    recording.gyro.yaw_rate_rad_s.push_back(step == 0.0 ? rate : step * std::round(rate / step));
  }
  return recording;
}

/// In how many of so many recordings the noise is more than that of a density.
int louder(const Stops& stops, double density, int recordings) {
  int count = 0;
  for (int seed = 0; seed < recordings; ++seed) {
    const auto noise = gyro_noise(recorded(stops, static_cast<std::uint64_t>(seed)));
    count += noise && is_louder(*noise, density) ? 1 : 0;
  }
  return count;
}

/// At the stated rate, once in a thousand; more than nine of 2000, or two of 100, have a chance of 1e-4.
TEST(GyroNoise, equal_noise_is_louder_once_in_a_thousand_times) {
  const int recordings = test::trials(2000, 100);
  const int most = recordings == 2000 ? 9 : 2;
  for (const Stops& stops : {Stops{.gyro_hz = 10.0, .wheels_hz = 50.0, .rest_s = 2.0, .rests = 1},
                             Stops{.gyro_hz = 10.0, .wheels_hz = 50.0, .rests = 4, .walk = 1e-4},
                             Stops{.rest_s = 2.0, .rests = 3}, Stops{.walk = 1e-4}})
    for (const double resolution : {0.0, 1.0, 3.0}) {
      Stops rounded = stops;
      rounded.resolution = resolution;
      EXPECT_LE(louder(rounded, kDensity, recordings), most)
          << stops.gyro_hz << " Hz, in steps of " << resolution << " sigmas";
    }
}

/// Of a gyro slower than the wheels, too, whose readings between are interpolated and scatter less.
TEST(GyroNoise, three_times_as_much_is_louder) {
  constexpr int kRecordings = 50;
  EXPECT_EQ(
      louder({.gyro_hz = 10.0, .wheels_hz = 50.0, .density = 3.0 * kDensity}, 1.5 * kDensity, kRecordings),
      kRecordings);
  EXPECT_EQ(louder({.density = 3.0 * kDensity}, 1.5 * kDensity, kRecordings), kRecordings);
  EXPECT_EQ(louder({.density = 3.0 * kDensity, .resolution = 3.0}, 1.5 * kDensity, kRecordings), kRecordings);
}

/// Noise of a tenth of a step shows as none, or where the bias is between two steps as readings that toggle:
/// they scatter by half a step, five times the noise.
TEST(GyroNoise, what_resolution_makes_of_it_is_not_louder) {
  for (const double bias : {0.0, 0.49, 0.5}) {
    constexpr double kSigma = 0.1;  // of a reading, in steps of 1
    statistics::Random random(1, 2);
    Recording recording = recorded({}, 1);
    for (double& rate : recording.gyro.yaw_rate_rad_s) rate = std::round(bias + random.normal(kSigma));
    const auto noise = gyro_noise(recording);
    ASSERT_TRUE(noise);
    const double density = kSigma / std::sqrt(100.0);
    EXPECT_FALSE(is_louder(*noise, density));
    const double least = bias == 0.5 ? 4.0 * density : 0.0, most = bias == 0.0 ? 0.0 : 6.0 * density;
    EXPECT_GE(noise->noise_rad_s_sqrt_hz, least);
    EXPECT_LE(noise->noise_rad_s_sqrt_hz, most);
  }
}

/// Somebody lifts the robot at the end: its wheels stand, and it does not.
TEST(GyroNoise, where_the_robot_is_carried_it_does_not_rest) {
  Recording recording = recorded({.rest_s = 8.0, .rests = 3}, 5);
  const auto quiet = gyro_noise(recording);
  for (std::size_t i = 0; i < recording.gyro.time_s.size(); ++i)
    if (const double time_s = recording.gyro.time_s[i]; time_s > 24.0 && time_s < 28.0)
      recording.gyro.yaw_rate_rad_s[i] += std::sin(10.0 * (time_s - 24.0));
  const auto noise = gyro_noise(recording);
  ASSERT_TRUE(quiet && noise);
  EXPECT_NEAR(noise->rest_s, quiet->rest_s - 4.0, 2.0);
  EXPECT_NEAR(noise->bias_rad_s, quiet->bias_rad_s, 0.01);
  EXPECT_FALSE(is_louder(*noise, kDensity));
}

TEST(GyroNoise, recordings_together_weigh_by_their_length) {
  const auto one = gyro_noise(recorded({.rests = 1}, 1)), other = gyro_noise(recorded({.rests = 4}, 2));
  ASSERT_TRUE(one && other);
  const GyroNoise both = pooled(std::vector{*one, *other});
  EXPECT_NEAR(both.degrees_of_freedom(), one->degrees_of_freedom() + other->degrees_of_freedom(), 1e-6);
  EXPECT_NEAR(both.noise_rad_s_sqrt_hz, kDensity, 5.0 * both.noise_sigma);
  EXPECT_LT(both.noise_sigma, other->noise_sigma);
}

TEST(GyroNoise, where_no_wheel_was_recorded_nothing_says_that_it_rests) {
  Recording recording = recorded({}, 1);
  recording.wheels = {};
  EXPECT_TRUE(gyro_noise(recording));
  EXPECT_FALSE(gyro_noise(recording, Chassis{}));
}

}  // namespace
}  // namespace trundle::odometry
