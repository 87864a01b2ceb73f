#include "example_result.hpp"

#include <cmath>
#include <random>

#include <Eigen/Dense>
#include <fmt/format.h>

namespace trundle::test {
using namespace report;
namespace {

struct Drive {
  double left_m, right_m, track_m;  ///< wheel diameters and track
};
constexpr Drive kNominal{0.0840, 0.0840, 0.2000};
constexpr Drive kTruth{0.08402, 0.08397, 0.20148};
constexpr Drive kEstimate{0.084023, 0.083974, 0.201455};

struct Revolutions {
  double left, right;
};

/// Wheel revolutions of a plan of (forward [m], turn [rad]) pieces, cut into steps, as nominal odometry
/// commands them.
std::vector<Revolutions> revolutions_of(const std::vector<Vector2>& plan, unsigned seed) {
  std::mt19937 generator(seed);
  std::vector<Revolutions> steps;
  const auto noise = [&] { return 4e-5 * (static_cast<double>(generator()) / 4294967296.0 - 0.5); };
  for (const Vector2& piece : plan) {
    const int count = 6 + static_cast<int>(std::abs(piece.x()) * 8.0);
    for (int i = 0; i < count; ++i) {
      const double left = piece.x() - piece.y() * kNominal.track_m / 2.0;
      const double right = piece.x() + piece.y() * kNominal.track_m / 2.0;
      steps.push_back({left / count / (kPi * kNominal.left_m) + noise(),
                       right / count / (kPi * kNominal.right_m) + noise()});
    }
  }
  return steps;
}

Trajectory driven(const std::vector<Revolutions>& steps, const Drive& drive) {
  Trajectory trajectory{{{0.0, {}}}, {}};
  for (const Revolutions& step : steps) {
    const double left = step.left * kPi * drive.left_m;
    const double right = step.right * kPi * drive.right_m;
    const StampedPose& last = trajectory.poses.back();
    trajectory.poses.push_back(
        {last.time_s + 0.25, last.pose * exp({(left + right) / 2.0, 0.0, (right - left) / drive.track_m})});
  }
  return trajectory;
}

TrajectoryError error_of(const Trajectory& estimate, const Trajectory& reference) {
  TrajectoryError error;
  double position_squares = 0.0;
  double heading_squares = 0.0;
  const std::size_t count = reference.poses.size();
  for (std::size_t i = 0; i < count; ++i) {
    const Pose2& a = estimate.poses[i].pose;
    const Pose2& b = reference.poses[i].pose;
    const double distance = (b.translation() - a.translation()).norm();
    position_squares += distance * distance;
    heading_squares += std::pow(b.heading - a.heading, 2);
    error.position_max_m = std::max(error.position_max_m, distance);
  }
  error.position_rms_m = std::sqrt(position_squares / static_cast<double>(count));
  error.heading_rms_rad = std::sqrt(heading_squares / static_cast<double>(count));
  const Pose2& end = reference.poses.back().pose;
  const Pose2& odometry_end = estimate.poses.back().pose;
  error.end_x_m = end.x - odometry_end.x;
  error.end_y_m = end.y - odometry_end.y;
  error.end_heading_rad = end.heading - odometry_end.heading;
  error.path_m = path_lengths(reference).back();
  return error;
}

/// The truth of one run differs a little from the robot's: carpet, tyres, temperature.
Drive truth_of_run(unsigned seed) {
  std::mt19937 generator(seed + 77);
  const auto spread = [&](double sigma) {
    return 1.0 + sigma * 3.4 * (static_cast<double>(generator()) / 4294967296.0 - 0.5);
  };
  return {kTruth.left_m * spread(1e-4), kTruth.right_m * spread(1e-4), kTruth.track_m * spread(6e-4)};
}

/// Laid on the ground a little askew, as a start pose measured by hand is.
Trajectory askew(Trajectory trajectory, unsigned seed) {
  std::mt19937 generator(seed + 300);
  const auto uniform = [&] { return static_cast<double>(generator()) / 4294967296.0 - 0.5; };
  const Pose2 start{0.004 * uniform(), 0.004 * uniform(), 0.004 * uniform()};
  for (StampedPose& stamped : trajectory.poses)
    stamped.pose = start * stamped.pose * Pose2{0.003 * uniform(), 0.003 * uniform(), 0.0};
  return trajectory;
}

RunResult run_of(const std::vector<Vector2>& plan, unsigned seed) {
  const std::vector<Revolutions> steps = revolutions_of(plan, seed);
  RunResult run;
  run.reference = askew(driven(steps, truth_of_run(seed)), seed);
  run.nominal = driven(steps, kNominal);
  run.calibrated = driven(steps, kEstimate);
  run.before = error_of(run.nominal, run.reference);
  run.after = error_of(run.calibrated, run.reference);
  run.chi2_per_dof = 0.6 + 0.09 * (seed * 7 % 11);
  run.nees = 2.4 + 0.2 * (seed * 5 % 7);
  run.nees_white_only = *run.nees * 3.1;
  return run;
}

RunResult square_run(int session, int index) {
  const double turn = index < 2 ? -kPi / 2.0 : kPi / 2.0;
  std::vector<Vector2> plan;
  for (int side = 0; side < 4; ++side) plan.insert(plan.end(), {Vector2(2.0, 0.0), Vector2(0.0, turn)});
  RunResult run = run_of(plan, static_cast<unsigned>(session * 10 + index));
  run.session = fmt::format("2024-05-{:02}", 6 + session);
  run.turn = turn < 0.0 ? "cw" : "ccw";
  run.name = fmt::format("{}/square_{}_{}", run.session, run.turn, index < 2 ? index + 1 : index - 1);
  return run;
}

RunResult winding_run() {
  std::vector<Vector2> plan;
  for (const double turn : {1.1, -1.9, 2.3, -0.6, 1.4, 1.7, -2.2, 0.9, 1.8, -1.2})
    plan.insert(plan.end(), {Vector2(0.9, turn), Vector2(0.7, -0.3 * turn)});
  RunResult run = run_of(plan, 90);
  run.name = "2024-05-21/free";
  run.session = "2024-05-21";
  run.hold_out = true;
  return run;
}

ParameterEstimate estimate(const Parameter& parameter, std::string name, double nominal, double value,
                           double sigma) {
  constexpr double kSessions = 3.0;
  const double between = 2.1 * sigma;
  ParameterEstimate e{.parameter = parameter,
                      .name = std::move(name),
                      .unit = "m",
                      .nominal = nominal,
                      .value = value,
                      .sigma_within = sigma,
                      .sigma_between = between,
                      .sigma_total = std::hypot(sigma, between * std::sqrt(1.0 + 1.0 / kSessions)),
                      .sigma_data = 1.1 * sigma,
                      .sigma_prior = 0.05 * nominal,
                      .observable = true};
  return e;
}

void fill_parameters(CalibrationResult& result) {
  result.parameters = {
      estimate({ParameterKind::diameter, 0}, "left.diameter", kNominal.left_m, kEstimate.left_m, 7e-6),
      estimate({ParameterKind::diameter, 1}, "right.diameter", kNominal.right_m, kEstimate.right_m, 7e-6),
      estimate({ParameterKind::track, -1}, "track", kNominal.track_m, kEstimate.track_m, 5.5e-5)};
  result.parameters[2].sigma_prior = 0.2 * kNominal.track_m;
  Eigen::Matrix3d correlation;
  correlation << 1.0, 0.82, 0.31, 0.82, 1.0, -0.24, 0.31, -0.24, 1.0;
  const Eigen::Vector3d sigma(7e-6, 7e-6, 5.5e-5);
  const Eigen::Matrix3d scale = sigma.asDiagonal();
  result.covariance_within = scale * correlation * scale;
  result.covariance_total =
      result.covariance_within + Eigen::MatrixXd((2.1 * sigma).cwiseAbs2().asDiagonal());
  result.directions = {
      {2400.0, {0.71, -0.70, 0.05}}, {610.0, {0.05, 0.02, 0.99}}, {95.0, {-0.70, -0.71, 0.04}}};
}

void name_robots(CalibrationResult& result) {
  result.nominal.name = "courier";
  result.nominal.chassis = differential_drive({kNominal.left_m, 4096.0, 0}, kNominal.track_m);
  result.nominal.wheel_names = {"left", "right"};
  result.calibrated = result.nominal;
}

void fill_e_max(CalibrationResult& result) {
  result.e_max_before_m = 0.0946;
  result.e_max_after_m = 0.0036;
  result.after_meaning = "reprocessed";
}

void mark_outlier(RunResult& run) {
  run.weight = 0.08;
  run.chi2_per_dof = 14.2;
  run.remark = "the reference jumps by 0.11 m at 23.4 s";
}

}  // namespace

CalibrationResult example_result() {
  CalibrationResult result;
  result.status = CalibrationStatus::all_estimated;
  result.method = "ml";
  result.summary = "All 3 parameters are estimated from 15 runs; load calibrated.toml on the robot.";
  result.sessions = 3;
  name_robots(result);
  fill_parameters(result);
  fill_e_max(result);
  for (int session = 0; session < result.sessions; ++session)
    for (int index = 0; index < 5; ++index) result.runs.push_back(square_run(session, index));
  mark_outlier(result.runs[7]);
  result.runs.push_back(winding_run());
  result.warnings = {
      "2024-05-07/square_ccw_1 disagrees with the other runs and counts only 8 %: the reference jumps by "
      "0.11 m at 23.4 s"};
  return result;
}

CalibrationResult example_with_held_parameter() {
  CalibrationResult result = example_result();
  result.status = CalibrationStatus::some_held;
  result.summary = "2 of 3 parameters are estimated; the mean wheel diameter is not.";
  ParameterEstimate& held = result.parameters[1];
  held.observable = false;
  held.value = held.nominal;
  held.sigma_within = 0.0;
  held.sigma_between.reset();
  held.sigma_total = 0.0;
  held.sigma_data = 0.031;
  result.covariance_within = result.covariance_within(std::vector<int>{0, 2}, std::vector<int>{0, 2}).eval();
  result.covariance_total = result.covariance_total(std::vector<int>{0, 2}, std::vector<int>{0, 2}).eval();
  result.directions.back().singular_value = 0.14;
  result.unobservable = {
      "Closed squares cannot show the wheel diameter: add one straight run of known length."};
  return result;
}

CalibrationResult example_of_one_session() {
  CalibrationResult result = example_result();
  result.sessions = 1;
  result.runs.resize(5);
  result.covariance_total = result.covariance_within;
  for (ParameterEstimate& parameter : result.parameters) {
    parameter.sigma_between.reset();
    parameter.sigma_total = parameter.sigma_within;
  }
  result.warnings = {"± covers one session; variation between sessions unknown"};
  return result;
}

}  // namespace trundle::test
