#pragma once

#include <array>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "trundle/chassis/parameter.hpp"
#include "trundle/odometry/arc.hpp"
#include "trundle/odometry/motion_model.hpp"

namespace trundle {

inline constexpr int kMaxParameters = 32;
/// ∂(x, y, heading)/∂p in world axes, one column for each parameter.
using PoseSensitivity = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMaxParameters>;

/// All that changes while an Odometer steps: plain numbers, so its bytes can be stored and restored.
struct OdometerState {
  Pose2 pose;
  Symmetric3 white{};            ///< covariance of (x, y, heading) in world axes
  std::array<double, 3> bias{};  ///< its covariance with the gyro bias's walk
  double bias_variance = 0.0;    ///< [rad²/s²]
  double turn_rate_rad_s = 0.0;  ///< of the last step whose turn was measured
  std::array<std::array<double, 3>, kMaxParameters> sensitivity{};
};

/// Online odometry: pose, white-noise covariance, and how the pose depends on the chassis parameters.
/// One step takes bounded time and never allocates; a copy continues independently, and so does an odometer
/// of the same robot and options that is given the state's bytes.
/// Equations: docs/odometry.md.
class Odometer {
 public:
  struct Options {
    Pose2 start = {};
    Matrix3 start_covariance = Matrix3::Zero();  ///< of (x, y, heading) in world axes
    std::vector<Parameter> parameters = {};  ///< whose sensitivity is carried along; at most kMaxParameters
    bool with_covariance = true;
  };

  /// Throws CannotAnswer when the chassis cannot observe all three directions of motion, InputError beyond
  /// kMaxParameters.
  Odometer(const Robot& robot, const Options& options);

  /// Where an interval lacks the gyro, the wheels alone are used; if they cannot tell the turn, the last turn
  /// rate is kept, with σ = kUnmeasuredTurn · √duration.
  void step(const Increment& increment) { advance(increment); }
  /// An interval whose travel is known but whose course is not: adds the uncertainty of eq. 7.
  void step_across_gap(const Increment& increment);

  const Pose2& pose() const { return state_.pose; }
  /// White part in world axes: grows like √distance. Includes the walk of the gyro's bias.
  Matrix3 white_covariance() const { return full_matrix(state_.white); }
  /// ∂pose/∂p, columns as Options::parameters.
  PoseSensitivity sensitivity() const;

  const OdometerState& state() const { return state_; }
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
  void add_bias_walk(const ArcStep& arc, const std::array<double, 3>& by_bias, double duration_s);

  std::optional<MotionModel> with_gyro_;
  std::optional<MotionModel> without_gyro_;
  std::size_t parameters_ = 0;
  bool with_covariance_ = true;
  Gyro gyro_;
  OdometerState state_;
};

/// 1σ of an unmeasured turn [rad/√s].
inline constexpr double kUnmeasuredTurn = 0.5;

/// Throws CannotAnswer, in words, when the rows of the chassis do not see all three directions of motion.
void require_observable(const Robot& robot, bool with_gyro);

/// The second part of the covariance: J Σ_p Jᵀ.
Matrix3 parameter_covariance(const PoseSensitivity& sensitivity, const Eigen::MatrixXd& covariance);

}  // namespace trundle
