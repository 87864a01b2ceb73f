#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "trundle/recording/recording.hpp"
#include "trundle/statistics/random.hpp"

namespace trundle::test {
using namespace recording;

/// A robot that is told speed and yaw rate, and comes to them as 1 − exp(−t/lag), a delay after they were
/// told.
struct LaggingDrive {
  double lag_s = 0.0;
  double delay_s = 0.0;
  double duration_s = 240.0;
  double yaw_scale = 1.0;
  double commands_hz = 50.0;
  double reference_hz = 20.0;
  double sightings_hz = 4.0;
  double bearing_sigma_rad = 0.005;
  double turn_sigma_rad_sqrt_s = 0.005;  ///< of the turn itself, for each √s
};

inline std::vector<Landmark> ring_of_landmarks() {
  std::vector<Landmark> landmarks;
  for (int i = 0; i < 15; ++i) {
    const double angle = 2.0 * kPi * i / 15.0;
    landmarks.push_back({std::to_string(i), 5.0 * Vector2(std::cos(angle), std::sin(angle))});
  }
  return landmarks;
}

/// A new command every one to four seconds, back to the middle where it comes near the landmarks. Made by
/// steps of a millisecond, by nothing of the library.
inline Recording lagging_recording(const LaggingDrive& robot, std::uint64_t seed) {
  constexpr double kTick_s = 1e-3;
  Random random(seed, 7);
  const auto uniform = [&](double low, double high) { return low + (high - low) * random.uniform(); };
  const auto every = [](double hz) { return static_cast<int>(std::lround(1.0 / (hz * kTick_s))); };
  const auto delay = static_cast<std::size_t>(std::lround(robot.delay_s / kTick_s));
  const std::vector<Landmark> landmarks = ring_of_landmarks();
  Recording recording;
  recording.name = "lagging";
  std::vector<Vector2> told;
  double x = 0.0, y = 0.0, heading = 0.0, v = 0.0, w = 0.0, next_s = 0.0;
  Vector2 command(0.0, 0.0);
  const int steps = static_cast<int>(robot.duration_s / kTick_s);
  for (int k = 0; k <= steps; ++k) {
    const double time_s = k * kTick_s;
    if (time_s >= next_s) {
      const double home = std::remainder(std::atan2(-y, -x) - heading, 2.0 * kPi);
      const bool far = std::hypot(x, y) > 2.5;
      command = {uniform(0.0, 0.4), far ? std::copysign(uniform(0.2, 0.8), home) : uniform(-0.8, 0.8)};
      next_s += uniform(1.0, 4.0);
    }
    told.push_back(command);
    if (k % every(robot.commands_hz) == 0) {
      recording.velocity.time_s.push_back(time_s);
      recording.velocity.forward_m_s.push_back(command.x());
      recording.velocity.yaw_rate_rad_s.push_back(command.y());
    }
    if (k % every(robot.reference_hz) == 0) {
      recording.reference.time_s.push_back(time_s);
      recording.reference.x_m.push_back(x + random.normal(0.002));
      recording.reference.y_m.push_back(y + random.normal(0.002));
      recording.reference.heading_rad.push_back(heading + random.normal(0.005));
    }
    if (k % every(robot.sightings_hz) == 0)
      for (const Landmark& landmark : landmarks) {
        const double dx = landmark.position.x() - x, dy = landmark.position.y() - y;
        const double bearing = std::remainder(std::atan2(dy, dx) - heading, 2.0 * kPi);
        if (std::abs(bearing) < 0.9)
          recording.sightings.push_back({time_s, landmark.name, std::hypot(dx, dy) + random.normal(0.02),
                                         bearing + random.normal(robot.bearing_sigma_rad)});
      }
    const Vector2 followed = k >= static_cast<int>(delay) ? told[told.size() - 1 - delay] : Vector2(0.0, 0.0);
    const double share = robot.lag_s > 0.0 ? 1.0 - std::exp(-kTick_s / robot.lag_s) : 1.0;
    v += share * (followed.x() - v);
    w += share * (robot.yaw_scale * followed.y() - w);
    const double turn = w * kTick_s + random.normal(robot.turn_sigma_rad_sqrt_s * std::sqrt(kTick_s));
    x += v * kTick_s * std::cos(heading + 0.5 * turn);
    y += v * kTick_s * std::sin(heading + 0.5 * turn);
    heading += turn;
  }
  return recording;
}

/// As its file has it: no lag.
inline Robot told_robot() {
  Robot robot;
  robot.name = "told";
  robot.chassis.noise = {.wheel_per_sqrt_m = 0.01, .turn_per_sqrt_m = 0.01, .turn_per_sqrt_rad = 0.02};
  LandmarkSensor& sensor = robot.landmark_sensor.emplace();
  sensor.range_sigma_m = 0.02;
  sensor.bearing_sigma_rad = 0.005;
  sensor.max_range_m = 12.0;
  return robot;
}

}  // namespace trundle::test
