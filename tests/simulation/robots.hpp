#pragma once

#include "trundle/simulation/scenario.hpp"

namespace trundle::test {
using namespace simulation;

/// A differential robot without noise, D = 0.15 m, b = 0.50 m: that of the check values in
/// docs/theory/umbmark.md.
inline Robot quiet_differential(double left_m = 0.15, double right_m = 0.15, double track_m = 0.50) {
  Robot robot;
  robot.name = "differential";
  robot.wheel_names = {"left", "right"};
  robot.chassis = differential_drive({.diameter_m = 0.15, .ticks_per_revolution = 2000.0}, track_m);
  robot.chassis.wheels()[0].diameter_m = left_m;
  robot.chassis.wheels()[1].diameter_m = right_m;
  robot.chassis.noise = {0.0, 0.0, 0.0, 0.0, 0.0};
  return robot;
}

/// Exact counts, no noise, no reference.
inline Scenario exact_scenario(const Robot& nominal, const Robot& truth, const Path& path) {
  Scenario scenario;
  scenario.nominal = nominal;
  scenario.truth = truth;
  scenario.path = path;
  scenario.encoders.quantised = false;
  return scenario;
}

}  // namespace trundle::test
