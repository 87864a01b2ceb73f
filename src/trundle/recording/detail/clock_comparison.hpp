#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "trundle/recording/detail/joint_offsets.hpp"
#include "trundle/recording/detail/motion_path.hpp"
#include "trundle/recording/detail/offset_search.hpp"
#include "trundle/recording/time_offset.hpp"

namespace trundle::recording {

/// The motion on board beside what the reference shows of it, and beside the bearings of landmarks. The
/// sightings and the references must live as long. Nothing where there is nothing to compare.
[[nodiscard]] std::optional<ClockComparison> reference_clocks(std::span<const ReferenceLog> logs,
                                                              const Robot& robot,
                                                              const TimeOffsetOptions& options);
/// Of the bearings with the motion smoothed over so long.
[[nodiscard]] std::optional<ClockComparison> sighting_clocks(const std::vector<Sighting>& sightings,
                                                             const AlignedReadings& readings,
                                                             const Robot& robot,
                                                             const TimeOffsetOptions& options,
                                                             double smoothed_over_s = 0.0);
/// The motion on board where one of its sensors has another clock.
struct MotionOnTwoClocks {
  /// With `later_s` added to the time offset of that sensor.
  std::function<std::optional<MotionPath>(double later_s)> path_at;
  bool turns_by_way = false;  ///< a sensor that is off by a constant turns the body by a multiple of its way
  double sensor_step_s = 0.0;
};
/// The motion beside what the reference shows of it: the sensor's clock, as a change of what it is given as,
/// and the reference's. What the motion is made of must live as long. Nothing without headings.
[[nodiscard]] std::optional<JointClocks> sensor_and_reference_clocks(MotionOnTwoClocks motion,
                                                                     const ReferenceStream& reference,
                                                                     const Robot& robot,
                                                                     const TimeOffsetOptions& options);

}  // namespace trundle::recording
