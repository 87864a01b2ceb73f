#pragma once

#include <span>
#include <vector>

#include "trundle/calibration/problem/run.hpp"
#include "trundle/inspection/inspect.hpp"

namespace trundle::inspection {

/// A reference of the same drive that lasts a thousand, a million times as long has stamps in another unit.
void find_wrong_time_unit(const Recording& recording, std::span<const StreamSummary> streams,
                          std::vector<Finding>& problems);

/// The units of the reference: its way and its turns against the wheels', unless these scrub and slide.
void compare_references(const Recording& recording, const Run& run, const Robot& robot,
                        std::vector<Finding>& problems);

/// Positions alone that bend the other way than the wheels are steered.
void find_mirrored_path(const Recording& recording, const Run& run, const Robot& robot,
                        std::vector<Finding>& problems);

/// Of robots that roll where they look, the reference against itself.
void find_mirrored_reference(const Recording& recording, const Robot& robot, std::vector<Finding>& problems);

}  // namespace trundle::inspection
