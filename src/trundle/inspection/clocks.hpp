#pragma once

#include <optional>
#include <string>

#include "trundle/inspection/inspect.hpp"
#include "trundle/recording/time_offset.hpp"

namespace trundle::inspection {

/// The gyro's clock against the wheels'.
struct ClockComparison {
  bool is_possible = false;          ///< wheels that see turns and a gyro are there
  std::optional<TimeOffset> offset;  ///< none: it cannot be told
  std::optional<Finding> problem;    ///< it is not what the files say, and does harm
};
ClockComparison compare_clocks(const Recording& recording, const AlignedReadings& readings,
                               const Robot& robot);

/// The recording.toml that it was read by; empty where there is none.
std::string recording_toml_of(const Recording& recording);

}  // namespace trundle::inspection
