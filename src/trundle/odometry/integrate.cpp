#include "trundle/odometry/integrate.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/odometry/smooth.hpp"
#include "trundle/odometry/standing_gyro.hpp"
#include "trundle/odometry/uncertain.hpp"

namespace trundle::odometry {
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
                         std::vector<Finding>& findings) {
  const std::size_t missing = count_without_gyro(readings);
  if (!robot.chassis.gyro || missing == 0) return;
  const bool wheels_suffice = observability(rows_of(robot.chassis, false)).rank == 3;
  const double first = std::ranges::find_if(readings.increments, lacks_gyro)->time_s;
  findings.push_back({.severity = wheels_suffice ? Severity::note : Severity::warning,
                      .code = FindingCode::no_gyro,
                      .place = fmt::format("{:.3f} s", first),
                      .count = missing,
                      .payload = wheels_suffice ? Payload() : payload::Amount{kUnmeasuredTurn}});
}

void report_gaps(const AlignedReadings& readings, IntegratedOdometry& result) {
  result.bridged = static_cast<std::size_t>(std::ranges::count(readings.bridged, true));
  if (result.bridged == 0) return;
  const auto first = std::ranges::find(readings.bridged, true) - readings.bridged.begin();
  const Increment& gap = readings.increments[static_cast<std::size_t>(first)];
  result.findings.push_back({.severity = Severity::warning,
                             .code = FindingCode::bridged_gap,
                             .place = fmt::format("{:.3f} s", gap.time_s - gap.duration_s),
                             .count = result.bridged});
}

void append(IntegratedOdometry& result, double time_s, const Odometer& odometer,
            const Eigen::MatrixXd& covariance, bool with_covariance) {
  result.trajectory.poses.push_back({time_s, odometer.pose()});
  if (!with_covariance) return;
  result.white_covariances.push_back(odometer.white_covariance());
  result.trajectory.covariances.push_back(total_covariance(odometer, covariance));
}

/// Intervals of which a step said something, and where the first of them is.
struct FaultCounts {
  std::array<std::size_t, kMaxWheels> stuck{};
  std::array<double, kMaxWheels> stuck_s{};
  std::size_t disturbed = 0;
  double disturbed_s = 0.0;

  void add(const Verdict& verdict, const Increment& increment) {
    for (std::size_t wheel = 0; wheel < kMaxWheels; ++wheel)
      if (verdict.is_stuck(wheel) && stuck[wheel]++ == 0) stuck_s[wheel] = increment.time_s;
    if (verdict.gyro_disturbed && disturbed++ == 0) disturbed_s = increment.time_s;
  }
};

void report(const FaultCounts& faults, const Robot& robot, std::vector<Finding>& findings) {
  const auto warn = [&](FindingCode code, double time_s, std::size_t count,
                        const std::vector<std::string>& wheels) {
    if (count > 0)
      findings.push_back({Severity::warning, code, fmt::format("{:.3f} s", time_s), count, wheels});
  };
  for (std::size_t i = 0; i < robot.wheel_names.size(); ++i)
    warn(FindingCode::stuck_encoder, faults.stuck_s[i], faults.stuck[i], {robot.wheel_names[i]});
  warn(FindingCode::gyro_disturbed, faults.disturbed_s, faults.disturbed, {});
}

/// Whether it was a bias beyond its prior or a turn on wheels that did not roll is for a person to say.
void report(const std::vector<SteadyReading>& refused, std::vector<Finding>& findings) {
  for (const SteadyReading& reading : refused)
    findings.push_back({.code = FindingCode::gyro_beyond_its_bias,
                        .place = fmt::format("{:.3f} s", reading.start_s),
                        .payload = payload::SteadyRate{.duration_s = reading.duration_s,
                                                       .rate_rad_s = reading.rate_rad_s(),
                                                       .bias_rad_s = reading.bias.rad_s,
                                                       .sigma_rad_s = std::sqrt(reading.bias.variance)}});
}

/// Often enough for a picture.
constexpr double kBiasEvery_s = 1.0;

void keep_bias(const Odometer& odometer, double time_s, bool at_rest, std::vector<GyroBiasAt>& kept) {
  if (!kept.empty() && kept.back().at_rest == at_rest && time_s - kept.back().time_s < kBiasEvery_s) return;
  const GyroBias bias = odometer.gyro_bias();
  kept.push_back({time_s, bias.rad_s, std::sqrt(std::max(0.0, bias.variance)), at_rest});
}

