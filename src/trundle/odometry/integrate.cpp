#include "trundle/odometry/integrate.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "trundle/chassis/contact.hpp"
#include "trundle/odometry/smooth.hpp"
#include "trundle/odometry/standing_gyro.hpp"
#include "trundle/odometry/uncertain.hpp"
#include "trundle/recording/alignment/replay.hpp"

namespace trundle::odometry {
namespace {

/// Intervals of a kind, and where the first of them is.
struct Occurrences {
  std::size_t count = 0;
  double first_s = 0.0;

  void add(double time_s) {
    if (count++ == 0) first_s = time_s;
  }
};

void report_missing_gyro(const Occurrences& missing, const Robot& robot, std::vector<Finding>& findings) {
  if (!robot.chassis.gyro || missing.count == 0) return;
  const bool wheels_suffice = observability(rows_of(robot.chassis, false)).rank == 3;
  findings.push_back({.severity = wheels_suffice ? Severity::note : Severity::warning,
                      .code = FindingCode::no_gyro,
                      .place = fmt::format("{:.3f} s", missing.first_s),
                      .count = missing.count,
                      .payload = wheels_suffice ? Payload() : payload::Amount{kUnmeasuredTurn}});
}

void report_gaps(const Occurrences& gaps, IntegratedOdometry& result) {
  result.bridged = gaps.count;
  if (gaps.count == 0) return;
  result.findings.push_back({.severity = Severity::warning,
                             .code = FindingCode::bridged_gap,
                             .place = fmt::format("{:.3f} s", gaps.first_s),
                             .count = gaps.count});
}

/// Intervals of which a step said something.
struct FaultCounts {
  std::array<Occurrences, kMaxWheels> stuck;
  Occurrences disturbed;

