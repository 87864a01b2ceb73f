#pragma once

#include <vector>

#include "trundle/chassis/robot.hpp"
#include "trundle/recording/recording.hpp"

namespace trundle {

/// The readings of a recording on the wheels' time base, ready for odometry.
struct AlignedReadings {
  double start_s = 0.0;
  std::vector<Increment> increments;  ///< contiguous: each starts where the one before it ends
  std::vector<bool> bridged;          ///< true: spans a gap; travel is known, its course is not
  std::vector<Finding> problems;      ///< found while aligning (wraps, resets, missing gyro)
};

/// Aligns wheels and gyro: counter wraps undone, sensor time offsets applied, the gyro integrated to the
/// wheels' stamps by linear interpolation of the integral, never of a rate across a gap. Throws InputError
/// when a wheel of the robot has no column, or the recording has neither wheels nor velocity.
AlignedReadings align(const Recording& recording, const Robot& robot);

/// Fills in what the gyro turned over each increment, its stamps moved as the robot says, and adds what was
/// found wrong with it to the problems. Nothing without a gyro or its readings.
void add_gyro(const GyroStream& gyro, const Robot& robot, AlignedReadings& aligned);

/// The reference as a trajectory of the reference sensor: samples where x, y and heading are all there.
Trajectory reference_trajectory(const Recording& recording);

/// trajectory.csv, .tum or reference.csv.
Trajectory read_trajectory(const std::filesystem::path& path);
std::string to_csv(const Trajectory& trajectory);
std::string to_tum(const Trajectory& trajectory);

}  // namespace trundle