/// Steps through all intervals; with smoothing, what the filter knew after each is kept.
class Integration {
 public:
  Integration(const Robot& robot, const UncertainParameters& uncertain, const IntegrateOptions& options)
      : odometer_(robot, {.start = options.start,
                          .start_covariance = options.start_covariance,
                          .parameters = uncertain.parameters,
                          .with_covariance = options.with_covariance,
                          .learn_gyro_bias = options.learn_gyro_bias}),
        covariance_(uncertain.covariance),
        options_(options),
        learns_bias_(options.learn_gyro_bias && options.with_covariance && robot.chassis.gyro.has_value()),
        smooths_(options.smooth && learns_bias_) {
    if (learns_bias_) standing_gyro_.emplace(robot.chassis, RestOptions{});
  }

  IntegratedOdometry over(const AlignedReadings& readings, const Robot& robot) {
    IntegratedOdometry result;
    result.findings = readings.findings;
    keep(readings.start_s, result);
    FaultCounts faults;
    for (std::size_t i = 0; i < readings.increments.size(); ++i) {
      const Increment& increment = readings.increments[i];
      if (i < readings.bridged.size() && readings.bridged[i]) {
        odometer_.step_across_gap(increment);
      } else {
        const GyroBias bias = odometer_.gyro_bias();
        const Verdict verdict = odometer_.step(increment);
        faults.add(verdict, increment);
        if (standing_gyro_) standing_gyro_->watch(increment, verdict.at_rest(), bias);
        result.rest_s += verdict.at_rest() ? increment.duration_s : 0.0;
        if (learns_bias_) keep_bias(odometer_, increment.time_s, verdict.at_rest(), result.gyro_bias);
      }
      keep(increment.time_s, result);
    }
    report(faults, robot, result.findings);
    if (standing_gyro_) report(standing_gyro_->found(), result.findings);
    if (smooths_) smooth_in(result);
    result.end_gyro_bias = odometer_.gyro_bias();
    result.end_sensitivity = odometer_.sensitivity();
    return result;
  }

 private:
  void keep(double time_s, IntegratedOdometry& result) {
    append(result, time_s, odometer_, covariance_, options_.with_covariance);
    if (!smooths_) return;
    filtered_.push_back(filtered_step(odometer_));
    by_parameters_.push_back(covariance_.size() == 0
                                 ? Matrix3(Matrix3::Zero())
                                 : parameter_covariance(odometer_.sensitivity(), covariance_));
  }

  /// The part from the parameters stays: what a rest shows of the bias does not depend on them.
  void smooth_in(IntegratedOdometry& result) {
    smooth(filtered_);
    for (std::size_t i = 0; i < filtered_.size(); ++i) {
      const Matrix3 white = full_matrix(filtered_[i].white);
      result.trajectory.poses[i].pose = filtered_[i].pose;
      result.trajectory.covariances[i] = white + by_parameters_[i];
      result.white_covariances[i] = white;
    }
  }

  Odometer odometer_;
  Eigen::MatrixXd covariance_;
  IntegrateOptions options_;
  bool learns_bias_;
  bool smooths_;
  std::optional<StandingGyro> standing_gyro_;
  std::vector<FilteredStep> filtered_;
  std::vector<Matrix3> by_parameters_;  ///< covariances of the poses, of the parameters alone
};

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
      throw InputError(place_of(robot), fmt::format("[calibration] names '{}'", calibrated.name),
                       "a parameter that this robot has");
    parameters.push_back(*parameter);
  }
  return parameters;
}

IntegratedOdometry integrate(const AlignedReadings& readings, const Robot& robot,
                             const IntegrateOptions& options) {
  require_gyro_where_needed(readings, robot);
  UncertainParameters uncertain;
  if (options.with_covariance) uncertain = uncertain_parameters(robot, options.learn_gyro_bias);
  IntegratedOdometry result = Integration(robot, uncertain, options).over(readings, robot);
  report_gaps(readings, result);
  report_missing_gyro(readings, robot, result.findings);
  for (const Parameter& parameter : uncertain.parameters)
    result.parameters.push_back(name_of(parameter, robot));
  if (!uncertain.parameters.empty())
    result.end_parameter_covariance = parameter_covariance(result.end_sensitivity, uncertain.covariance);
  result.path_length_m = length_of(result.trajectory);
  result.degrees_of_freedom = observability(rows_of(robot.chassis, true)).degrees_of_freedom;
  return result;
}

IntegratedOdometry integrate(const Recording& recording, const Robot& robot,
                             const IntegrateOptions& options) {
  return integrate(align(recording, robot), robot, options);
}

}  // namespace trundle::odometry
