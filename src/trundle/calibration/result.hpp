#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "trundle/chassis/parameter.hpp"
#include "trundle/geometry/trajectory.hpp"
#include "trundle/odometry/rest.hpp"
#include "trundle/recording/time_offset.hpp"

namespace trundle::calibration {

/// One parameter after calibration.
struct ParameterEstimate {
  Parameter parameter;
  std::string name;
  std::string unit;
  double nominal = 0.0;
  double value = 0.0;                   ///< equal to nominal when not observable
  double sigma_within = 0.0;            ///< noise of the runs alone
  std::optional<double> sigma_between;  ///< spread from session to session; nothing: fewer than two sessions
  double sigma_total = 0.0;             ///< of a further session: the root of its entry in covariance_total
  double sigma_data = 0.0;              ///< what the data alone would give, before holding anything
  double sigma_prior = 0.0;             ///< how far from nominal it may plausibly be
  bool observable = false;
};

/// A direction in parameter space (scaled by prior sigmas) and how well the runs see it.
struct ObservableDirection {
  double singular_value =
      0.0;  ///< of the whitened Jacobian times prior sigmas; below 1: the prior knows more
  std::vector<double> direction;  ///< one entry for each free parameter, unit length
};

/// Errors of one recording's trajectory against its reference, start-aligned.
struct TrajectoryError {
  double position_rms_m = 0.0;
  double position_max_m = 0.0;
  double heading_rms_rad = 0.0;
  double end_x_m = 0.0;  ///< reference end minus odometry end, in the frame of the start pose
  double end_y_m = 0.0;
  double end_heading_rad = 0.0;
  double path_m = 0.0;
};

/// What became of one recording.
struct RunResult {
  std::string name;
  std::string session;
  bool hold_out = false;
  std::string turn;           ///< "cw", "ccw" or "": net turning of a closed run
  double weight = 1.0;        ///< 1: fully trusted; smaller: down-weighted as an outlier
  double chi2_per_dof = 0.0;  ///< of its residuals after calibration
  std::optional<TimeOffset> reference_clock =
      {};  ///< to which the reference's stamps were moved; nothing: they were not
  /// Of its gyro, where each run has one of its own.
  std::optional<GyroBias> gyro_bias = {};
  std::string remark;  ///< why it was down-weighted, where the reference jumps
  std::optional<TrajectoryError>
      before;                            ///< with the nominal robot; nothing without a trajectory or end pose
  std::optional<TrajectoryError> after;  ///< reprocessed: the same counts with the calibrated robot
  std::optional<double> nees;            ///< mean over the run, both parts of the covariance; 3 if consistent
  std::optional<double> nees_white_only;  ///< without the parameter part
  Trajectory nominal;                     ///< for pictures; thinned; empty when there is no reference
  Trajectory calibrated;
  Trajectory reference;
};

/// What was learned from some runs, judged by others: each run by what all others say of the parameters; of
/// one run, each half by the other. docs/theory/calibration-uncertainty.md.
struct CrossValidation {
  std::size_t parts = 0;      ///< runs, or halves, that were left out in turn
  bool of_halves = false;     ///< of one run
  double given_m = 0.0;       ///< position error with the robot as given, rms over the parts, se2-aligned
  double calibrated_m = 0.0;  ///< with what the other parts say
  /// How much smaller a step from what the others say back to the robot as given makes the errors, over what
  /// odometry's noise and the reference's do: standard normal where the parameters hold.
  double pull_sigma = 0.0;

  [[nodiscard]] bool is_worse() const;
  /// By more than chance: not all the parameters hold beyond the runs that they were learned from.
  [[nodiscard]] bool is_refuted() const;
  [[nodiscard]] std::string words() const;
};

/// A parameter that was not estimated, and what it would gain on runs from which it is not learned.
struct ParameterOffer {
  /// Of the test whether that is more than chance: once in a hundred calibrations or less.
  static constexpr double kLevel = 0.01;

  Parameter parameter;
  std::string name;
  double given = 0.0;          ///< what the robot file has
  double value = 0.0;          ///< what all runs say of it
  double sigma = 0.0;          ///< of that
  double gain = 0.0;           ///< of the log-likelihood of what was left out
  std::size_t parts = 0;       ///< runs, or halves, that were left out in turn
  bool of_halves = false;      ///< of one run
  int degrees_of_freedom = 0;  ///< behind the noise that the likelihood is weighed by

  /// The gain of what was left out and that of all, twice, against the limit of F with one degree of freedom
  /// and these: what was left out alone gains by chance where few parts say much of the other parameters.
  [[nodiscard]] bool is_significant() const;
  [[nodiscard]] std::string words() const;
};

enum class CalibrationStatus { nothing_estimated, some_held, all_estimated };

/// The result of `calibrate` and `umbmark`, with its evidence.
struct CalibrationResult {
  CalibrationStatus status = CalibrationStatus::nothing_estimated;
  std::string method;   ///< "classic", "orientation" or "ml"
  std::string summary;  ///< one sentence a person can act on
  Robot nominal;
  Robot calibrated;  ///< its CalibrationRecord is filled
  std::vector<ParameterEstimate> parameters;
  Eigen::MatrixXd covariance_within;  ///< of the observable parameters, in their order
  Eigen::MatrixXd covariance_total;   ///< with what is held and, where known, between sessions
  std::vector<ObservableDirection> directions;
  std::vector<std::string> unobservable;            ///< in words, with what to drive
  std::optional<CrossValidation> cross_validation;  ///< nothing: fewer than two parts have positions
  std::vector<ParameterOffer> offers;               ///< those that are significant
  std::vector<std::string> warnings;
  std::vector<std::string> notes;  ///< good to know, nothing to act on
  /// Those of the notes that say how a velocity's lag and clocks were set by the logs; nothing: they stay as
  /// given.
  std::optional<std::string> velocity_lag = {};
  std::optional<std::string> steering_clock;
  std::optional<std::string> gyro_clock;
  std::optional<std::string> reference_clocks;
  std::optional<std::string> sensor_clock;
  std::optional<std::string> gyro_biases;  ///< in which runs it is another one
  int sessions = 0;
  std::vector<RunResult> runs;
  /// What the estimate would be with other runs, an entry for each training run: values of `parameters`.
  /// Empty where the method has no such answer.
  std::vector<Eigen::VectorXd> without_run;      ///< without that run
  std::vector<Eigen::VectorXd> after_run;        ///< with that run and those before it alone
  std::vector<Eigen::VectorXd> sigma_after_run;  ///< of the latter
  /// E_max,syst [m] before and after, and what 'after' means: "predicted" or "reprocessed".
  std::optional<double> e_max_before_m;
  std::optional<double> e_max_after_m;
  std::string after_meaning;
};

}  // namespace trundle::calibration
