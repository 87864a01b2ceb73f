#pragma once

#include <vector>

#include "trundle/chassis/robot.hpp"
#include "trundle/recording/alignment/increments.hpp"
#include "trundle/recording/recording.hpp"

namespace trundle::recording {

/// The readings of a recording on the wheels' time base, ready for odometry.
struct AlignedReadings {
  double start_s = 0.0;
  Increments increments;          ///< contiguous: each starts where the one before it ends
  std::vector<bool> bridged;      ///< true: spans a gap; travel is known, its course is not
  std::vector<Finding> findings;  ///< found while aligning (wraps, resets, missing gyro)
};

/// A recording through an Aligner, reading by reading as the stamps order them: the same as while it was
/// driven. Throws InputError when a wheel of the robot has no column, or the recording has neither wheels nor
/// velocity, or where columns of a stream differ in length.
AlignedReadings align(const Recording& recording, const Robot& robot);

/// Fills in anew what the gyro turned over each increment, its stamps moved as this robot says. Nothing
/// without a gyro or its readings.
void add_gyro(const GyroStream& gyro, const Robot& robot, AlignedReadings& aligned);

/// Fills in Increment::speed_turned, whatever the robot is known to depend on.
void add_speeds(const Chassis& chassis, AlignedReadings& aligned);

/// The rate at a stamp as the mean over at least 0.1 s on both its sides, for those who have the whole
/// recording: what the gyro turned changes by −gyro_change_rad_s for a second of its clock. At gaps and ends
/// nothing is said.
void centre_gyro_changes(AlignedReadings& aligned);

}  // namespace trundle::recording
