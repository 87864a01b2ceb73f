#pragma once

#include <optional>

#include "trundle/chassis/robot.hpp"
#include "trundle/chassis/rows.hpp"
#include "trundle/recording/detail/turn_integral.hpp"
#include "trundle/recording/recording.hpp"
#include "trundle/recording/time_offset.hpp"

namespace trundle::recording {

/// Finds a gyro's clock by wheels that are not steered, for those who pass over the increments of a recording
/// anyway: what the wheels turned in each is all that is kept of it.
class GyroClock {
 public:
  /// Recording and robot must outlive it.
  GyroClock(const Recording& recording, const Robot& robot, const TimeOffsetOptions& options = {});

  /// The next increment of the recording. `bridged`: its course is not known.
  void add(const Increment& increment, bool bridged);

  /// After the last one: what gyro_time_offset() gives. `start_s`: of the first. Nothing is kept any more.
  [[nodiscard]] std::optional<TimeOffset> take_offset(double start_s);

 private:
  double usual_interval_s(double start_s) const;

  const Recording& recording_;
  const Robot& robot_;
  Chassis
      chassis_;  ///< without the steered wheels, if the others see turns: the steering has a clock of its own
  TimeOffsetOptions options_;
  Rows rows_;  ///< without the gyro
  bool is_observable_;
  Stamps ends_s_;
  Turns turns_;  ///< by the wheels, until each end
};

}  // namespace trundle::recording
