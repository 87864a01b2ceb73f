// How an odometer learns the bias of its gyro: by rests, and until then by wheels that show the turn too.
// docs/theory/gyro.md, eq. 5; docs/theory/redundant-turn.md.

#include <algorithm>
#include <cmath>

#include "trundle/odometry/odometer.hpp"
#include "trundle/odometry/uncertain.hpp"

namespace trundle::odometry {
namespace {

/// Pose, bias, difference of turns, bias that wheels did not tell of: their covariance P, and their
/// sensitivity S to the uncertain parameters.
constexpr int kStates = 6;
constexpr int kBias = 3;
constexpr int kDifference = 4;
constexpr int kUntold = 5;
using StateVector = Eigen::Matrix<double, kStates, 1>;
using StateMatrix = Eigen::Matrix<double, kStates, kStates>;

struct Joint {
  StateMatrix P;
  Eigen::Matrix<double, kStates, Eigen::Dynamic, 0, kStates, kMaxParameters> S;
};

Joint joint_of(const OdometerState& state, const Eigen::MatrixXd& parameter_covariance) {
  Joint joint;
  auto& [P, S] = joint;
  P.topLeftCorner<3, 3>() = full_matrix(state.white);
  P.col(kBias).head<3>() = Eigen::Map<const Vector3>(state.bias.data());
  P.col(kDifference).head<3>() = Eigen::Map<const Vector3>(state.difference.with_pose.data());
  P(kBias, kBias) = state.bias_variance;
  P(kBias, kDifference) = state.difference.with_bias;
  P(kDifference, kDifference) = state.difference.variance;
  P.col(kUntold) << Eigen::Map<const Vector3>(state.untold.with_pose.data()), state.untold.with_bias,
      state.untold.with_difference, state.untold.variance;
  P.triangularView<Eigen::StrictlyLower>() = P.transpose();
  S.resize(kStates, parameter_covariance.rows());
  for (Eigen::Index j = 0; j < S.cols(); ++j) {
    const auto at = static_cast<std::size_t>(j);
    S.col(j) << Eigen::Map<const Vector3>(state.sensitivity[at].data()), state.bias_sensitivity[at],
        state.difference.sensitivity[at], 0.0;
  }
  return joint;
}

void take(const Joint& joint, const Eigen::MatrixXd& parameter_covariance, OdometerState& state) {
  const auto& [P, S] = joint;
  state.bias_parameter_variance =
      S.cols() > 0 ? (S.row(kBias) * parameter_covariance).dot(S.row(kBias)) : 0.0;
  state.white = symmetric_of(P.topLeftCorner<3, 3>());
  Eigen::Map<Vector3>(state.bias.data()) = P.col(kBias).head<3>();
  Eigen::Map<Vector3>(state.difference.with_pose.data()) = P.col(kDifference).head<3>();
  state.bias_variance = P(kBias, kBias);
  state.difference.with_bias = P(kBias, kDifference);
  state.difference.variance = P(kDifference, kDifference);
  Eigen::Map<Vector3>(state.untold.with_pose.data()) = P.col(kUntold).head<3>();
  state.untold.with_bias = P(kBias, kUntold);
  state.untold.with_difference = P(kDifference, kUntold);
  state.untold.variance = P(kUntold, kUntold);
  for (Eigen::Index j = 0; j < S.cols(); ++j) {
    const auto at = static_cast<std::size_t>(j);
    Eigen::Map<Vector3>(state.sensitivity[at].data()) = S.col(j).head<3>();
    state.bias_sensitivity[at] = S(kBias, j);
    state.difference.sensitivity[at] = S(kDifference, j);
  }
}

/// What was read of one of the states, beyond what was expected.
struct Reading {
  int of = kBias;
  double innovation = 0.0;
  double variance = 0.0;  ///< of the reading itself
};

struct Update {
  StateVector gain = StateVector::Zero();
  double innovation_variance = 0.0;
};

/// Kalman's update, with Schmidt's gain: the parameters stay as they are, and so does what wheels are not to
/// tell of the bias. docs/theory/redundant-turn.md, eq. 3.
Update update(Joint& joint, const Reading& reading, const Eigen::MatrixXd& parameter_covariance) {
  auto& [P, S] = joint;
  const Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxParameters, 1> s = S.row(reading.of).transpose();
  StateVector with_reading = P.col(reading.of);
  double variance = P(reading.of, reading.of) + reading.variance;
  if (s.size() > 0) {
    const decltype(s) Ss = parameter_covariance * s;
    with_reading += S * Ss;
    variance += s.dot(Ss);
  }
  if (variance <= 0.0) return {};
  StateVector K = with_reading / variance;
  K[kUntold] = 0.0;
  StateMatrix left = StateMatrix::Identity();
  left.col(reading.of) -= K;
  P = (left * P * left.transpose() + reading.variance * K * K.transpose()).eval();
  S = (left * S).eval();
  return {K, variance};
}

/// How far a bias that is off has turned the robot by now: ∂heading/∂b.
double turn_by_bias(const OdometerState& state) {
  return state.bias_variance > 0.0 ? state.bias[2] / state.bias_variance : 0.0;
}

/// A path that was bent is corrected to second order; the third is left, as a variance.
/// docs/theory/redundant-turn.md, eq. 5. `turn`: by the bias, before it was learned.
void shift(const StateVector& step, double turn, OdometerState& state) {
  const double bias = step[kBias];
  const auto& [bend_x, bend_y] = state.bend;
  state.pose = {state.pose.x + step[0] + 0.5 * bend_x * bias * bias,
                state.pose.y + step[1] + 0.5 * bend_y * bias * bias, state.pose.heading + step[2]};
  state.bias_rad_s += bias;
  state.difference.rad -= step[kDifference];
  const double third = turn * bias * bias * bias / 6.0;
  add_outer(state.white, third * third, {bend_x, bend_y, 0.0});
}

/// a bᵀ + b aᵀ + factor · b bᵀ
Symmetric3 outer(const Triple& a, const Triple& b, double factor) {
  const auto entry = [&](std::size_t i, std::size_t k) {
    return a[i] * b[k] + b[i] * a[k] + factor * b[i] * b[k];
  };
  return {entry(0, 0), entry(0, 1), entry(0, 2), entry(1, 1), entry(1, 2), entry(2, 2)};
}

}  // namespace

/// Of what the bias depends on through the wheels, if there is room for all of it.
void Odometer::begin_comparison(const Robot& robot, const std::vector<Parameter>& parameters) {
  UncertainParameters uncertain = with_usual_parameters(parameters, robot);
  if (uncertain.parameters.size() > kMaxParameters) return;
  turns_.emplace(robot, uncertain.parameters);
  uncertain_ = uncertain.parameters.size();
  uncertain_covariance_ = std::move(uncertain.covariance);
}

/// The bias is one more state b beside the pose, with ∂ξ/∂b as for the parameter: docs/theory/odometry.md,
/// eq. 8. `by_bias`: ∂pose/∂b of the step alone.
void Odometer::add_bias(const ArcStep& arc, const Triple& by_bias, double duration_s) {
  const double turn = turn_by_bias(state_) + 0.5 * by_bias[2];  // halfway
  state_.bend[0] -= arc.chord().x * turn * turn;
  state_.bend[1] -= arc.chord().y * turn * turn;
  const Triple carried = arc.carry(state_.bias);
  add(state_.white, outer(carried, by_bias, state_.bias_variance));
  state_.bias = carried;
  add_scaled(state_.bias, state_.bias_variance, by_bias);
  if (turns_ && !state_.rested) {
    state_.difference.with_pose = arc.carry(state_.difference.with_pose);
    add_scaled(state_.difference.with_pose, state_.difference.with_bias, by_bias);
    state_.untold.with_pose = arc.carry(state_.untold.with_pose);
    add_scaled(state_.untold.with_pose, state_.untold.with_bias, by_bias);
  }
  if (state_.bias_parameter_variance > 0.0)
    for (std::size_t j = 0; j < uncertain_; ++j)
      add_scaled(state_.sensitivity[j], state_.bias_sensitivity[j], by_bias);
  let_bias_walk(duration_s);
}

void Odometer::let_bias_walk(double duration_s) {
  const double walk = gyro_.bias_walk_rad_s_sqrt_s * gyro_.bias_walk_rad_s_sqrt_s * duration_s;
  state_.bias_variance += walk;
  state_.untold.variance += walk;
  state_.untold.with_bias += walk;
}

/// A rest reads the bias.
void Odometer::learn_bias(const GyroEvidence& evidence) {
  const double noise = gyro_.noise_rad_s_sqrt_hz * gyro_.noise_rad_s_sqrt_hz / evidence.duration_s;
  const Reading reading{.of = kBias,
                        .innovation = evidence.gyro_rad / evidence.duration_s - gyro_bias().rad_s,
                        .variance = noise};
  Joint joint = joint_of(state_, uncertain_covariance_);
  const auto [gain, innovation_variance] = update(joint, reading, uncertain_covariance_);
  if (innovation_variance <= 0.0) return;
  const double turn = turn_by_bias(state_);
  take(joint, uncertain_covariance_, state_);
  state_.rested = 1;
  shift(gain * reading.innovation, turn, state_);
  std::ranges::copy(gain.head<4>(), trace_.gain.begin());
  trace_.innovation = reading.innovation;
  trace_.innovation_variance = innovation_variance;
}

/// Until there was one, a turn that gyro and wheels both see tells of it, every second:
/// docs/theory/redundant-turn.md.
void Odometer::compare_turns(const MotionModel& model, const Increment& increment, const Rolled& rolled) {
  if (&model != &*with_gyro_ || state_.stuck.stuck != 0) return end_comparison();
  turns_->add(state_.compared, increment, rolled, state_.rolling.octave);
  if (!TurnComparison::is_due(state_.compared)) return;
  const TurnDifference found = turns_->take(state_.compared, state_.rolling.octave);
  expect(found);
  Joint joint = joint_of(state_, uncertain_covariance_);
  const Reading reading{
      .of = kDifference, .innovation = state_.difference.rad, .variance = found.rounding_variance};
  const auto [gain, innovation_variance] = update(joint, reading, uncertain_covariance_);
  if (reading.innovation * reading.innovation > gate_ * innovation_variance) return forget_wheels();
  const double turn = turn_by_bias(state_);
  take(joint, uncertain_covariance_, state_);
  state_.wheels_told = 1;
  shift(gain * reading.innovation, turn, state_);
}

/// The difference after one comparison more: the bias turns the gyro on, and parameters and noise both.
void Odometer::expect(const TurnDifference& found) {
  DifferenceState& difference = state_.difference;
  if (!difference.begun()) difference.variance = found.rounding_variance;
  const double by_bias = gyro_.scale * found.duration_s;
  difference.rad += found.rad;
  difference.variance +=
      by_bias * (2.0 * difference.with_bias + by_bias * state_.bias_variance) + found.variance;
  difference.with_bias += by_bias * state_.bias_variance;
  add_scaled(difference.with_pose, by_bias, state_.bias);
  state_.untold.with_difference += by_bias * state_.untold.with_bias;
  for (std::size_t j = 0; j < uncertain_; ++j)
    difference.sensitivity[j] += by_bias * state_.bias_sensitivity[j] - found.by_parameter[j];
}

/// Gyro and wheels are farther apart than all that is known of them allows: a wheel slips, or has slipped and
/// the bias was taken for it. So the bias is what the robot file says of it.
void Odometer::forget_wheels() {
  state_.bias_rad_s = 0.0;
  state_.bias_variance = state_.untold.with_bias = state_.untold.variance;
  state_.bias = state_.untold.with_pose;
  state_.bias_sensitivity = {};
  state_.bias_parameter_variance = 0.0;
  end_comparison();
}

/// The next one begins anew.
void Odometer::end_comparison() {
  state_.compared = {};
  state_.difference = {};
  state_.untold.with_difference = 0.0;
}

/// What the pose owes to parameters that are none of Options::parameters.
Symmetric3 Odometer::through_bias() const {
  const auto others = static_cast<Eigen::Index>(uncertain_ - parameters_);
  const Eigen::Map<const Eigen::Matrix3Xd> S(state_.sensitivity[parameters_].data(), 3, others);
  return symmetric_of(S * uncertain_covariance_.bottomRightCorner(others, others) * S.transpose());
}

}  // namespace trundle::odometry
