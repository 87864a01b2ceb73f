#include "trundle/calibration/export.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "trundle/calibration/exports/export_noise.hpp"
#include "trundle/calibration/exports/export_steered.hpp"
#include "trundle/calibration/exports/export_words.hpp"
#include "trundle/calibration/squares/square.hpp"
#include "trundle/chassis/rows.hpp"
#include "trundle/io/error.hpp"

namespace trundle::calibration {
namespace {

constexpr double kMetresPerInch = 0.0254;  // by definition

struct Format {
  std::string_view name;
  std::string_view suffix;
  std::string (*write)(const Robot& nominal, const Robot& calibrated);
};

bool has_only(const Robot& robot, std::initializer_list<WheelKind> kinds) {
  return robot.chassis.wheel_count > 0 &&
         std::ranges::all_of(robot.chassis.wheels(), [&](const Wheel& wheel) {
           return std::ranges::find(kinds, wheel.kind) != kinds.end();
         });
}

bool has_two_sides(const Robot& robot) {
  try {
    sided_drive(robot);
    return true;
  } catch (const CannotAnswer&) {
    return false;
  }
}

double metres_per_tick(const Robot& robot, std::size_t wheel, std::string_view format) {
  const Wheel& w = robot.chassis.wheels()[wheel];
  if (w.ticks_per_revolution == 0.0)
    refuse_export(format, robot,
                  fmt::format("wheel '{}' has no ticks_per_revolution", robot.wheel_names[wheel]));
  return kPi * w.diameter_m / std::abs(w.ticks_per_revolution);
}

// ros2_control
// ------------------------------------------------------------------------------------------------------

/// The names of the wheels on one side, as a YAML list.
std::string names_on_side(const Robot& robot, bool left) {
  double middle = 0.0;
  for (const Wheel& wheel : robot.chassis.wheels()) middle += wheel.y_m / robot.chassis.wheel_count;
  std::vector<std::string> names;
  for (std::size_t i = 0; i < robot.wheel_names.size(); ++i)
    if ((robot.chassis.wheels()[i].y_m > middle) == left) names.push_back(robot.wheel_names[i]);
  return fmt::format("[\"{}\"]", fmt::join(names, "\", \""));
}

/// The controller rolls radius × multiplier and turns by separation × multiplier.
std::string ros2_control(const Robot& nominal, const Robot& calibrated) {
  if (is_steered(calibrated.chassis)) return ros2_control_of_steered(calibrated);
  if (!has_two_sides(nominal))
    refuse_export("ros2_control", nominal, "diff_drive_controller needs left and right wheels");
  const SidedDrive before = sided_drive(nominal);
  const SidedDrive after = sided_drive(calibrated);
  const double radius = 0.5 * before.mean_diameter_m();
  std::string text = export_head(calibrated, "#");
  text += "# The names of the joints are those of robot.toml: replace them by your own.\n";
  text += "diff_drive_controller:\n  ros__parameters:\n";
  text += fmt::format("    left_wheel_names: {}\n", names_on_side(nominal, true));
  text += fmt::format("    right_wheel_names: {}\n", names_on_side(nominal, false));
  text += fmt::format("    wheel_separation: {}\n", ros_double(before.track_m));
  text += fmt::format("    wheel_radius: {}\n", ros_double(radius));
  text += fmt::format("    wheel_separation_multiplier: {}\n", ros_double(after.track_m / before.track_m));
  text +=
      fmt::format("    left_wheel_radius_multiplier: {}\n", ros_double(0.5 * after.left_diameter_m / radius));
  text += fmt::format("    right_wheel_radius_multiplier: {}\n",
                      ros_double(0.5 * after.right_diameter_m / radius));
  return text;
}

// ArduPilot
// ---------------------------------------------------------------------------------------------------------

/// x forward, y to the right. Its counts per revolution are whole, so what is cut off goes into the radius.
std::string ardupilot_encoder(std::string_view prefix, const Robot& robot, std::size_t index) {
  const Wheel& wheel = robot.chassis.wheels()[index];
  const double per_tick = metres_per_tick(robot, index, "ardupilot");
  const double counts = std::round(std::abs(wheel.ticks_per_revolution));
  if (counts < 1.0 || counts > 32767.0)
    refuse_export("ardupilot", robot, fmt::format("{} counts per revolution do not fit 1 to 32767", counts));
  std::string text = fmt::format("{}_CPR,{:.0f}\n", prefix, counts);
  text += fmt::format("{}_RADIUS,{:.7g}\n", prefix, per_tick * counts / (2.0 * kPi));
  text += fmt::format("{}_POS_X,{:.7g}\n", prefix, wheel.x_m);
  text += fmt::format("{}_POS_Y,{:.7g}\n", prefix, wheel.y_m == 0.0 ? 0.0 : -wheel.y_m);
  if (wheel.ticks_per_revolution < 0.0)
    text += fmt::format("# '{}' counts backwards: swap its pins A and B\n", robot.wheel_names[index]);
  return text;
}

std::string ardupilot(const Robot& nominal, const Robot& calibrated) {
  if (calibrated.chassis.wheel_count != 2 || !has_two_sides(nominal))
    refuse_export("ardupilot", nominal, "wheel encoders are two, on a left and a right wheel");
  return export_head(calibrated, "#") + ardupilot_encoder("WENC", calibrated, 0) +
         ardupilot_encoder("WENC2", calibrated, 1);
}

// Road Runner
// -------------------------------------------------------------------------------------------------------

std::string java(std::string_view name, double value, std::string_view comment) {
  return fmt::format("public double {} = {:.9g};{}{}\n", name, value, comment.empty() ? "" : " // ", comment);
}

/// It has one length per tick for all wheels: their mean; what they differ by is said.
struct TickLength {
  double inches = 0.0;
  double largest_difference = 0.0;  ///< relative
};

TickLength tick_length(const Robot& robot) {
  std::vector<double> inches;
  for (std::size_t i = 0; i < robot.wheel_names.size(); ++i)
    inches.push_back(metres_per_tick(robot, i, "road_runner") / kMetresPerInch);
  TickLength length;
  for (const double one : inches) length.inches += one / static_cast<double>(inches.size());
  for (const double one : inches)
    length.largest_difference = std::max(length.largest_difference, std::abs(one / length.inches - 1.0));
  return length;
}

std::string in_per_tick(const TickLength& length) {
  std::string comment = "mean of all wheels";
  if (length.largest_difference > 1e-4)
    comment += fmt::format(", which differ from it by up to {:.2f} %", 100.0 * length.largest_difference);
  return java("inPerTick", length.inches, comment);
}

/// A pod as Road Runner takes it: which way it rolls and by what it reads more per radian turned.
struct PodWords {
  bool parallel = false;  ///< rolls along x, else along y
  bool reversed = false;  ///< counts the other way
  double lever_m = 0.0;   ///< turn coefficient of its row, as if not reversed
};

constexpr double kLargestSkewRad = radians(5.0);

PodWords pod_words(const Robot& robot, std::size_t index) {
  const Wheel& wheel = robot.chassis.wheels()[index];
  const Vector3 row = rolling_row(wheel);
  PodWords words;
  words.parallel = std::abs(row.x()) > std::abs(row.y());
  const double along = words.parallel ? row.x() : row.y();
  if (std::abs(along) < std::cos(kLargestSkewRad))
    refuse_export("road_runner", robot,
                  fmt::format("pod '{}' rolls {:.1f}° off both axes", robot.wheel_names[index],
                              degrees(std::acos(std::min(1.0, std::abs(along))))));
  words.reversed = (along < 0.0) != (wheel.ticks_per_revolution < 0.0);
  words.lever_m = along < 0.0 ? -row.z() : row.z();
  return words;
}

/// Its localizers subtract yTicks · turn from what a parallel pod reads, xTicks · turn from a perpendicular
/// one.
std::string road_runner_pods(const Robot& robot) {
  const TickLength length = tick_length(robot);
  std::vector<std::string> lines;
  int parallel = 0;
  int perpendicular = 0;
  const auto pods = robot.wheel_names.size();
  for (std::size_t i = 0; i < pods; ++i) {
    const PodWords words = pod_words(robot, i);
    std::string name =
        words.parallel ? (pods == 2 ? "parYTicks" : fmt::format("par{}YTicks", parallel)) : "perpXTicks";
    (words.parallel ? parallel : perpendicular)++;
    const std::string comment = fmt::format("'{}'{}", robot.wheel_names[i],
                                            words.reversed ? ": counts backwards, set it to REVERSE" : "");
    lines.push_back(java(name, words.lever_m / kMetresPerInch / length.inches, comment));
  }
  if (perpendicular != 1 || parallel < 1 || parallel > 2)
    refuse_export("road_runner", robot,
                  "its localizers take one or two parallel pods and one perpendicular one");
  return fmt::format("{}{}{}", export_head(robot, "//"), in_per_tick(length), fmt::join(lines, ""));
}

std::string road_runner_tank(const Robot& robot) {
  const TickLength length = tick_length(robot);
  return export_head(robot, "//") + in_per_tick(length) +
         java("trackWidthTicks", sided_drive(robot).track_m / kMetresPerInch / length.inches, "");
}

/// Its mecanum kinematics divide the wheels' mean by trackWidth, which is therefore the mean lever (half of
/// track plus wheelbase), and sideways travel by inPerTick / lateralInPerTick.
std::string road_runner_mecanum(const Robot& robot) {
  const TickLength length = tick_length(robot);
  double lever = 0.0;
  double lateral = 0.0;
  for (const Wheel& wheel : robot.chassis.wheels()) {
    const Vector3 row = rolling_row(wheel);
    lever += std::abs(row.z()) / robot.chassis.wheel_count;
    lateral += std::abs(row.y()) / robot.chassis.wheel_count;
  }
  return export_head(robot, "//") + in_per_tick(length) +
         java("lateralInPerTick", length.inches / lateral, "") +
         java("trackWidthTicks", lever / kMetresPerInch / length.inches, "");
}

std::string road_runner(const Robot&, const Robot& calibrated) {
  if (has_only(calibrated, {WheelKind::omni}) && calibrated.chassis.wheel_count <= 3)
    return road_runner_pods(calibrated);
  if (has_only(calibrated, {WheelKind::mecanum}) && calibrated.chassis.wheel_count == 4)
    return road_runner_mecanum(calibrated);
  if (has_two_sides(calibrated)) return road_runner_tank(calibrated);
  refuse_export("road_runner", calibrated, "it knows dead-wheel pods, mecanum and tank drives");
}

// WPILib
// --------------------------------------------------------------------------------------------------------

std::string wpilib(const Robot&, const Robot& calibrated) {
  return wpilib_swerve(calibrated);
}

std::string robot_localization_of(const Robot&, const Robot& calibrated) {
  return robot_localization(calibrated);
}

constexpr std::array<Format, 5> kFormats = {
    {{"ros2_control", "ros2_control.yaml", ros2_control},
     {"road_runner", "road_runner.java", road_runner},
     {"ardupilot", "ardupilot.param", ardupilot},
     {"wpilib", "wpilib.java", wpilib},
     {"robot_localization", "robot_localization.yaml", robot_localization_of}}};
constexpr std::array<std::string_view, 5> kFormatNames = {
    kFormats[0].name, kFormats[1].name, kFormats[2].name, kFormats[3].name, kFormats[4].name};

const Format& format_named(std::string_view name) {
  const auto found = std::ranges::find(kFormats, name, &Format::name);
  assert(found != kFormats.end());
  return *found;
}

}  // namespace

std::span<const std::string_view> export_formats() {
  return kFormatNames;
}

std::string_view export_suffix(std::string_view format) {
  return format_named(format).suffix;
}

std::string export_robot(std::string_view format, const Robot& nominal, const Robot& calibrated) {
  return format_named(format).write(nominal, calibrated);
}

}  // namespace trundle::calibration
