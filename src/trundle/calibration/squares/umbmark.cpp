#include "trundle/calibration/squares/umbmark.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Dense>
#include <fmt/format.h>

#include "trundle/calibration/squares/square_checks.hpp"

namespace trundle::calibration {
namespace {

constexpr std::array<std::string_view, 3> kMethodNames = {"classic", "orientation", "ml"};

/// ∂(a robot's diameters, then its track)/∂(left diameter, right diameter, track).
Eigen::MatrixXd wheels_from_sides(const Robot& robot) {
  const SidedDrive sides = sided_drive(robot);
  const auto wheels = robot.chassis.wheels();
  Eigen::MatrixXd map = Eigen::MatrixXd::Zero(robot.chassis.wheel_count + 1, 3);
  const auto [low, high] = std::ranges::minmax(wheels, {}, &Wheel::y_m);
  for (std::size_t i = 0; i < wheels.size(); ++i) {
    const bool left = wheels[i].y_m > 0.5 * (low.y_m + high.y_m);
    map(static_cast<Eigen::Index>(i), left ? 0 : 1) =
        wheels[i].diameter_m / (left ? sides.left_diameter_m : sides.right_diameter_m);
  }
  map(robot.chassis.wheel_count, 2) = 1.0;
  return map;
}

ParameterEstimate estimate_of(const Parameter& parameter, const CalibrationResult& result, double sigma) {
  return {.parameter = parameter,
          .name = name_of(parameter, result.nominal),
          .unit = std::string(unit_of(parameter)),
          .nominal = value_of(parameter, result.nominal),
          .value = value_of(parameter, result.calibrated),
          .sigma_within = sigma,
          .sigma_between = std::nullopt,
          .sigma_total = sigma,
          .sigma_data = sigma,
          .sigma_prior = prior_sigma(parameter, result.nominal),
          .observable = true};
}

ParameterEstimate held_mean(const SquareFit& fit, const SidedDrive& nominal) {
  return {.parameter = {ParameterKind::diameter, -1},
          .name = "mean_diameter",
          .unit = "m",
          .nominal = nominal.mean_diameter_m(),
          .value = nominal.mean_diameter_m(),
          .sigma_within = 0.0,
          .sigma_between = std::nullopt,
          .sigma_total = 0.0,
          .sigma_data = fit.mean_sigma_data_m,
          .sigma_prior = kDiameterPriorShare * nominal.mean_diameter_m(),
          .observable = false};
}

void add_parameters(const SquareFit& fit, CalibrationResult& result) {
  const Eigen::MatrixXd map = wheels_from_sides(result.nominal);
  result.covariance_within = map * fit.covariance * map.transpose();
  result.covariance_total = result.covariance_within;
  const auto sigma = [&](Eigen::Index i) { return std::sqrt(std::max(0.0, result.covariance_within(i, i))); };
  const int wheels = result.nominal.chassis.wheel_count;
  for (int i = 0; i < wheels; ++i)
    result.parameters.push_back(estimate_of({ParameterKind::diameter, i}, result, sigma(i)));
  result.parameters.push_back(estimate_of({ParameterKind::track, -1}, result, sigma(wheels)));
  if (fit.mean_held) result.parameters.push_back(held_mean(fit, sided_drive(result.nominal)));
}

/// The directions of (left, right, track) told wheel by wheel; the held mean has no part of its own.
void add_directions(const SquareFit& fit, CalibrationResult& result) {
  Eigen::MatrixXd map = wheels_from_sides(result.nominal).cwiseSign();
  for (Eigen::Index side = 0; side < 3; ++side) map.col(side).normalize();
  for (Eigen::Index i = 0; i < 3; ++i) {
    const Eigen::VectorXd direction = map * fit.directions.col(i);
    ObservableDirection told = {.singular_value = fit.singular_values[i],
                                .direction = {direction.begin(), direction.end()}};
    told.direction.resize(result.parameters.size(), 0.0);
    result.directions.push_back(std::move(told));
  }
}

std::string_view why_held(SquareMethod method, bool has_leg) {
  if (method == SquareMethod::classic)
    return has_leg ? "classic does not use leg_m: use orientation or ml"
                   : "classic takes it as nominal: measure leg_m and use orientation";
  return "closed squares cannot show it: measure a straight leg (leg_m), or add one straight run of known "
         "length";
}

void say_what_is_unknown(const SquareFit& fit, SquareMethod method, bool has_leg, CalibrationResult& result) {
  if (fit.mean_held)
    result.unobservable.push_back(fmt::format(
        "mean wheel diameter: held at nominal {:.6g} m (E_s = 1); {}. The other sigmas hold given that mean",
        sided_drive(result.nominal).mean_diameter_m(), why_held(method, has_leg)));
  result.unobservable.push_back("± covers one session; variation between sessions unknown");
}

/// The end points of one run before and after, for tables and pictures.
TrajectoryError end_error(const SquareRun& run, double side_m) {
  const double distance = std::hypot(run.error.x, run.error.y);
  return {.position_rms_m = distance,
          .position_max_m = distance,
          .heading_rms_rad = std::abs(run.error.heading),
          .end_x_m = run.error.x,
          .end_y_m = run.error.y,
          .end_heading_rad = run.error.heading,
          .path_m = 4.0 * side_m};
}

void add_runs(const SquareSheet& before, const SquareSheet& after, CalibrationResult& result) {
  for (std::size_t i = 0; i < before.runs.size(); ++i) {
    RunResult run;
    run.name = before.runs[i].name;
    run.session = before.name;
    run.turn = name_of(before.runs[i].turn);
    run.before = end_error(before.runs[i], before.side_m);
    run.after = end_error(after.runs[i], after.side_m);
    result.runs.push_back(std::move(run));
  }
  result.e_max_before_m = e_max(means_of(before));
  result.e_max_after_m = e_max(means_of(after));
  result.after_meaning = "predicted";
}

/// Squared Mahalanobis distance of each run's predicted remainder, over its three readings.
void add_chi2(const SquareStatistics& statistics, CalibrationResult& result) {
  const double runs = static_cast<double>(result.runs.size());
  const Matrix3 weight = statistics.weight.block<3, 3>(3, 3) * (2.0 / runs);
  for (RunResult& run : result.runs) {
    const double mirror = run.turn == "cw" ? -1.0 : 1.0;
    const Vector3 error(run.after->end_x_m, mirror * run.after->end_y_m, mirror * run.after->end_heading_rad);
    run.chi2_per_dof = error.dot(weight * error) / 3.0;
  }
}

std::string summary_of_squares(const CalibrationResult& result) {
  const SidedDrive before = sided_drive(result.nominal);
  const SidedDrive after = sided_drive(result.calibrated);
  const double ratio =
      (after.right_diameter_m / after.left_diameter_m) / (before.right_diameter_m / before.left_diameter_m);
  return fmt::format(
      "Track {:.5g} -> {:.5g} m, right wheels {:+.3f} % against left; E_max {:.4f} -> {:.4f} m ({})",
      before.track_m, after.track_m, 100.0 * (ratio - 1.0), *result.e_max_before_m, *result.e_max_after_m,
      result.after_meaning);
}

void fill_record(CalibrationResult& result) {
  CalibrationRecord record;
  for (const ParameterEstimate& estimate : result.parameters)
    if (estimate.observable)
      record.parameters.push_back({estimate.name, estimate.unit, estimate.value, estimate.nominal,
                                   estimate.sigma_within, estimate.sigma_between, estimate.observable});
  record.covariance = result.covariance_total;
  record.errors.push_back(
      {"E_max,syst (" + result.after_meaning + ")", *result.e_max_before_m, *result.e_max_after_m, "m"});
  record.provenance.push_back("method: " + result.method);
  for (const std::string& unknown : result.unobservable)
    record.provenance.push_back("cannot tell: " + unknown);
  result.calibrated.calibration = std::move(record);
}

}  // namespace

std::string_view name_of(SquareMethod method) {
  return kMethodNames[static_cast<std::size_t>(method)];
}

std::optional<SquareMethod> square_method_named(std::string_view name) {
  const auto found = std::ranges::find(kMethodNames, name);
  if (found == kMethodNames.end()) return std::nullopt;
  return static_cast<SquareMethod>(found - kMethodNames.begin());
}

double e_max(const SquareMeans& means) {
  return std::max(std::hypot(means.cw.x, means.cw.y), std::hypot(means.ccw.x, means.ccw.y));
}

SquareSheet predict_sheet(const SquareSheet& sheet, const SidedDrive& nominal, const SidedDrive& changed) {
  const SidedDrive truth = fit_square(statistics_of(sheet), sheet.side_m, nominal, SquareMethod::ml).drive;
  SquareSheet again = sheet;
  for (SquareRun& run : again.runs) {
    const Pose2 as_driven = predict_square(truth, nominal, sheet.side_m, run.turn);
    const Pose2 again_driven = predict_square(truth, changed, sheet.side_m, run.turn);
    run.error.x += again_driven.x - as_driven.x;
    run.error.y += again_driven.y - as_driven.y;
    run.error.heading += again_driven.heading - as_driven.heading;
  }
  return again;
}

void finish_square_result(CalibrationResult& result) {
  if (*result.e_max_after_m > *result.e_max_before_m)
    result.warnings.push_back(
        "the new parameters make E_max larger: the runs' positions and headings contradict each other; check "
        "their "
        "signs (measured minus odometry), or use the method ml, which weighs both");
  result.summary = summary_of_squares(result);
  fill_record(result);
}

CalibrationResult umbmark(const SquareSheet& sheet, const Robot& nominal, SquareMethod method) {
  const SidedDrive drive = sided_drive(nominal);
  const SquareStatistics statistics = statistics_of(sheet);
  refuse_wrapped(sheet);
  const SquareFit fit = fit_square(statistics, sheet.side_m, drive, method);
  refuse_scatter(sheet, fit, drive);

  CalibrationResult result;
  result.status = fit.mean_held ? CalibrationStatus::some_held : CalibrationStatus::all_estimated;
  result.method = name_of(method);
  result.nominal = nominal;
  result.calibrated = with_drive(nominal, fit.drive);
  result.sessions = 1;
  result.warnings = warnings_of(sheet, statistics, method);
  add_parameters(fit, result);
  add_directions(fit, result);
  add_runs(sheet, predict_sheet(sheet, drive, fit.drive), result);
  add_chi2(statistics, result);
  say_what_is_unknown(fit, method, statistics.means.leg_m.has_value(), result);
  finish_square_result(result);
  return result;
}

}  // namespace trundle::calibration
