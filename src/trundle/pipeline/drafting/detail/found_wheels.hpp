#pragma once

#include <optional>
#include <string>
#include <vector>

#include "trundle/pipeline/drafting/detail/wheel_group.hpp"
#include "trundle/pipeline/drafting/draft.hpp"

namespace trundle::pipeline {

/// A number that names a wheel, as the draft will map it.
struct FoundWheel {
  std::string name;
  WheelPlace place;
  std::string joint;  ///< of a JointState; empty: none
  DraftColumn column;
  std::optional<DraftColumn> steering = {};
};
struct FoundWheels {
  WheelQuantity quantity = WheelQuantity::ticks;
  std::vector<FoundWheel> wheels = {};
  bool moves = false;
};

/// Of a group, with the angles of their steering; an empty group: none is steered.
[[nodiscard]] FoundWheels wheels_of(const WheelGroup& group, const WheelGroup& steering);
/// Of types that a format itself defines; nothing: the log has none.
[[nodiscard]] std::optional<FoundWheels> known_wheels(const logs::LogSummary& summary);

}  // namespace trundle::pipeline
