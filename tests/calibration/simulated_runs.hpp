#pragma once

#include <vector>

#include "trundle/calibration/problem/run.hpp"
#include "trundle/chassis/parameter.hpp"
#include "trundle/simulation/scenario.hpp"

namespace trundle::test {
using namespace calibration;

inline constexpr double kPositionSigma_m = 0.002;
inline constexpr double kHeadingSigma_rad = 0.005;

inline Robot robot_of(const Chassis& chassis, const std::vector<std::string>& names) {
  Robot robot;
  robot.name = "simulated";
  robot.chassis = chassis;
  robot.chassis.noise.wheel_per_sqrt_m = 0.003;
  robot.wheel_names = names;
  return robot;
}

inline Robot nominal_differential() {
  return robot_of(differential_drive({0.15, 20000.0, 0}, 0.40), {"left", "right"});
}

inline Robot true_differential() {
  Robot robot = nominal_differential();
  set_value({ParameterKind::diameter, 0}, 0.1508, robot);
  set_value({ParameterKind::diameter, 1}, 0.1489, robot);
  set_value({ParameterKind::track, -1}, 0.413, robot);
  return robot;
}

inline Robot nominal_omni3() {
  return robot_of(omni3({0.10, 20000.0, 0}, 0.2), {"a", "b", "c"});
}

inline Robot true_omni3() {
  Robot robot = nominal_omni3();
  const double direction[] = {0.01, -0.02, 0.015};
  const double lever[] = {0.004, -0.006, 0.003};
  const double diameter[] = {0.101, 0.0985, 0.1003};
  for (int i = 0; i < 3; ++i) {
    const Parameter turned{ParameterKind::direction, i};
    const Parameter arm{ParameterKind::lever, i};
    set_value({ParameterKind::diameter, i}, diameter[i], robot);
    set_value(turned, value_of(turned, robot) + direction[i], robot);
    set_value(arm, value_of(arm, robot) + lever[i], robot);
  }
  return robot;
}

inline std::vector<Path> differential_paths() {
  return {square(1.5, TurnSense::cw), square(1.5, TurnSense::ccw),
          trundle::simulation::joined({straight(3.0), turn_on_the_spot(kPi)}),
          circle(0.6, 1.5, TurnSense::cw)};
}

inline std::vector<Path> omni_paths() {
  std::vector<Path> paths = differential_paths();
  paths.push_back(l_run(1.5));
  paths.push_back(l_run(1.5, TurnSense::cw));
  return paths;
}

/// A run with a reference trajectory every second.
inline Scenario scenario_of(const Robot& nominal, const Robot& truth, const Path& path, std::uint64_t seed) {
  Scenario scenario;
  scenario.nominal = nominal;
  scenario.truth = truth;
  scenario.path = path;
  scenario.steering = Steering::truth;
  scenario.encoders = {.rate_hz = 4.0, .unit = WheelUnit::ticks};
  scenario.reference.rate_hz = 4.0;
  scenario.reference.position_sigma_m = kPositionSigma_m;
  scenario.reference.heading_sigma_rad = kHeadingSigma_rad;
  scenario.seed = seed;
  return scenario;
}

inline std::vector<Recording> recorded(const Robot& nominal, const Robot& truth,
                                       const std::vector<Path>& paths, std::uint64_t seed,
                                       double encoder_rate_hz = 4.0) {
  std::vector<Recording> recordings;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    Scenario scenario = scenario_of(nominal, truth, paths[i], seed * 100 + i);
    scenario.encoders.rate_hz = encoder_rate_hz;
    recordings.push_back(simulate(scenario).recording);
    recordings.back().name = "run " + std::to_string(i + 1);
    recordings.back().session = "one";
  }
  return recordings;
}

inline std::vector<Run> prepared(const Robot& nominal, const Robot& truth, const std::vector<Path>& paths,
                                 std::uint64_t seed) {
  std::vector<Run> runs;
  for (const Recording& recording : recorded(nominal, truth, paths, seed))
    runs.push_back(prepare_run(recording, nominal));
  return runs;
}

}  // namespace trundle::test
