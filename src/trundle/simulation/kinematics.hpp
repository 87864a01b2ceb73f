#pragma once

#include <array>

#include <Eigen/Core>

#include "trundle/chassis/rows.hpp"
#include "trundle/simulation/scenario.hpp"

namespace trundle::simulation {

using SteeringReadings = std::array<double, kMaxWheels>;  ///< readings, as Increment::steering_rad

/// Errors of one interval: of each measured row [m or rad], and of each 'does not skid sideways' row.
struct RowErrors {
  RowVector measured;
  RowVector lateral;
};

/// One interval as it happened.
struct Motion {
  Twist2 twist;      ///< of the true body
  RowVector travel;  ///< z of the measured rows: what the wheels rolled, slip included
};

/// How the commanded, the true and the sensed motion hang together. docs/theory/simulation.md, eq. 1 to 3.
class Kinematics {
 public:
  /// Throws CannotAnswer when steering by odometry that does not see all directions of motion.
  explicit Kinematics(const Scenario& scenario);

  /// Of a robot with steered wheels, before each interval: what their steerings read in it.
  void steer(const SteeringReadings& readings);

  /// The motion that is asked for, without what wheels that are not steered forbid.
  Twist2 ideal_twist(const Twist2& commanded) const;
  /// The measured rows' readings of a motion without errors.
  RowVector ideal_travel(const Twist2& commanded, double duration_s) const;
  Motion move(const Twist2& commanded, const RowErrors& errors, double duration_s) const;

  const Rows& rows() const { return true_rows_; }

 private:
  using Solver = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMaxRows + 1>;
  using Readings = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxRows + 1, 1>;

  void prepare_solver(const Scenario& scenario);
  Vector3 solve(const RowVector& travel, const RowVector& lateral, const Twist2& commanded) const;

  Steering steering_;
  Chassis nominal_;
  Chassis truth_;
  bool is_steered_;
  Rows unsteered_rows_;  ///< of the robot that drives the path, without its steered wheels
  Rows nominal_rows_;
  Rows true_rows_;
  RowVector diameter_ratio_;  ///< true over nominal, per measured row
  /// Of the readings that move the true robot: all of them when it steers by odometry; of steered wheels that
  /// follow the truth the lateral ones.
  Solver twist_from_readings_;
  bool holds_heading_ = false;  ///< the wheels cannot see the heading: the robot steers it by its gyro
  double gyro_scale_ratio_ = 1.0;
};

}  // namespace trundle::simulation
