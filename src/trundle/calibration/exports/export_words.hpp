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

/// The first line of a file, behind the stack's sign of a comment; and one of what no stack has a word for.
inline std::string export_head(const Robot& robot, std::string_view comment) {
  std::string head =
      fmt::format("{} {} as calibrated by trundle\n", comment, robot.name.empty() ? "robot" : robot.name);
  if (robot.chassis.scrub != 0.0)
    head += fmt::format("{} The track is that of wide curves; on the spot the robot turns {:.1f} % less.\n",
                        comment, 100.0 * robot.chassis.scrub);
  if (robot.chassis.tyre_growth_s2_m2 != 0.0)
    head += fmt::format(
        "{} Diameters are those of slow wheels; at a speed of v m/s they roll by a share {:.3g} v^2 "
        "further.\n",
        comment, robot.chassis.tyre_growth_s2_m2);
  return head;
}

/// A number of a parameter file of ROS 2, which takes one without a point for an integer, and then refuses it
/// where it wants a double, or beside doubles in a list.
inline std::string ros_double(double value, int digits = 9) {
  std::string text = fmt::format("{:.{}g}", value, digits);
  if (text.find_first_of(".e") == std::string::npos) text += ".0";
  return text;
}

}  // namespace trundle::calibration
