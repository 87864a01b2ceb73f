#pragma once

#include <array>
#include <span>

#include "trundle/chassis/robot.hpp"

namespace trundle::odometry {

/// What the sensors read over successive intervals, as columns of one length: see Increment.
struct TravelColumns {
  /// Per wheel: revolutions. Without wheels: [0] forward travel [m], [1] turn [rad].
  std::array<std::span<const double>, kMaxWheels> turned{};
  /// Of each steered wheel, as Chassis::all_wheels(): its steering in the middle of the interval [rad].
  std::array<std::span<const double>, kMaxWheels> steering_rad{};
  std::span<const double> gyro_rad = {};  ///< integral of the raw reading; empty: the gyro is not used
  std::span<const double> duration_s =
      {};  ///< needed with the gyro, where a velocity has a bias or tyres grow

  [[nodiscard]] std::size_t rows() const { return turned[0].size(); }
};

/// The pose after each interval, as columns of the same length, in the caller's memory.
struct PoseColumns {
  std::span<double> x_m;
  std::span<double> y_m;
  std::span<double> heading_rad;
};

/// Bulk dead reckoning without covariance. The poses are those of Odometer::step to the last bit: same
/// arithmetic, done in vectors where no row waits for the one before it. Fast where no gyro is
/// weighed against wheels (docs/theory/odometry.md) and none scrub or grow; a loop over Odometer::step
/// otherwise. Throws CannotAnswer when the chassis cannot determine its motion, InputError when a column's
/// length differs.
void dead_reckon(const Robot& robot, const TravelColumns& travel, const Pose2& start,
                 const PoseColumns& poses);

}  // namespace trundle::odometry
