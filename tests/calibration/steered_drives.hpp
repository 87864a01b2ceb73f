#pragma once

#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "trundle/calibration/problem/defaults.hpp"
#include "trundle/calibration/solve/estimator.hpp"
#include "trundle/simulation/scenario.hpp"

#include "chassis/robots.hpp"
#include "coverage/drive_oracle.hpp"

/// Drives of robots with steered wheels, their references, and what a series of calibrations from them shows.
namespace trundle::test {
using namespace calibration;
using simulation::Path, simulation::Segment, simulation::Scenario;

inline constexpr double kStep_s = 0.05;
inline constexpr double kSpeed_m_s = 0.8;
inline constexpr double kReferenceStep_s = 5.0 * kStep_s;
inline constexpr double kPosition_m = 0.002;  // 1σ of the reference
inline constexpr double kHeading_rad = 0.005;

/// Straight on, wide and tight curves both ways, back; some of it sideways.
inline Path rich_drive(double tightest_m, bool sideways = false) {
  Path path;
  const auto go = [&](double length_m, double curvature_1_m, double crab_rad = 0.0) {
    path.push_back({{length_m * std::cos(crab_rad), length_m * std::sin(crab_rad), length_m * curvature_1_m},
                    std::abs(length_m) / kSpeed_m_s});
  };
  for (const double sense : {1.0, -1.0}) {
    go(3.0, 0.0);
    go(6.0 * tightest_m, sense / tightest_m);
    go(3.0, sense / (3.0 * tightest_m));
    go(-2.0, 0.0);
    go(-3.0, -sense / (2.0 * tightest_m));
    if (!sideways) continue;
    go(2.0, 0.0, sense * 1.2);
    go(2.0, 0.5, sense * 0.6);
  }
  return path;
}

/// What the robot `truth` records on that drive, by the library's simulation.
inline Recording simulated_drive(const Robot& truth, const Path& drive, std::uint64_t seed) {
  Scenario scenario;
  scenario.nominal = scenario.truth = truth;
  scenario.path = drive;
  scenario.steering = simulation::Steering::truth;
  scenario.encoders = {.rate_hz = 1.0 / kStep_s, .unit = WheelUnit::radians};
  scenario.reference.rate_hz = 1.0 / kReferenceStep_s;
  scenario.reference.position_sigma_m = kPosition_m;
  scenario.reference.heading_sigma_rad = kHeading_rad;
  scenario.seed = seed;
  Recording recording = simulate(scenario).recording;
  recording.name = fmt::format("drive {}", seed);
  recording.session = "one";
  return recording;
}

/// The same by a simulation that shares no code with the library's.
inline Run blind_run(const Robot& nominal, const Robot& truth, const Path& path, std::uint64_t seed) {
  coverage::Drive drive;
  for (const Segment& segment : path)
    drive.pieces.push_back({segment.motion.vector() / segment.duration_s, segment.duration_s});
  drive.duration_s = coverage::length_of(drive.pieces);
  coverage::SimulatedDrive simulated(truth.chassis, drive, 1.0 / kStep_s, seed);
  coverage::Random random(~seed);
  Recording recording;
  recording.name = fmt::format("drive {}", seed);
  recording.session = "one";
  const auto measure = [&](double time_s) {
    ReferenceStream& reference = recording.reference;
    reference.time_s.push_back(time_s);
    reference.x_m.push_back(simulated.truth().x + kPosition_m * random.normal());
    reference.y_m.push_back(simulated.truth().y + kPosition_m * random.normal());
    reference.heading_rad.push_back(simulated.truth().heading + kHeading_rad * random.normal());
  };
  AlignedReadings readings;
  measure(0.0);
  for (int i = 1; !simulated.over(); ++i) {
    readings.increments.push_back(simulated.next());
    readings.bridged.push_back(false);
    if (i % 5 == 0) measure(i * kStep_s);
  }
  return prepare_run(recording, nominal, std::move(readings));
}

/// A reading of the steering is that of the interval before its stamp.
inline constexpr SteeringSensor kHalfAStepEarlier{.sigma_rad = 0.005, .time_offset_s = -0.5 * kStep_s};

/// "tricycle", "car", "sliding car" or "swerve".
inline Robot steered_robot(std::string_view kind) {
  Robot robot;
  if (kind == "tricycle") robot = robot_of(tricycle(kSize, 0.6, kHalfAStepEarlier));
  if (kind.ends_with("car")) robot = robot_of(ackermann(kSize, 0.4, 0.6, 0.0, kHalfAStepEarlier));
  if (kind == "swerve") robot = robot_of(swerve(kSize, 0.4, 0.6, kHalfAStepEarlier));
  for (Wheel& wheel : robot.chassis.wheels()) wheel.ticks_per_revolution = 0.0;
  robot.chassis.noise.wheel_per_sqrt_m = 0.003;
  if (kind == "sliding car") robot.chassis.noise = {.wheel_per_sqrt_m = 0.002, .lateral_per_sqrt_m = 0.006};
  return robot;
}

/// Each of its default parameters off by some of its prior.
inline Robot off(const Robot& nominal) {
  Robot truth = nominal;
  int sign = 1;
  for (const Parameter& parameter : default_parameters(nominal, {.length = true, .anything = true})) {
    const double share = parameter.kind == ParameterKind::place_x ? 0.1 : 0.3;
    const double moved = (sign = -sign) * share * prior_sigma(parameter, nominal);
    set_value(parameter, value_of(parameter, nominal) + moved, truth);
  }
  return truth;
}

/// Of many calibrations of a robot, each of two drives; parameter by parameter.
struct SteeredSeries {
  std::vector<std::string> names;
  Eigen::VectorXd held;     ///< share of the 95 % intervals that hold the truth
  Eigen::VectorXd mean;     ///< error over its stated σ, in the mean
  Eigen::VectorXd scatter;  ///< and its standard deviation
};

/// Both drives of calibration number i; `blind`: by the other simulation.
inline std::vector<Run> steered_runs(std::string_view kind, bool blind, int i) {
  const Robot nominal = steered_robot(kind), truth = off(nominal);
  std::vector<Run> runs;
  auto seed = 100 + 2 * static_cast<std::uint64_t>(i);
  for (const double tightest_m : {1.0, 0.7}) {
    const Path path = rich_drive(tightest_m, kind == "swerve");
    runs.push_back(blind ? blind_run(nominal, truth, path, seed)
                         : prepare_run(simulated_drive(truth, path, seed), nominal));
    ++seed;
  }
  return runs;
}

inline SteeredSeries steered_series(std::string_view kind, bool blind, int count) {
  const Robot nominal = steered_robot(kind), truth = off(nominal);
  SteeredSeries series;
  Eigen::VectorXd squares;
  for (int i = 0; i < count; ++i) {
    std::vector<Run> runs = steered_runs(kind, blind, i);
    const std::vector<Parameter> parameters = default_parameters(nominal, from_outside(runs));
    const Estimate estimate = estimate_parameters({runs, nominal, parameters});
    const auto n = static_cast<Eigen::Index>(parameters.size());
    if (i == 0) {
      for (const Parameter& parameter : parameters) series.names.push_back(name_of(parameter, nominal));
      series.held = series.mean = squares = Eigen::VectorXd::Zero(n);
    }
    for (Eigen::Index j = 0; j < n; ++j) {
      const Parameter& parameter = parameters[static_cast<std::size_t>(j)];
      const double error = (value_of(parameter, estimate.robot) - value_of(parameter, truth)) /
                           std::sqrt(estimate.covariance(j, j));
      series.held[j] += std::abs(error) <= 1.959964 ? 1.0 / count : 0.0;
      series.mean[j] += error / count;
      squares[j] += error * error / count;
    }
  }
  series.scatter = (squares - series.mean.cwiseAbs2()).cwiseSqrt();
  return series;
}

}  // namespace trundle::test