  void add(const Verdict& verdict, double time_s) {
    for (std::size_t wheel = 0; wheel < kMaxWheels; ++wheel)
      if (verdict.is_stuck(wheel)) stuck[wheel].add(time_s);
    if (verdict.gyro_disturbed) disturbed.add(time_s);
  }
};

void report(const FaultCounts& faults, const Robot& robot, std::vector<Finding>& findings) {
  const auto warn = [&](FindingCode code, const Occurrences& found, const std::vector<std::string>& wheels) {
    if (found.count > 0)
      findings.push_back(
          {Severity::warning, code, fmt::format("{:.3f} s", found.first_s), found.count, wheels});
  };
  for (std::size_t i = 0; i < robot.wheel_names.size(); ++i)
    warn(FindingCode::stuck_encoder, faults.stuck[i], {robot.wheel_names[i]});
  warn(FindingCode::gyro_disturbed, faults.disturbed, {});
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

/// Steps through the intervals as they come; with smoothing, what the filter knew after each is kept.
class Integration {
 public:
  Integration(const Robot& robot, const IntegrateOptions& options)
      : robot_(robot),
        uncertain_(options.with_covariance ? uncertain_parameters(robot, options.learn_gyro_bias)
                                           : UncertainParameters{}),
        odometer_(robot, {.start = options.start,
                          .start_covariance = options.start_covariance,
                          .parameters = uncertain_.parameters,
                          .with_covariance = options.with_covariance,
                          .learn_gyro_bias = options.learn_gyro_bias,
                          .compare_turns = !options.smooth}),
        options_(options),
        learns_bias_(options.learn_gyro_bias && options.with_covariance && robot.chassis.gyro.has_value()),
        smooths_(options.smooth && learns_bias_) {
    if (learns_bias_) standing_gyro_.emplace(robot.chassis, RestOptions{});
  }

  void reserve(std::size_t intervals) {
    if (options_.take || options_.keeps) return;
    result_.trajectory.poses.reserve(intervals + 1);
    if (options_.with_covariance) result_.trajectory.covariances.reserve(intervals + 1);
  }

  /// `bias_rad_s`: the gyro's, less the robot file's, about which motion is linearised.
  void start(double start_s, double bias_rad_s) {
    linearised_at_rad_s_ = bias_rad_s;
    OdometerState state = odometer_.state();
    state.bias_rad_s = bias_rad_s;
    odometer_.resume(state);
    keep(start_s);
  }

  void step(const Increment& recorded, bool bridged) {
    const Increment increment = options_.corrected ? options_.corrected(recorded) : recorded;
    ++intervals_;
    if (!increment.has_gyro) without_gyro_.add(increment.time_s);
    if (bridged) {
      gaps_.add(increment.time_s - increment.duration_s);
      odometer_.step_across_gap(increment);
    } else {
      const GyroBias bias = odometer_.gyro_bias();
      const Verdict verdict = odometer_.step(increment);
      faults_.add(verdict, increment.time_s);
      if (standing_gyro_) standing_gyro_->watch(increment, verdict.at_rest(), bias);
      result_.rest_s += verdict.at_rest() ? increment.duration_s : 0.0;
      if (learns_bias_) keep_bias(odometer_, increment.time_s, verdict.at_rest(), result_.gyro_bias);
    }
    keep(increment.time_s);
  }

  /// `findings`: of the readings. Throws CannotAnswer where they all lack the gyro that the robot needs.
  IntegratedOdometry finish(const std::vector<Finding>& findings) {
    if (intervals_ > 0 && without_gyro_.count == intervals_) require_observable(robot_, false);
    result_.findings = findings;
    report(faults_, robot_, result_.findings);
    if (standing_gyro_) report(standing_gyro_->found(), result_.findings);
    if (options_.with_covariance) result_.end_white_covariance = odometer_.white_covariance();
    if (smooths_) smooth_result();
    result_.end_gyro_bias = smooths_ ? filtered_.back().gyro_bias : odometer_.gyro_bias();
    result_.end_sensitivity = odometer_.sensitivity();
    report_gaps(gaps_, result_);
    report_missing_gyro(without_gyro_, robot_, result_.findings);
    for (const Parameter& parameter : uncertain_.parameters)
      result_.parameters.push_back(name_of(parameter, robot_));
    if (!uncertain_.parameters.empty())
      result_.end_parameter_covariance = parameter_covariance(result_.end_sensitivity, uncertain_.covariance);
    result_.degrees_of_freedom = observability(checking_rows(robot_.chassis, true)).degrees_of_freedom;
    return std::move(result_);
  }

  [[nodiscard]] bool smooths() const { return smooths_; }
  /// In place of finish(): what all rests together show of the bias at the start, less the robot file's.
  [[nodiscard]] double smoothed_start_bias() {
    smooth(filtered_, -linearised_at_rad_s_);
    return filtered_.front().gyro_bias.rad_s - robot_.chassis.gyro->bias_rad_s;
  }

 private:
  void keep(double time_s) {
    if (smooths_) return keep_for_smoothing(time_s);
    const StampedPose pose{time_s, odometer_.pose()};
    if (!options_.with_covariance) return give(pose, Matrix3::Zero(), way_to(pose.pose));
    keep_white(odometer_.white_covariance());
    // What is learned of the bias moves the pose, too: that is no way.
    const auto& [x_m, y_m] = odometer_.trace().displacement;
    give(pose, total_covariance(odometer_, uncertain_.covariance),
         learns_bias_ ? std::hypot(x_m, y_m) : way_to(pose.pose));
  }

  /// From the last pose that was given.
  double way_to(const Pose2& pose) const {
    return result_.poses == 0 ? 0.0 : std::hypot(pose.x - result_.end.pose.x, pose.y - result_.end.pose.y);
  }

  void keep_for_smoothing(double time_s) {
    stamps_.push_back(time_s);
    filtered_.push_back(filtered_step(odometer_));
    by_parameters_.push_back(uncertain_.covariance.size() == 0
                                 ? Matrix3(Matrix3::Zero())
                                 : parameter_covariance(odometer_.sensitivity(), uncertain_.covariance));
  }

  bool keeps_next() const { return !options_.keeps || options_.keeps(result_.poses); }

  /// Of the pose that is given next.
  void keep_white(const Matrix3& covariance) {
    if (options_.keep_white_covariances && keeps_next()) result_.white_covariances.push_back(covariance);
  }

  /// The next pose of the result, and the way to it.
  void give(const StampedPose& pose, const Matrix3& covariance, double way_m) {
    const bool kept = !options_.take && keeps_next();
    if (result_.poses++ == 0) result_.start_s = pose.time_s;
    result_.path_length_m += way_m;
    result_.end = pose;
    result_.end_covariance = covariance;
    if (options_.take) options_.take(pose, covariance);
    if (!kept) return;
    result_.trajectory.poses.push_back(pose);
    if (options_.with_covariance) result_.trajectory.covariances.push_back(covariance);
  }

  /// The part from the parameters stays: what a rest shows of the bias does not depend on them.
  void smooth_result() {
    smooth(filtered_, -linearised_at_rad_s_);
    for (std::size_t i = 0; i < filtered_.size(); ++i) {
      const Matrix3 white = full_matrix(filtered_[i].white);
      keep_white(white);
      give({stamps_[i], filtered_[i].pose}, white + by_parameters_[i], way_to(filtered_[i].pose));
    }
    result_.end_white_covariance = full_matrix(filtered_.back().white);
  }

  const Robot& robot_;
  UncertainParameters uncertain_;
  Odometer odometer_;
  IntegrateOptions options_;
  bool learns_bias_;
  bool smooths_;
  std::optional<StandingGyro> standing_gyro_;
  double linearised_at_rad_s_ = 0.0;  ///< the gyro's bias at the start, less the robot file's
  std::vector<double> stamps_;        ///< of the steps that are smoothed
  std::vector<FilteredStep> filtered_;
  std::vector<Matrix3> by_parameters_;  ///< covariances of the poses, of the parameters alone
  FaultCounts faults_;
  Occurrences gaps_;
  Occurrences without_gyro_;
  std::size_t intervals_ = 0;
  IntegratedOdometry result_;
};

/// `drive` takes an integration through all intervals from a start. What is smoothed is driven a second time,
/// with the bias that the first time has shown: a heading that was far off by then is no small change.
template <class Drive>
IntegratedOdometry integrate_by(const Drive& drive, const Robot& robot, const IntegrateOptions& options) {
  Integration integration(robot, options);
  double bias_rad_s = 0.0;
  if (integration.smooths()) {
    Integration first(robot, options);
    drive(first, bias_rad_s);
    bias_rad_s = first.smoothed_start_bias();
  }
  const std::vector<Finding> findings = drive(integration, bias_rad_s);
  return integration.finish(findings);
}

}  // namespace

IntegratedOdometry integrate(const AlignedReadings& readings, const Robot& robot,
                             const IntegrateOptions& options) {
  const auto drive = [&](Integration& integration, double bias_rad_s) {
    integration.reserve(readings.increments.size());
    integration.start(readings.start_s, bias_rad_s);
    for (std::size_t i = 0; i < readings.increments.size(); ++i)
      integration.step(readings.increments[i], i < readings.bridged.size() && readings.bridged[i]);
    return readings.findings;
  };
  return integrate_by(drive, robot, options);
}

IntegratedOdometry integrate(const Recording& recording, const Robot& robot,
                             const IntegrateOptions& options) {
  const auto drive = [&](Integration& integration, double bias_rad_s) {
    Replay replay(recording, robot);
    integration.reserve(replay.most_intervals());
    std::optional<AlignedInterval> interval = replay.next();
    integration.start(replay.start_s(), bias_rad_s);
    for (; interval; interval = replay.next()) integration.step(interval->increment, interval->bridged);
    return replay.findings();
  };
  return integrate_by(drive, robot, options);
}

}  // namespace trundle::odometry
