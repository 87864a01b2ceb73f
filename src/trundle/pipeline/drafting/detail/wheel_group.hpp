#pragma once

#include <string>
#include <vector>

#include "trundle/logs/survey.hpp"
#include "trundle/pipeline/drafting/detail/names.hpp"

namespace trundle::pipeline {

/// What a number of a wheel is, best first.
enum class WheelQuantity { ticks, angle, travel, rate, steering };

/// A number of one wheel.
struct WheelSource {
  WheelPlace place;
  const logs::TopicSummary* topic = nullptr;
  const logs::FieldSummary* field = nullptr;
};

/// Numbers whose names differ in the wheel alone.
struct WheelGroup {
  WheelQuantity quantity = WheelQuantity::ticks;
  std::string unit = {};  ///< as recording.toml takes it; empty: that of the column
  std::vector<WheelSource> wheels = {};
  bool moves = false;         ///< one of them does in this log
  bool is_of_wheels = false;  ///< their names say so, and not only that they are several
  int score = 0;
};

/// All that look like the wheels of a robot, the best first; steering is not among them.
[[nodiscard]] std::vector<WheelGroup> wheel_groups(const logs::LogSummary& summary);
/// The angles of steering of the same wheels; empty: there are none.
[[nodiscard]] WheelGroup steering_of(const logs::LogSummary& summary, const WheelGroup& wheels);

}  // namespace trundle::pipeline
