#include "trundle/recording/velocity_lag.hpp"

#include <functional>
#include <span>

#include "trundle/recording/alignment/align.hpp"
#include "trundle/recording/detail/clock_comparison.hpp"

namespace trundle::recording {
namespace {

using Compare = std::function<std::optional<ClockComparison>(const AlignedReadings&, const Robot&)>;

std::optional<TimeOffset> lag_by(const Recording& recording, const Robot& robot, const Compare& compare) {
  if (robot.chassis.wheel_count > 0 || recording.velocity.time_s.empty()) return std::nullopt;
  const LaggingClocks with_lag = [&](double lag_s) {
    Robot lagging = robot;
    lagging.chassis.velocity.lag_s = lag_s;
    return compare(align(recording, lagging), lagging);
  };
  return find_lag(with_lag, robot.chassis.velocity.lag_s);
}

}  // namespace

std::optional<TimeOffset> velocity_lag_by_reference(const Recording& recording, const Robot& robot) {
  return lag_by(recording, robot, [&](const AlignedReadings& readings, const Robot& lagging) {
    const ReferenceLog log{recording.reference, readings};
    return reference_clocks(std::span(&log, 1), lagging, kReferenceClock);
  });
}

std::optional<TimeOffset> velocity_lag_by_sightings(const Recording& recording, const Robot& robot) {
  return lag_by(recording, robot, [&](const AlignedReadings& readings, const Robot& lagging) {
    return sighting_clocks(recording.sightings, readings, lagging, kSightingClock);
  });
}

}  // namespace trundle::recording
