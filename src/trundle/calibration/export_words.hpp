#pragma once

#include <string>
#include <string_view>

#include <fmt/format.h>

#include "trundle/chassis/robot.hpp"
#include "trundle/io/error.hpp"

// What the exporters of all stacks share.
namespace trundle::calibration {

[[noreturn]] inline void refuse_export(std::string_view format, const Robot& robot, std::string_view fact) {
  throw CannotAnswer(fmt::format("{} has no words for '{}': {}", format, robot.name, fact));
}

/// The first line of a file, behind the stack's sign of a comment.
inline std::string export_head(const Robot& robot, std::string_view comment) {
  return fmt::format("{} {} as calibrated by trundle\n", comment, robot.name.empty() ? "robot" : robot.name);
}

}  // namespace trundle::calibration
