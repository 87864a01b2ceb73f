#include "trundle/calibration/rough_scale.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "trundle/chassis/parameter.hpp"
#include "trundle/odometry/odometer.hpp"

namespace trundle {
namespace {

constexpr double kOfUnit = 0.3;  // how far off a factor of 1000 may be that is one of units

struct Stretch {
  double ratio;
  double length_m;  ///< by the wheels
  double turn_rad;
};

/// From knot to knot, as far as both ways of telling have it. Chords: the heading at the start is not needed.
void add_stretches(const Run& run, const Robot& robot, std::vector<Stretch>& stretches) {
  Odometer odometer(robot, {});
  std::optional<Pose2> reference;
  std::size_t done = 0;
  for (const std::size_t knot : run.knots) {
    const Pose2 before = odometer.pose();
    for (; done < knot; ++done) odometer.step(run.readings.increments[done]);
    const std::optional<Pose2> now = body_by_reference(run, knot, robot);
    if (now && reference) {
      const double rolled_m = (odometer.pose().translation() - before.translation()).norm();
      const double moved_m = (now->translation() - reference->translation()).norm();
      const double turn_rad = std::abs(wrap_angle(odometer.pose().heading - before.heading));
      if (rolled_m > 0.0) stretches.push_back({moved_m / rolled_m, rolled_m, turn_rad});
    }
    reference = now;
  }
}

/// All stretches by their ratios.
std::vector<Stretch> stretches_of(std::span<const Run> runs, const Robot& robot) {
  std::vector<Stretch> stretches;
  for (const Run& run : runs) add_stretches(run, robot, stretches);
  std::ranges::sort(stretches, {}, &Stretch::ratio);
  return stretches;
}

/// The ratio that a share of the length rolled does not exceed.
std::optional<double> quantile(const std::vector<Stretch>& stretches, double share) {
  double left_m = 0.0;
  for (const Stretch& stretch : stretches) left_m += share * stretch.length_m;
  for (const Stretch& stretch : stretches)
    if ((left_m -= stretch.length_m) <= 0.0) return stretch.ratio;
  return std::nullopt;
}

bool is_far_off(double scale) {
  constexpr double kFarOff = 1.2;
  return scale >= kFarOff || scale <= 1.0 / kFarOff;
}

}  // namespace

std::optional<double> rough_scale(std::span<const Run> runs, const Robot& robot) {
  constexpr int kMostRounds = 5;
  const std::optional<double> first = quantile(stretches_of(runs, robot), 0.5);
  double scale = first.value_or(1.0);
  Robot scaled = robot;
  std::optional<double> ratio = first;
  for (int round = 0; round < kMostRounds && ratio && *ratio > 0.0; ++round) {
    if (!is_far_off(*ratio)) return scale;
    scale_wheels(*ratio, scaled);
    ratio = quantile(stretches_of(runs, scaled), 0.5);
    scale *= ratio.value_or(1.0);
  }
  return first;
}

bool stretches_agree(std::span<const Run> runs, const Robot& given) {
  constexpr double kAlike = 1.3;  // of the middle half of what was rolled
  // Wheels that roll too far wind the chords of their stretches up: they are looked at as the reference has
  // them. (The place of the reference only makes it move farther.)
  Robot robot = given;
  if (const double scale = rough_scale(runs, given).value_or(1.0); scale > 0.0 && scale < 1.0)
    scale_wheels(scale, robot);
  const std::vector<Stretch> stretches = stretches_of(runs, robot);
  double lever_m = 0.0, rolled_m = 0.0, turned_m = 0.0;
  for (const Wheel& wheel : robot.chassis.wheels())
    lever_m = std::max(lever_m, std::hypot(wheel.x_m, wheel.y_m));
  for (const Stretch& stretch : stretches) {
    rolled_m += stretch.length_m;
    turned_m += stretch.turn_rad * lever_m;
  }
  const auto low = quantile(stretches, 0.25), high = quantile(stretches, 0.75);
  return low && high && *high < kAlike * *low && rolled_m > turned_m;
}

std::string scale_fault(std::span<const Run> runs, const Robot& robot) {
  const auto scale = rough_scale(runs, robot);
  if (!scale || *scale == 0.0 || !is_far_off(*scale)) return {};
  const bool is_unit = std::ranges::any_of(
      std::array{1000.0, 0.001}, [&](double factor) { return std::abs(*scale / factor - 1.0) < kOfUnit; });
  return fmt::format(
      "the reference moves {:.3g} times as far as the wheels with the robot file as given: {}", *scale,
      is_unit ? "is one of them in millimetres? Write unit = \"mm\" at its columns in recording.toml"
              : "check ticks_per_revolution, gears and diameters");
}

void scale_wheels(double factor, Robot& robot) {
  for (const Parameter& parameter : parameters_of(robot))
    if (parameter.kind == ParameterKind::diameter)
      set_value(parameter, factor * value_of(parameter, robot), robot);
}

}  // namespace trundle
