#pragma once

#include <array>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "trundle/chassis/parameter.hpp"
#include "trundle/odometry/arc.hpp"
#include "trundle/odometry/motion_model.hpp"
#include "trundle/odometry/rest.hpp"
#include "trundle/odometry/stuck.hpp"
#include "trundle/odometry/turn_comparison.hpp"

namespace trundle::odometry {

/// ∂(x, y, heading)/∂p in world axes, one column for each parameter.
using PoseSensitivity = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMaxParameters>;

/// The bias as it is known before the first rest, whatever wheels tell of it: one more state, to go back to
/// when they prove wrong. It is what the robot file says.
struct UntoldBias {
  double variance = 0.0;
  std::array<double, 3> with_pose{};  ///< its covariances
  double with_bias = 0.0;
  double with_difference = 0.0;
};

/// What gyro and wheels are apart by since their comparison began, as one more state beside pose and bias:
/// docs/theory/redundant-turn.md.
struct DifferenceState {
  bool begun() const { return variance > 0.0; }

  double rad = 0.0;                   ///< as read, less what is expected of it
  double variance = 0.0;              ///< of what is expected [rad²]
  std::array<double, 3> with_pose{};  ///< its covariances
  double with_bias = 0.0;
  std::array<double, kMaxParameters> sensitivity{};
};

/// Twist of an interval over its duration.
struct MeanRates {
  std::array<double, 3> per_s{};
  double duration_s = 0.0;  ///< 0: there was none
};

/// All that changes while an Odometer steps: plain numbers, so its bytes can be stored and restored.
struct OdometerState {
  Pose2 pose;
  Symmetric3 white{};  ///< covariance of (x, y, heading) in world axes, the last counts' rounding aside
  std::array<double, 3> bias{};          ///< its covariance with the gyro's bias
  double bias_rad_s = 0.0;               ///< what was learned of the bias, added to the robot file's
  double bias_variance = 0.0;            ///< [rad²/s²]; of noise alone
  UntoldBias untold;                     ///< of use until the robot rested
  double bias_parameter_variance = 0.0;  ///< of what is wrong with it because parameters are
  std::array<double, 2> bend{};          ///< ∂²(x, y)/∂bias²: the path that a bias bends is no line
  double turn_rate_rad_s = 0.0;          ///< of the last step whose turn was measured
  MeanRates rates;                       ///< of the last step; only with rates_change
  /// ∂(pose)/∂p of Options::parameters; after them, of what else the bias depends on, through it alone.
  std::array<std::array<double, 3>, kMaxParameters> sensitivity{};
  std::array<double, kMaxParameters> bias_sensitivity{};  ///< of what was learned of the bias
  DifferenceState difference;
  ComparedTurn compared;
  std::uint64_t wheels_told = 0;  ///< 1: wheels told something of the bias
  std::uint64_t rested = 0;       ///< 1: a rest did
  Rolling rolling;
  /// ∂(pose)/∂(rounding of each wheel's last count), in world axes [1/m]: docs/theory/odometry.md, eq. 10.
  WheelVectors by_rounding{};
  RestState rest;
  StuckState stuck;
};

/// How the last step made (pose, bias) of what was before: what smoothing backwards needs.
struct StepTrace {
  std::array<double, 2> displacement{};  ///< in world axes
  std::array<double, 3> by_bias{};       ///< ∂pose/∂bias over the step alone
  std::array<double, 4> gain{};          ///< Kalman's, of (pose, bias)
  double innovation = 0.0;               ///< [rad/s]
  double innovation_variance = 0.0;      ///< 0: the bias was not measured
};

/// What an interval was found to be.
struct Verdict {
  RestPhase phase = RestPhase::moving;
  bool gyro_disturbed = false;  ///< it turned faster than it can measure: it was not used
  std::uint64_t stuck = 0;  ///< one bit for each wheel that reads zero while the other sensors say it rolls

  [[nodiscard]] bool at_rest() const { return phase == RestPhase::resting; }
  [[nodiscard]] bool is_stuck(std::size_t wheel) const { return (stuck >> wheel & 1U) != 0; }
};

/// Online odometry: pose, white-noise covariance, and how the pose depends on the chassis parameters.
/// One step takes bounded time and never allocates; a copy continues independently, and so does an odometer
/// of the same robot and options that is given the state's bytes.
/// Equations: docs/theory/odometry.md.
class Odometer {
 public:
  struct Options {
    Pose2 start = {};
    Matrix3 start_covariance = Matrix3::Zero();  ///< of (x, y, heading) in world axes
    std::vector<Parameter> parameters = {};  ///< whose sensitivity is carried along; at most kMaxParameters
    bool with_covariance = true;
    /// Within an interval the rates change as from the one before to it, not in between: the path is no arc
    /// (docs/theory/calibration.md, eq. 1a). Needs the covariance.
    bool rates_change = false;
    /// Finds where the robot stands still, and learns the gyro's bias there. Needs the covariance, and that
    /// gyro.bias is not among `parameters`.
    bool learn_gyro_bias = false;
    /// Until the robot rests, learns it from how gyro and wheels turn, where both show it: as far as it is
    /// known how right the wheels are, by the calibration or else by prior_sigma().
    bool compare_turns = true;
    RestOptions rest = {};
  };

  /// Throws CannotAnswer when the chassis cannot observe all three directions of motion, InputError beyond
  /// kMaxParameters, or when the bias of the gyro is both learned and a parameter.
  Odometer(const Robot& robot, const Options& options);

