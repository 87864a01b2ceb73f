#include "trundle/odometry/integrate.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "trundle/io/error.hpp"

namespace trundle {
namespace {

bool lacks_gyro(const Increment& increment) {
  return !increment.has_gyro;
}

std::size_t count_without_gyro(const AlignedReadings& readings) {
  return static_cast<std::size_t>(std::ranges::count_if(readings.increments, lacks_gyro));
}

void require_gyro_where_needed(const AlignedReadings& readings, const Robot& robot) {
  if (readings.increments.empty() || count_without_gyro(readings) < readings.increments.size()) return;
  require_observable(robot, false);
}

void report_missing_gyro(const AlignedReadings& readings, const Robot& robot,
                         std::vector<Problem>& problems) {
  const std::size_t missing = count_without_gyro(readings);
  if (!robot.chassis.gyro || missing == 0) return;
  const bool wheels_suffice = observability(rows_of(robot.chassis, false)).rank == 3;
  const double first = std::ranges::find_if(readings.increments, lacks_gyro)->time_s;
  problems.push_back(
      {.severity = wheels_suffice ? Severity::note : Severity::warning,
       .kind = "no gyro",
       .place = fmt::format("{:.3f} s", first),
       .count = missing,
       .message = wheels_suffice
                      ? fmt::format("{} intervals have no gyro samples; the wheels alone were used", missing)
                      : fmt::format("{} intervals have no gyro samples; the last turn rate was kept, "
                                    "with ±{:.1f} rad/√s",
                                    missing, kUnmeasuredTurn)});
}

void report_gaps(const AlignedReadings& readings, IntegratedOdometry& result) {
  result.bridged = static_cast<std::size_t>(std::ranges::count(readings.bridged, true));
  if (result.bridged == 0) return;
  const auto first = std::ranges::find(readings.bridged, true) - readings.bridged.begin();
  const Increment& gap = readings.increments[static_cast<std::size_t>(first)];
  result.problems.push_back(
      {.severity = Severity::warning,
       .kind = "bridged gap",
       .place = fmt::format("{:.3f} s", gap.time_s - gap.duration_s),
       .count = result.bridged,
       .message = fmt::format("{} gaps were bridged as one arc each; their unknown course was added to the "
                              "covariance",
                              result.bridged)});
}

Eigen::MatrixXd covariance_of(const Robot& robot, std::size_t parameters) {
  if (parameters == 0) return {};
  const Eigen::MatrixXd& covariance = robot.calibration->covariance;
  const auto n = static_cast<Eigen::Index>(parameters);
  if (covariance.rows() == n && covariance.cols() == n) return covariance;
  throw InputError(fmt::format("[calibration] of robot '{}'", robot.name),
                   fmt::format("covariance is {}×{}", covariance.rows(), covariance.cols()),
                   fmt::format("{}×{}, one row for each observable parameter", n, n));
}

void append(IntegratedOdometry& result, double time_s, const Odometer& odometer,
            const Eigen::MatrixXd& covariance, bool with_covariance) {
  result.trajectory.poses.push_back({time_s, odometer.pose()});
  if (!with_covariance) return;
  const Matrix3 white = odometer.white_covariance();
  result.white_covariances.push_back(white);
  result.trajectory.covariances.push_back(
      covariance.size() == 0 ? white : white + parameter_covariance(odometer.sensitivity(), covariance));
}

double length_of(const Trajectory& trajectory) {
  const std::vector<double> lengths = path_lengths(trajectory);
  return lengths.empty() ? 0.0 : lengths.back();
}

}  // namespace

std::vector<Parameter> calibrated_parameters(const Robot& robot) {
  std::vector<Parameter> parameters;
  if (!robot.calibration) return parameters;
  for (const CalibratedParameter& calibrated : robot.calibration->parameters) {
    if (!calibrated.observable) continue;
    const auto parameter = parameter_named(calibrated.name, robot);
    if (!parameter)
      throw InputError(fmt::format("[calibration] of robot '{}'", robot.name),
                       fmt::format("names '{}'", calibrated.name), "a parameter that this robot has");
    parameters.push_back(*parameter);
  }
  return parameters;
}

IntegratedOdometry integrate(const AlignedReadings& readings, const Robot& robot,
                             const IntegrateOptions& options) {
  require_gyro_where_needed(readings, robot);
  const std::vector<Parameter> parameters =
      options.with_covariance ? calibrated_parameters(robot) : std::vector<Parameter>{};
  const Eigen::MatrixXd covariance = covariance_of(robot, parameters.size());
  Odometer odometer(robot, {options.start, options.start_covariance, parameters, options.with_covariance});
  IntegratedOdometry result;
  result.problems = readings.problems;
  append(result, readings.start_s, odometer, covariance, options.with_covariance);
  for (std::size_t i = 0; i < readings.increments.size(); ++i) {
    if (i < readings.bridged.size() && readings.bridged[i])
      odometer.step_across_gap(readings.increments[i]);
    else
      odometer.step(readings.increments[i]);
    append(result, readings.increments[i].time_s, odometer, covariance, options.with_covariance);
  }
  report_gaps(readings, result);
  report_missing_gyro(readings, robot, result.problems);
  for (const Parameter& parameter : parameters) result.parameters.push_back(name_of(parameter, robot));
  result.end_sensitivity = odometer.sensitivity();
  if (!parameters.empty())
    result.end_parameter_covariance = parameter_covariance(result.end_sensitivity, covariance);
  result.path_length_m = length_of(result.trajectory);
  result.degrees_of_freedom = observability(rows_of(robot.chassis, true)).degrees_of_freedom;
  return result;
}

IntegratedOdometry integrate(const Recording& recording, const Robot& robot,
                             const IntegrateOptions& options) {
  return integrate(align(recording, robot), robot, options);
}

}  // namespace trundle
