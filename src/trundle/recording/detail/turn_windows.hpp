#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "trundle/chassis/chassis.hpp"
#include "trundle/recording/detail/turn_integral.hpp"
#include "trundle/recording/recording.hpp"

namespace trundle::recording {

/// Windows that overlap by half, one after the other.
struct Windows {
  double start_s = 0.0;
  double half_s = 0.0;
  std::size_t count = 0;

  double time_s(std::size_t half) const { return start_s + half_s * static_cast<double>(half); }
};

/// At least that, and wide enough for what is read off between two samples of the slower sensor.
[[nodiscard]] double half_of_a_window(double least_s, double slower_step_s);

/// What a sensor turned in each window, its stamps moved by `offset_s`, each instant weighed by a triangle: a
/// window with sharp ends would be as noisy as the samples that lie there. Windows that it misses are not
/// used any more.
[[nodiscard]] Eigen::VectorXd turns_in(const Windows& windows, const TurnIntegral& sensor, double offset_s,
                                       std::vector<bool>& used);

/// What a sensor turned in windows of its own.
struct OwnTurns {
  Windows windows;
  std::vector<bool> known;
  Eigen::VectorXd turns;
};
[[nodiscard]] OwnTurns own_turns(const TurnIntegral& sensor, double half_s);

/// How noisy a sensor is: how much its turns jump to and fro, of how much they change. 3 of nothing but
/// noise.
[[nodiscard]] double roughness(const OwnTurns& own);

[[nodiscard]] TurnIntegral integral_of_gyro(const GyroStream& gyro, const Gyro& sensor);

}  // namespace trundle::recording
