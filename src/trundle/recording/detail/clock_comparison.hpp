#pragma once

#include <optional>
#include <span>
#include <vector>

#include "trundle/recording/detail/offset_search.hpp"
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

}  // namespace trundle::recording
