#pragma once

#include <optional>

#include "trundle/chassis/robot.hpp"
#include "trundle/recording/alignment/align.hpp"

namespace trundle::recording {

/// How far the gyro's clock is from the wheels', found in a log.
struct TimeOffset {
  double offset_s =
      0.0;  ///< to be the gyro's time_offset_s in the robot file, that of the wheels being what it is
  double sigma_s = 0.0;  ///< with the scatter of this log, whatever causes it
  double correlation =
      0.0;  ///< of the two sensors' turns at that offset; negative: one of them has the wrong sign
};

struct TimeOffsetOptions {
  double largest_s = 0.5;         ///< searched on both sides of what the robot file says
  double window_s = 0.1;          ///< over which turns are compared
  double largest_sigma_s = 0.05;  ///< an offset known less well counts as untold
};

/// The offset at which the turns of the gyro explain those of the wheels best, their scale and the gyro's
/// bias being free; windows where a wheel slips are left out. docs/theory/alignment.md. Nothing where it
/// cannot be told: the wheels alone do not see the robot turn, it hardly turns or always at one rate, the
/// turns do not agree, or no gyro was recorded. Throws as align() does.
std::optional<TimeOffset> gyro_time_offset(const Recording& recording, const Robot& robot,
                                           const TimeOffsetOptions& options = {});
/// The same of readings that align() gave.
std::optional<TimeOffset> gyro_time_offset(const Recording& recording, const AlignedReadings& readings,
                                           const Robot& robot, const TimeOffsetOptions& options = {});

}  // namespace trundle::recording
