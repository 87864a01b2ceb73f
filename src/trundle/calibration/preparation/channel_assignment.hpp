#pragma once

#include <span>
#include <vector>

#include "trundle/calibration/problem/run.hpp"
#include "trundle/chassis/robot.hpp"

namespace trundle::calibration {

/// Whether the columns of a log belong to the wheels whose names they bear.
struct ChannelAssignment {
  Robot robot;                  ///< with the channels as the log shows them
  std::vector<Finding> faults;  ///< what differs from the robot file, without a place; empty: nothing
  std::vector<Finding>
      ambiguous;  ///< pairs that may be swapped without these runs showing it, without a place
};

/// Compares what every wheel read with what each place on the chassis should have read while the reference
/// moved: swapped ports, wheels that count backwards, a gyro upside down. These are errors of the order of
/// the readings themselves, far from what calibration may correct. Without a reference trajectory with
/// headings the robot is left as it is, but for a steering that wheels which are not steered contradict.
/// docs/theory/dead-wheels.md. Throws as align() does.
ChannelAssignment check_channels(std::span<const Recording> recordings, const Robot& robot);
/// The same of one recording that prepare_run() made ready.
ChannelAssignment check_channels(const Recording& recording, const Run& run, const Robot& robot);

}  // namespace trundle::calibration
