#include "trundle/slam/models/motion_sum.hpp"

#include <utility>

namespace trundle::slam {
namespace {

/// Twice the same reading of a bias that hardly moves in between.
BiasReading both(const std::optional<BiasReading>& before, const BiasReading& reading) {
  if (!before) return reading;
  const double variance = 1.0 / (1.0 / before->variance + 1.0 / reading.variance);
  return {variance * (before->rad_s / before->variance + reading.rad_s / reading.variance), variance};
}

/// Derivatives of a pose in world axes, as those of the body there.
template <class Matrix>
Matrix in_body(const Pose2& pose, Matrix by) {
  by.template topRows<2>() = rotation(pose.heading).transpose() * by.template topRows<2>();
  return by;
}

bool learns_bias(const SlamInputOptions& options, const SystematicErrors& systematic) {
  return systematic.has_bias && options.parameters.empty();
}

Odometer odometer_of(const Robot& robot, const SlamInputOptions& options,
                     const SystematicErrors& systematic) {
  return {robot,
          {.parameters = options.parameters.empty() ? systematic.parameters : options.parameters,
           .learn_gyro_bias = learns_bias(options, systematic),
           .compare_turns = false}};
}

double walk_of(const Robot& robot) {
  const double walk = robot.chassis.gyro->bias_walk_rad_s_sqrt_s;
  return walk * walk;
}

}  // namespace

MotionSum::MotionSum(const Robot& robot, const SlamInputOptions& options, const SystematicErrors& systematic)
    : learns_(learns_bias(options, systematic)),
      odometer_(odometer_of(robot, options, systematic)),
      systematic_(systematic),
      walk_(learns_ ? walk_of(robot) : 0.0),
      by_parameters_(Eigen::Matrix3Xd::Zero(3, static_cast<Eigen::Index>(options.parameters.size()))) {
  // A velocity may be what the robot was told to do, and then what it does otherwise is no error of a
  // reading.
  if (!options.parameters.empty() && robot.chassis.wheel_count > 0)
    reading_errors_.emplace(robot, options.parameters, Pose2{},
                            calibration::as_read(robot.chassis, options.reading_noise), options.with_scatter);
}

void MotionSum::add(const Increment& increment, bool bridged) {
  begin_interval();
  const GyroBias before = learned();
  Verdict verdict;
  if (bridged)
    odometer_.step_across_gap(increment);
  else
    verdict = odometer_.step(increment);
  if (verdict.at_rest()) rest_s_ += increment.duration_s;
  sum_ = sum_ * motion_of_interval(before, increment.duration_s);
  counted_ = counted_ || (any_turns(increment) && !verdict.at_rest());
  add_reading(before);
  if (by_parameters_.cols() == 0) return;
  const Pose2& end = odometer_.pose();
  by_parameters_ =
      adjoint(end.inverse()) * by_parameters_ + in_body(end, Eigen::Matrix3Xd(odometer_.sensitivity()));
  if (reading_errors_) reading_errors_->propagate(increment, sum_.mean);
}

/// The rounding of the last counts is that of this step; that of the counts before was told by the step
/// before.
Motion MotionSum::so_far() const {
  Motion motion = sum_;
  if (counted_) motion.covariance += body_covariance(odometer_.pose(), full_matrix(odometer_.rounding()));
  return motion;
}

void MotionSum::finish_step(double time_s, SlamInput& input) {
  input.steps.push_back({time_s, so_far(), {}, std::exchange(reading_, {})});
  if (reading_errors_) input.steps.back().motion.covariance += count_pending();
  const Pose2 end = std::exchange(sum_, {}).mean;
  counted_ = false;
  if (by_parameters_.cols() == 0) return;
  if (reading_errors_) input.reading_errors.push_back(reading_errors_->take(end));
  input.by_parameters.push_back(by_parameters_);
  by_parameters_.setZero();
}

/// Noise of ways that the odometer does not call travel yet: where a wheel hardly rolls from one sighting to
/// the next it would be as sure as one that stands.
Matrix3 MotionSum::count_pending() {
  OdometerState state = odometer_.state();
  const Matrix3 noise = reading_errors_->noise_of(state.rolling.pending);
  state.rolling.pending = {};
  odometer_.resume(state);
  return noise;
}

/// Each starts from a pose that is certain, with whatever else the odometer remembers.
void MotionSum::begin_interval() {
  odometer_.restart();
  if (learns_) return;
  OdometerState state = odometer_.state();
  state.bias_variance = 0.0;
  odometer_.resume(state);
}

/// Of the bias, less the robot file's.
GyroBias MotionSum::learned() const {
  return {odometer_.state().bias_rad_s, odometer_.state().bias_variance};
}

Motion MotionSum::motion_of_interval(const GyroBias& before, double duration_s) const {
  const Pose2 mean = odometer_.pose();
  Motion motion = motion_of(log(mean), body_covariance(mean, full_matrix(odometer_.state().white)));
  const BySystematic by_shares = motion.by_systematic;
  motion.by_systematic = BySystematic::Zero(3, systematic_.count());
  if (learns_) add_by_bias(before, duration_s, motion);
  auto open = motion.by_systematic.rightCols(systematic_.count() - systematic_.first_open());
  if (systematic_.has_shares)
    open = by_shares;
  else if (by_parameters_.cols() == 0)
    open = in_body(mean, Eigen::Matrix3Xd(odometer_.sensitivity())) * systematic_.by_component;
  return motion;
}

/// What was not known of the bias is no noise of the motion.
void MotionSum::add_by_bias(const GyroBias& before, double duration_s, Motion& motion) const {
  const Pose2 mean = odometer_.pose();
  const Vector3 by_bias = in_body(mean, Vector3(odometer_.trace().by_bias.data()));
  const Vector3 with_bias = in_body(mean, Vector3(odometer_.state().bias.data()));
  motion.by_systematic.col(0) = by_bias;
  motion.covariance -= before.variance * by_bias * by_bias.transpose();
  motion.with_walk = with_bias - before.variance * by_bias;
  motion.walk = walk_ * duration_s;
  motion.mean = mean * exp(Twist2::from(-before.rad_s * by_bias));
}

/// What the odometer took for a reading of the bias.
void MotionSum::add_reading(const GyroBias& before) {
  const StepTrace& trace = odometer_.trace();
  if (!learns_ || trace.innovation_variance <= 0.0) return;
  const double variance = trace.innovation_variance * (1.0 - trace.gain[3]);
  if (variance > 0.0) reading_ = both(reading_, {before.rad_s + trace.innovation, variance});
}

}  // namespace trundle::slam
