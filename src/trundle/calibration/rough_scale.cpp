#include "trundle/calibration/rough_scale.hpp"

#include <algorithm>

#include "trundle/chassis/parameter.hpp"
#include "trundle/odometry/odometer.hpp"

namespace trundle {
namespace {

struct Stretch {
  double ratio;
  double length_m;
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
      if (rolled_m > 0.0) stretches.push_back({moved_m / rolled_m, rolled_m});
    }
    reference = now;
  }
}

}  // namespace

std::optional<double> rough_scale(std::span<const Run> runs, const Robot& robot) {
  std::vector<Stretch> stretches;
  for (const Run& run : runs) add_stretches(run, robot, stretches);
  std::ranges::sort(stretches, {}, &Stretch::ratio);
  double left_m = 0.0;
  for (const Stretch& stretch : stretches) left_m += 0.5 * stretch.length_m;
  for (const Stretch& stretch : stretches)
    if ((left_m -= stretch.length_m) <= 0.0) return stretch.ratio;
  return std::nullopt;
}

void scale_wheels(double factor, Robot& robot) {
  for (const Parameter& parameter : parameters_of(robot))
    if (parameter.kind == ParameterKind::diameter)
      set_value(parameter, factor * value_of(parameter, robot), robot);
}

}  // namespace trundle
