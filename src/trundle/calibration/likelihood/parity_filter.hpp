#pragma once

#include <optional>

#include <Eigen/Core>

#include "trundle/calibration/likelihood/chassis_likelihood.hpp"
#include "trundle/calibration/likelihood/errors_in_variables.hpp"
#include "trundle/calibration/likelihood/own_sensitivity.hpp"
#include "trundle/calibration/likelihood/parity_windows.hpp"
#include "trundle/calibration/likelihood/reference_measurement.hpp"

namespace trundle::calibration {

/// What no motion explains of a run's readings, summed over a window, is one more state beside the pose that
/// the same readings move: at the window's end it is measured to be zero, and till then each measurement of
/// the pose corrects it too. docs/theory/calibration-redundancy.md, eq. 7b.
class ParityFilter {
 public:
  /// All must outlive it. `robot`: contradicting_robot(). `weighing`: that of odometry. `own`: of the pose,
  /// and of the information beside the parameters.
  ParityFilter(const Run& run, const Robot& robot, const Chassis& weighing,
               std::span<const Parameter> parameters, const ChassisLikelihoodOptions& options,
               OwnSensitivity& own);

  /// Goes on to the next increment, which ends then and moves no pose.
  void skip(double time_s, Information& information);
  /// The same of one that moved the odometer from there, where it had rolled so: for the errors of its
  /// sensitivities too. Where a window ends, what it says is added, and moves the odometer.
  void propagate(const Increment& increment, const Pose2& from, const Rolling& rolling, Odometer& odometer,
                 SensitivityErrors& errors, Information& information);
  /// What was propagated up to `pose` counts before a measurement moves it.
  void end_arc(const Pose2& pose);
  /// An innovation of weight W corrects the pose to `pose`, keep = I − K H, and with it the parity
  /// residual. `errors`: before it does. Returns by how much the residual moves with the pose's error.
  Eigen::MatrixX3d correct(const ReferenceMeasurement& measurement, const ReferenceMeasurement::Weight& W,
                           const Matrix3& keep, const SensitivityErrors& errors, const Pose2& pose);
  /// From here on the pose owes nothing to readings.
  void restart() {
    parity_ = {};
    windows_.drop_common_error();
  }

 private:
  /// The open window's parity residual: its error, and what measurements of the pose made of it.
  struct Parity {
    CommonError with_pose;  ///< covariance with the pose (rows), world axes; empty: nothing moved the pose
    Eigen::VectorXd correction;
    Eigen::MatrixXd variance_reduction;
    Eigen::MatrixXd correction_by_parameters;
    Pose2 arc_start;
    double arc_s = 0.0;  ///< so long ago
  };

  void begin(const Pose2& pose);
  /// That of the next increment's window, where it ends at that time; with the own columns.
  std::optional<Contradiction> take(double time_s, const Rolling* before);
  void measure(const Contradiction& ended, double time_s, Odometer& odometer, SensitivityErrors& errors,
               Information& information);

  ParityWindows windows_;
  ChassisLikelihoodOptions options_;
  Eigen::Index parameters_;
  OwnSensitivity& own_;
  Parity parity_;
};

}  // namespace trundle::calibration
