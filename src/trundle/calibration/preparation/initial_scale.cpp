#include "trundle/calibration/preparation/initial_scale.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "trundle/chassis/parameter.hpp"
#include "trundle/odometry/odometer.hpp"
#include "trundle/recording/csv/units.hpp"

namespace trundle::calibration {
namespace {

struct Stretch {
  double ratio;
  double length_m;  ///< by the wheels
  double turn_rad;
};

/// From epoch to epoch, as far as both ways of telling have it: chords of the reference sensor's path, for
/// which no heading is needed.
void add_stretches(const Run& run, const Robot& robot, std::vector<Stretch>& stretches) {
  Odometer odometer(robot, {});
  const auto sensor_at = [&](const Pose2& body) { return body * robot.body_from_reference.translation(); };
  Pose2 before;
  ReferenceSample seen_before;
  std::size_t done = 0;
  for (std::size_t k = 0; k < run.epochs.size(); ++k) {
    for (; done < run.epochs[k]; ++done) odometer.step(run.readings.increments[done]);
    const Pose2 now = odometer.pose();
    const ReferenceSample seen =
        sample_reference(run.reference, run.epoch_time(k) - robot.reference_time_offset_s);
    if (seen.has_position() && seen_before.has_position()) {
      const double sensor_m = (sensor_at(now) - sensor_at(before)).norm();
      const double moved_m = (seen.value - seen_before.value).head<2>().norm();
      const double rolled_m = (now.translation() - before.translation()).norm();
      const double turn_rad = std::abs(wrap_angle(now.heading - before.heading));
      if (rolled_m > 0.0 && sensor_m > 0.0) stretches.push_back({moved_m / sensor_m, rolled_m, turn_rad});
    }
    before = now;
    seen_before = seen;
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

/// Of the middle half of what was rolled, the largest ratio over the least; infinite where it has none.
double spread_of(const std::vector<Stretch>& stretches) {
  const auto low = quantile(stretches, 0.25), high = quantile(stretches, 0.75);
  return low && high && *low > 0.0 ? *high / *low : INFINITY;
}

/// Of the reference, or of the wheels, by which a reference moves so many times as far as the wheels; null:
/// none.
const LengthUnit* unit_of(double times) {
  constexpr double kSameSize = 1.3;  // wheels are as large as the robot file says to within that
  for (const LengthUnit& unit : kLengthUnits) {
    const double metres = factor_of(unit.symbol, "x_m").value();
    for (const double ratio : {times * metres, times / metres})
      if (ratio < kSameSize && ratio > 1.0 / kSameSize) return &unit;
  }
  return nullptr;
}

bool is_far_off(double scale) {
  constexpr double kFarOff = 1.2;  // four prior sigmas of a diameter: Gauss–Newton starts right within that
  return scale >= kFarOff || scale <= 1.0 / kFarOff;
}

}  // namespace

// Both ways of explaining are tried where wheels and reference are far apart: stretches agree best by the
// right one, for who turns farther has shorter chords.
std::optional<InitialScale> initial_scale(std::span<const Run> runs, const Robot& robot) {
  constexpr int kMostScalings = 5;  // chords of curves do not grow in proportion
  const std::vector<Stretch> as_given = stretches_of(runs, robot);
  std::optional<double> ratio = quantile(as_given, 0.5);
  if (!ratio) return std::nullopt;
  const InitialScale all_lengths{*ratio, false};
  if (*ratio == 0.0 || !is_far_off(*ratio)) return InitialScale{*ratio, true};
  Robot scaled = robot;
  double times = 1.0;
  for (int round = 0; round < kMostScalings && ratio && *ratio > 0.0; ++round) {
    times *= *ratio;
    scale_wheels(*ratio, scaled);
    const std::vector<Stretch> stretches = stretches_of(runs, scaled);
    ratio = quantile(stretches, 0.5);
    if (ratio && !is_far_off(*ratio))
      return spread_of(stretches) <= spread_of(as_given) ? InitialScale{times * *ratio, true} : all_lengths;
  }
  return all_lengths;
}

bool stretches_agree(std::span<const Run> runs, const Robot& given) {
  constexpr double kLargestSpread = 1.3;
  // Wheels that roll too far wind the chords of their stretches up: they are looked at as the reference has
  // them. (The place of the reference only makes it move farther.)
  Robot robot = given;
  if (const auto scale = initial_scale(runs, given); scale && scale->turns_too && scale->times < 1.0)
    scale_wheels(scale->times, robot);
  const std::vector<Stretch> stretches = stretches_of(runs, robot);
  double lever_m = 0.0, rolled_m = 0.0, turned_m = 0.0;
  for (const Wheel& wheel : robot.chassis.wheels())
    lever_m = std::max(lever_m, std::hypot(wheel.x_m, wheel.y_m));
  for (const Stretch& stretch : stretches) {
    rolled_m += stretch.length_m;
    turned_m += stretch.turn_rad * lever_m;
  }
  return spread_of(stretches) < kLargestSpread && rolled_m > turned_m;
}

std::optional<ScaleFault> scale_fault(std::span<const Run> runs, const Robot& robot) {
  const auto scale = initial_scale(runs, robot);
  if (!scale || scale->times == 0.0 || !is_far_off(scale->times)) return std::nullopt;
  const double times = scale->times;
  const bool is_of_size = std::ranges::any_of(robot.chassis.wheels(), [&](const Wheel& wheel) {
    const double diameter_m = times * std::abs(wheel.diameter_m);
    return diameter_m < kLeastDiameter_m || diameter_m > kGreatestDiameter_m;
  });
  const bool is_of_unit = is_of_size || (robot.chassis.wheels().empty() && unit_of(times) != nullptr);
  const LengthUnit* const unit = is_of_unit ? unit_of(times) : nullptr;
  payload::LengthRatio ratio{.factor = times};
  if (unit != nullptr) ratio = {times, unit->name, unit->symbol};
  return ScaleFault{*scale, is_of_unit, ratio};
}

void scale_wheels(double factor, Robot& robot) {
  for (const Parameter& parameter : parameters_of(robot))
    if (parameter.kind == ParameterKind::diameter || parameter.kind == ParameterKind::velocity_forward_scale)
      set_value(parameter, factor * value_of(parameter, robot), robot);
}

}  // namespace trundle::calibration
