#pragma once

#include <optional>
#include <span>
#include <vector>

#include "trundle/calibration/likelihood/common_errors.hpp"
#include "trundle/calibration/likelihood/sensitivity_scatter.hpp"
#include "trundle/chassis/parameter.hpp"
#include "trundle/odometry/odometer.hpp"

namespace trundle::calibration {

/// How what was computed of noisy readings, beside a motion, errs with that motion's error e ~ N(0, Q). Where
/// e is most likely Q w, a sensitivity is most likely its computed value + C w, and Q, the variances of
/// readings being those of their true ways, Q + Σ w_i T_i. docs/theory/landmark-calibration.md, eq. 13d.
struct ReadingErrors {
  Eigen::Matrix3Xd sensitivity = Eigen::Matrix3Xd(3, 0);  ///< C of each parameter, side by side
  Eigen::Matrix3Xd covariance = Eigen::Matrix3Xd(3, 0);   ///< T_1, T_2, T_3; no columns: there are no errors
  Eigen::MatrixXd scatter = {};  ///< covariance of the sensitivities' errors, one parameter's below another's

  /// Those that go with map · e.
  [[nodiscard]] ReadingErrors mapped(const Matrix3& map) const;
};

/// Over so long a motion is one arc, and noise in it as if it came evenly.
inline constexpr double kLongestArc_s = 0.2 - 1e-9;

/// How an arc between two poses carries errors: of the pose where it began (F), of its twist (M). World axes.
struct ArcErrors {
  Matrix3 F;
  Matrix3 M;
};
[[nodiscard]] ArcErrors arc_errors(const Pose2& from, const Pose2& to);

/// Of a window's parity residual Pᵀz, a state beside the pose that the same readings move: covariances of the
/// errors of sensitivities to one parameter (first) with errors (second).
struct ParityErrors {
  Eigen::MatrixXd pose_parity;  ///< 3×m
  Eigen::MatrixXd parity_pose;  ///< m×3
  Eigen::MatrixXd parity_parity;
};

/// Errors in variables. How the pose depends on a parameter is computed from the readings that made the pose,
/// so both err together: where the reference says that a wheel rolled too far, its share in the sensitivity
/// is too large as well. Least squares that takes sensitivities for exact shrinks what they multiply; a track
/// comes out too large by the share of noise in the turns. Carried here is, for each parameter, the
/// covariance C of the errors of its sensitivity (rows) and of the pose (columns).
/// docs/theory/calibration.md, eq. 6a.
class SensitivityErrors {
 public:
  /// From `pose` on, which owes nothing to the readings. `as_read`: the robot's chassis with the noise of
  /// readings alone (reading_noise.hpp).
  /// `with_scatter`: also what they make of information, noise_in_information() and ReadingErrors::scatter.
  SensitivityErrors(const Robot& robot, std::span<const Parameter> parameters, const Pose2& pose,
                    const Chassis& as_read, bool with_scatter);

  /// An increment that brought the odometer to `pose`.
  void propagate(const Increment& increment, const Pose2& pose);
  /// What a measurement of the pose says of the sensitivities beyond their computed values: C Hᵀ S⁻¹ e, with
  /// its innovation e of covariance S.
  PoseSensitivity correction(const Vector3& weighed_innovation, const Pose2& pose);
  /// What the errors of so corrected sensitivities make of the information that a measurement of the pose
  /// has, of weight Hᵀ S⁻¹ H; nothing without scatter.
  [[nodiscard]] Eigen::MatrixXd noise_in_information(const Matrix3& weight) const;
  /// After the measurement, which moved the odometer to `pose`: keep = I − K H. The parity
  /// residual beside it moved by `parity_by_pose` times the error of the pose.
  void correct(const Matrix3& weight, const Matrix3& keep, const Pose2& pose,
               const Eigen::MatrixX3d& parity_by_pose = {});

  /// The next increment adds to a parity residual Pᵀz, which begins if there is none. Begun at `pose`.
  void add_to_parity(const Combinations& P, const Pose2& pose);
  /// Of each parameter.
  [[nodiscard]] const std::vector<ParityErrors>& of_parity() const { return parity_; }
  /// It ends at `pose`: what was propagated up to there counts.
  void end_parity(const Pose2& pose);
  /// As noise_in_information(), of a measurement of the parity residual.
  [[nodiscard]] Eigen::MatrixXd noise_in_parity(const Eigen::MatrixXd& weight) const;
  /// After a measurement of the parity residual that ended, of that weight, moved the pose by that gain.
  /// There is none any more.
  void correct_by_parity(const Eigen::MatrixXd& weight, const CommonError& gain, const Pose2& pose);
  void drop_parity();
  /// All of them up to `pose`, in body axes there, with the rounding of the last counts as MotionSum counts
  /// it; then all begins anew at (0, 0, 0).
  ReadingErrors take(const Pose2& pose);
  /// Covariance of a short motion, in body axes, by the noise of readings of such ways (as
  /// Increment::turned).
  [[nodiscard]] Matrix3 noise_of(const std::array<double, kMaxWheels>& turned) const;

 private:
  /// Per unit error of each reading [1/m; the gyro's 1/rad].
  using ByReading = TwistGain;

  void linearise(const Chassis& chassis, const Rows& rows, const Vector3& motion);
  void end_arc(const Pose2& pose);
  void propagate_third_moment(const Matrix3& F, const Matrix3& M, const RowVector& variance);
  void add_covariance(const Matrix3& M, const RowVector& variance);
  [[nodiscard]] std::vector<Eigen::MatrixXd> parity_by_reading(const RowVector& variance) const;
  void propagate_parity(const Matrix3& F, const Matrix3& M, const RowVector& variance,
                        const std::vector<Eigen::MatrixXd>& by_reading);
  void propagate_scatter(const Matrix3& F, const Matrix3& M, const RowVector& variance,
                         const std::vector<Eigen::MatrixXd>& parity_by_reading);
  [[nodiscard]] Eigen::MatrixXd covariance_with_pose() const;
  [[nodiscard]] Eigen::MatrixXd covariance_with_parity() const;
  void add_last_counts(const Pose2& pose);
  RowVector variance_of_rows(const Vector3& motion) const;
  RowVector of_sensors(RowVector variance) const;
  RowVector growth_of_variance() const;

  Chassis chassis_;  ///< as its rows are weighed
  Chassis as_read_;  ///< as its readings err, but for rounding
  std::vector<Parameter> parameters_;
  Chassis at_steering_;  ///< with its wheels at the angles of the present arc
  Rows rows_;            ///< of that
  ByReading gain_;       ///< G of ξ = G z, the error of the motion
  std::vector<ByReading>
      sensitivity_gain_;  ///< G ∂z/z − G (∂H G + E), that of its sensitivity to each parameter
  std::vector<RowMatrix> rows_by_twist_;       ///< ∂z/z H − ∂H − E H
  std::vector<Matrix3> covariance_;            ///< C in world axes
  std::vector<ParityErrors> parity_;           ///< empty: no parity residual is open
  Combinations P_;                             ///< of the present arc
  Eigen::Matrix<double, 3, 9> third_moment_;   ///< T in world axes
  std::optional<SensitivityScatter> scatter_;  ///< where it is wanted
  Pose2 arc_start_;                            ///< where the open arc began
  Increment travel_;                           ///< what rolled in it, without sign; its last steering
  Increment signed_travel_;                    ///< and with it
  int increments_ = 0;                         ///< in it
  bool has_gyro_ = true;                       ///< the gyro was there throughout
  bool has_counts_ = false;                    ///< counts fell since take()
};

}  // namespace trundle::calibration