  /// Where an interval lacks the gyro, the wheels alone are used; if they cannot determine the turn, the last
  /// turn rate is kept, with σ = kUnmeasuredTurn · √duration. With learn_gyro_bias the pose does not move
  /// while the robot may stand still: what the sensors read then is withheld until it is clear that it moved
  /// after all (RestOptions::block_s at most); what the wheels turned, until it is clear that it stands.
  Verdict step(const Increment& increment) {
    if (learns_) return judged_step(increment);
    advance(increment);
    return {};
  }
  /// An interval whose travel is known but whose course is not: adds the uncertainty of eq. 7; where wheels
  /// are steered and no gyro says how far it turned, of the turn too.
  void step_across_gap(const Increment& increment);

  /// The bias that the gyro is estimated to have now; without learn_gyro_bias the robot file's, and its walk.
  [[nodiscard]] GyroBias gyro_bias() const {
    return {gyro_.bias_rad_s + state_.bias_rad_s, state_.bias_variance + state_.bias_parameter_variance};
  }

  [[nodiscard]] const Pose2& pose() const { return state_.pose; }
  /// White part in world axes: grows like √distance. Includes what is not known of the gyro's bias and the
  /// rounding of the counts.
  [[nodiscard]] Matrix3 white_covariance() const { return full_matrix(white()); }
  [[nodiscard]] Symmetric3 white() const;
  /// The part of it that the rounding of the last counts makes, and that the next counts take back.
  [[nodiscard]] Symmetric3 rounding() const;
  /// A measurement of the pose: pose += step, its error e becomes keep · e + noise. With gain K, H =
  /// ∂z/∂pose: keep = I − K H, noise = K R Kᵀ. Sensitivities, which the measurement may have too, are given.
  void correct(const Vector3& step, const Matrix3& keep, const Matrix3& noise,
               const PoseSensitivity& sensitivity);
  /// From here on pose, covariances and sensitivities count from zero; what is known of the bias, of rests,
  /// of the speed and of the counts stays.
  void restart();
  /// ∂pose/∂p, columns as Options::parameters.
  [[nodiscard]] PoseSensitivity sensitivity() const;

  /// Of the last step; only with learn_gyro_bias.
  [[nodiscard]] const StepTrace& trace() const { return trace_; }

  [[nodiscard]] const OdometerState& state() const { return state_; }
  /// `state` must come from an odometer of the same robot and parameters.
  void resume(const OdometerState& state) { state_ = state; }

 private:
  /// The rows that serve an interval; none where the turn would be unmeasured.
  const MotionModel* model_for(const Increment& increment) const {
    if (with_gyro_ && increment.has_gyro) return &*with_gyro_;
    return without_gyro_ ? &*without_gyro_ : nullptr;
  }
  std::array<double, 3> advance(const Increment& increment);
  std::array<double, 3> advance_unmeasured(const Increment& increment);
  std::array<double, 3> advance_with_covariance(const MotionModel& model, const Increment& increment);
  void bend(const ArcStep& arc, const std::array<double, 3>& twist, double duration_s);
  void carry_rounding(const ArcStep& arc, const Increment& increment, const TwistStep& step);
  void let_bias_walk(double duration_s);
  void add_bias(const ArcStep& arc, const std::array<double, 3>& by_bias, double duration_s);
  void trace_arc(const ArcStep& arc, const std::array<double, 3>& by_bias);
  Verdict judged_step(const Increment& increment);
  void stand_still(const Increment& increment);
  std::array<double, 3> move_on(const Increment& increment);
  void learn_bias(const GyroEvidence& evidence);
  void begin_comparison(const Robot& robot, const std::vector<Parameter>& parameters);
  void compare_turns(const MotionModel& model, const Increment& increment, const Rolled& rolled);
  void expect(const TurnDifference& found);
  void forget_wheels();
  void end_comparison();
  Symmetric3 through_bias() const;

  std::optional<MotionModel> with_gyro_;
  std::optional<MotionModel> without_gyro_;
  RollingGauge gauge_;
  std::size_t wheels_ = 0;
  std::array<double, kMaxWheels> rounding_variance_{};  ///< of a count of each wheel [m²]
  std::size_t parameters_ = 0;
  std::size_t uncertain_ = 0;  ///< these, and the others that the bias depends on
  Eigen::MatrixXd uncertain_covariance_;
  bool with_covariance_ = true;
  bool rates_change_ = false;
  bool learns_ = false;
  bool steered_ = false;
  Gyro gyro_;
  std::optional<RestDetector> rest_;
  std::optional<StuckWheels> stuck_;
  std::optional<TurnComparison> turns_;
  double gate_ = 0.0;  ///< largest plausible innovation² over its variance
  StepTrace trace_;
  OdometerState state_;
};

/// 1σ of an unmeasured turn [rad/√s].
inline constexpr double kUnmeasuredTurn = kUnobservedTurn;

/// 1σ of the gyro's bias before the first rest [rad/s]: bias_sigma_rad_s, or ten times its spread between the
/// sessions of the calibration where that is more: a few sessions show too little of how far it drifts.
[[nodiscard]] double initial_bias_sigma(const Robot& robot);

/// Throws CannotAnswer, in words, when the rows of the chassis do not see all three directions of motion.
void require_observable(const Robot& robot, bool with_gyro);

/// The second part of the covariance: J Σ_p Jᵀ.
[[nodiscard]] Matrix3 parameter_covariance(const PoseSensitivity& sensitivity,
                                           const Eigen::MatrixXd& covariance);

}  // namespace trundle::odometry
