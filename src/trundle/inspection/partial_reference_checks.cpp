#include "trundle/inspection/partial_reference_checks.hpp"

#include <cmath>

#include "trundle/odometry/odometer.hpp"

namespace trundle::inspection {
namespace {

/// A run by wheels and gyro, with the robot file as given.
struct Driven {
  double way_m = 0.0;
  double to_end_m = 0.0;  ///< from start to end, of the reference sensor
  double turns = 0.0;
  bool by_gyro = true;
};

Driven driven(const Robot& robot, const AlignedReadings& readings) {
  Driven run;
  Odometer odometer(robot, {});
  for (const Increment& increment : readings.increments) {
    const Pose2 before = odometer.pose();
    odometer.step(increment);
    run.way_m += (odometer.pose().translation() - before.translation()).norm();
    run.by_gyro = run.by_gyro && increment.has_gyro;
  }
  const Pose2 sensor = robot.body_from_reference.inverse() * odometer.pose() * robot.body_from_reference;
  run.to_end_m = sensor.translation().norm();
  run.turns = odometer.pose().heading / (2.0 * kPi);
  return run;
}

/// How far from its start the run ended, as measured.
std::optional<double> measured_end_m(const PartialReference& partial) {
  if (partial.closed) return 0.0;
  if (partial.distance_m) return partial.distance_m->value;
  if (partial.end_x_m && partial.end_y_m) return std::hypot(partial.end_x_m->value, partial.end_y_m->value);
  return std::nullopt;
}

bool ends_elsewhere(double measured_m, const Driven& run) {
  constexpr double kKnown = 0.25;  // of the way: sizes are known to 20 %, and tapes err little
  return std::abs(measured_m - run.to_end_m) > kKnown * run.way_m;
}

bool turned_otherwise(double measured, const Driven& run) {
  constexpr double kCounted = 0.25;  // turns: whoever counts them errs by whole or half ones
  return std::abs(measured - run.turns) > kCounted + (run.by_gyro ? 0.1 : 0.25) * std::abs(run.turns);
}

}  // namespace

std::vector<Finding> wrong_partial_reference(const Recording& recording, const Robot& robot,
                                             const AlignedReadings& readings) {
  std::vector<Finding> found;
  if (recording.partial.empty() || readings.increments.empty()) return found;
  const Driven run = driven(robot, readings);
  const auto add = [&](payload::Range values, const char* what) {
    found.push_back({.code = FindingCode::reference_unit,
                     .place = recording.name,
                     .subjects = {what},
                     .payload = values});
  };
  if (const auto end_m = measured_end_m(recording.partial); end_m && ends_elsewhere(*end_m, run))
    add({*end_m, run.to_end_m}, "m from start to end");
  if (const auto& turns = recording.partial.turns; turns && turned_otherwise(turns->value, run))
    add({turns->value, run.turns}, "turns counter-clockwise");
  return found;
}

}  // namespace trundle::inspection
