#pragma once

#include <optional>
#include <string>

#include "trundle/inspection/inspect.hpp"
#include "trundle/recording/time_offset.hpp"

namespace trundle::inspection {

/// The clock of the gyro, the steering, the reference or the landmark sensor, against the wheels'.
struct ClockComparison {
  bool is_possible = false;          ///< both are there, and may show the same motion
  std::optional<TimeOffset> offset;  ///< none: it cannot be determined
  std::optional<Finding> problem;    ///< it is not what the files say, and does harm

  /// Then by how much is known, too: of clocks that are apart it may not be.
  [[nodiscard]] bool is_off() const { return problem && offset; }
};
/// Those on board.
struct BoardClocks {
  ClockComparison gyro, steering;
};
/// `by_unsteered`: of the gyro, as GyroClock gives it. Where the steering alone sees turns its clock and the
/// gyro's are found together.
BoardClocks compare_clocks(const Recording& recording, const Robot& robot,
                           const std::optional<TimeOffset>& by_unsteered);
ClockComparison compare_reference_clock(const Recording& recording, const AlignedReadings& readings,
                                        const Robot& robot);
ClockComparison compare_sighting_clock(const Recording& recording, const AlignedReadings& readings,
                                       const Robot& robot);

/// The recording.toml that it was read by; empty where there is none.
std::string recording_toml_of(const Recording& recording);

}  // namespace trundle::inspection
