#pragma once

#include <array>
#include <optional>
#include <vector>

#include "trundle/chassis/robot.hpp"
#include "trundle/inspection/steady_turn.hpp"
#include "trundle/recording/recording.hpp"
#include "trundle/recording/time_offset.hpp"
#include "trundle/statistics/paired_sums.hpp"

namespace trundle::inspection {

/// Intervals of at least 2 s in all over which a wheel does not turn.
struct Standstill {
  double start_s = 0.0;
  double end_s = 0.0;
  std::array<double, kMaxWheels>
      way{};                         ///< of each wheel meanwhile, there and back counted twice [revolutions]
  std::optional<double> expected_m;  ///< that it rolled by the other sensors; nothing: they do not show it
  double expected_sigma_m = 0.0;     ///< 1σ of that by the gyro's bias, as the robot file knows it

  double duration_s() const { return end_s - start_s; }
};

/// What one pass over the readings of a recording shows of its sensors: none of the intervals is kept.
struct Overview {
  std::vector<Finding> findings;  ///< of aligning: wraps, resets, a missing gyro
  /// How far the robot turns over pieces of half a second, by its wheels (x) and by its gyro (y) [rad]; zero
  /// where one of them does not show it.
  PairedSums turns;
  double turns_of_a_bias_s = 0.0;  ///< times a bias of the gyro: what it makes of √yy
  std::optional<SteadyTurn> gyro_beside_wheels;
  PairedSums turns_unlimited;  ///< the same of a gyro that is never beyond its range
  double turned_rad = 0.0;     ///< by the gyro, there and back counted twice
  std::array<std::vector<Standstill>, kMaxWheels> standstills;
  std::array<double, kMaxWheels> way{};                               ///< of each wheel [revolutions]
  std::array<std::array<bool, kMaxWheels>, kMaxWheels> read_alike{};  ///< two wheels in every interval
  /// Share of what the wheels read over pieces of half a second that no motion explains, beyond rounding:
  /// root of squares.
  double unexplained = 0.0;
  std::optional<TimeOffset> gyro_time_offset;
};

/// Throws as align() does.
[[nodiscard]] Overview overview_of(const Recording& recording, const Robot& robot);

}  // namespace trundle::inspection
