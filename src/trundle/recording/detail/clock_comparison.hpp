#pragma once

#include <optional>
#include <span>
#include <vector>

#include "trundle/recording/detail/joint_offsets.hpp"
#include "trundle/recording/detail/offset_search.hpp"
#include "trundle/recording/detail/steered_motion.hpp"
#include "trundle/recording/time_offset.hpp"

namespace trundle::recording {

/// The motion on board beside what the reference shows of it, and beside the bearings of landmarks. The
/// sightings and the references must live as long. Nothing where there is nothing to compare.
[[nodiscard]] std::optional<ClockComparison> reference_clocks(std::span<const ReferenceLog> logs,
                                                              const Robot& robot,
                                                              const TimeOffsetOptions& options);
[[nodiscard]] std::optional<ClockComparison> sighting_clocks(const std::vector<Sighting>& sightings,
                                                             const AlignedReadings& readings,
                                                             const Robot& robot,
                                                             const TimeOffsetOptions& options);
/// The motion by the steering beside what the reference shows of it: the steering's clock, as a change of
/// what it is given as, and the reference's. Motion and reference must live as long.
[[nodiscard]] std::optional<JointClocks> steering_and_reference_clocks(const SteeredMotion& motion,
                                                                       const ReferenceStream& reference,
                                                                       const Robot& robot,
                                                                       const TimeOffsetOptions& steering);

}  // namespace trundle::recording
