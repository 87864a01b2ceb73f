#pragma once

#include <optional>

#include <Eigen/Core>

#include "trundle/calibration/squares/sheet.hpp"
#include "trundle/chassis/robot.hpp"

namespace trundle::calibration {

/// What a square run sees of a robot that turns by its left and right wheels.
struct SidedDrive {
  double left_diameter_m = 0.0;
  double right_diameter_m = 0.0;
  double track_m = 0.0;

  double mean_diameter_m() const { return 0.5 * (left_diameter_m + right_diameter_m); }
  Vector3 vector() const { return {left_diameter_m, right_diameter_m, track_m}; }
  static SidedDrive from(const Vector3& v) { return {v.x(), v.y(), v.z()}; }
};

/// Mean diameters of the two sides and the track. Throws CannotAnswer when the robot has no wheels on both
/// sides that all roll straight ahead.
SidedDrive sided_drive(const Robot& robot);
/// The robot with every wheel of a side scaled alike and its track replaced.
Robot with_drive(const Robot& robot, const SidedDrive& drive);

/// Where the run ends, minus where the robot believes to be: exactly, with both effects of unequal wheels
/// (bent legs, turns off the centre). The robot `truth` is steered around a square by its odometry `assumed`:
/// four legs, four quarter turns on the spot. Frame of the sheet, heading not wrapped.
/// docs/theory/umbmark.md, eq. 1 to 3.
Pose2 predict_square(const SidedDrive& truth, const SidedDrive& assumed, double side_m, Turn turn);
/// The chord of one of its legs [m].
double predict_leg(const SidedDrive& truth, const SidedDrive& assumed, double side_m);

/// A sheet in short: centres of gravity of the end-pose errors, the mean leg.
struct SquareMeans {
  Pose2 cw;
  Pose2 ccw;
  std::optional<double> leg_m = std::nullopt;
  std::optional<double> left_revolutions = std::nullopt;  ///< per leg; both or none
  std::optional<double> right_revolutions = std::nullopt;
};
/// Throws CannotAnswer when one sense is missing.
SquareMeans means_of(const SquareSheet& sheet);

/// [Borenstein & Feng 1996] from the positions alone: first order, mean diameter taken as nominal.
/// Throws CannotAnswer when the errors are no robot's. docs/theory/umbmark.md, eq. 4 to 7.
SidedDrive solve_classic(const SquareMeans& means, double side_m, const SidedDrive& nominal);
/// From the headings and the measured leg: exact. Without a leg the mean diameter is taken as nominal.
/// Throws CannotAnswer when the errors are no robot's. docs/theory/umbmark.md, eq. 8 to 11.
SidedDrive solve_orientation(const SquareMeans& means, double side_m, const SidedDrive& nominal);

}  // namespace trundle::calibration
