#pragma once

#include <cmath>
#include <vector>

#include <Eigen/Core>

#include "trundle/calibration/likelihood/errors_in_variables.hpp"
#include "trundle/calibration/likelihood/information.hpp"
#include "trundle/slam/models/motion.hpp"
#include "trundle/slam/models/observation.hpp"
#include "trundle/slam/nth.hpp"

namespace trundle::slam {

/// A motion that also has how it depends on parameters that are estimated with it, and on a bias b that
/// walks: truth = mean · exp(by_bias · b + by_parameters · p + e), e ~ N(0, covariance), b that at the start.
struct FreeMotion {
  Pose2 mean;
  Matrix3 covariance = Matrix3::Zero();  ///< as of Motion
  Eigen::Matrix3Xd by_parameters;        ///< one column for each parameter
  Vector3 by_bias = Vector3::Zero();     ///< 0 where there is none
  double walk = 0.0;                     ///< as of Motion
  Vector3 with_walk = Vector3::Zero();   ///< likewise
  /// Of the first by_parameters and of the covariance; of none: they are exact.
  calibration::ReadingErrors reading_errors = {};

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.mean, self.covariance, self.by_parameters, self.by_bias, self.walk, self.with_walk);
  }
};
FreeMotion operator*(const FreeMotion& first, const FreeMotion& second);

/// The odometry between two poses.
struct MotionLink {
  int from = kKnown;
  int to = 0;
  Pose2 start = {};         ///< of a link from a pose that is known
  double start_bias = 0.0;  ///< likewise
  Pose2 mean;
  /// Of (e, w): the motion's error, and what the bias walks by.
  Eigen::Matrix4d information = Eigen::Matrix4d::Identity();
  Eigen::Matrix3Xd by_parameters;
  Vector3 by_bias = Vector3::Zero();
  Vector3 included = Vector3::Zero();              ///< what of those effects the mean has already
  calibration::ReadingErrors reading_errors = {};  ///< as of FreeMotion

  static constexpr int kKnown = -1;

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.from, self.to, self.start, self.start_bias, self.mean, self.information, self.by_parameters,
            self.by_bias, self.included);
  }
};

/// The inverse of the motion's covariance with 1 µm and 1 µrad added: a robot that stands still is as sure as
/// that; and of the walk's with 1 nrad/s.
[[nodiscard]] MotionLink link_of(int from, int to, const FreeMotion& motion);
/// From a pose that is known, with a bias of which so much is known.
struct KnownStart {
  Pose2 pose = {};
  double bias = 0.0;
  double bias_variance = 0.0;
};
[[nodiscard]] MotionLink link_from(const KnownStart& start, int to, const FreeMotion& motion);

struct SightingLink {
  int pose = 0;
  int landmark = 0;
  Observation observation;
  int sensor = 0;  ///< of SmoothingProblem::sensors; always 0 where this is stored

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.pose, self.landmark, self.observation);
  }
};

/// One robot seen by another: the sensor's reading of a marker on the seen one, at the same instant.
struct RobotLink {
  int pose = 0;  ///< of the robot that sees
  int seen = 0;  ///< pose of the other
  Observation observation;
  int sensor = 0;                            ///< as of SightingLink
  Vector2 marker_on_seen = Vector2::Zero();  ///< [m], in the body frame of the seen one
  double marker_sigma_m = 0.0;               ///< 1σ along and across of where on the marker it is seen
};

/// Where a point of the robot is, seen from outside: in world axes.
struct PositionLink {
  int pose = 0;
  Vector2 position = Vector2::Zero();  ///< [m]
  Vector2 on_body = Vector2::Zero();   ///< [m], the point in the body frame
  double sigma_m = 0.0;                ///< of x and of y
};

/// A reading of the bias at a pose.
struct BiasLink {
  int pose = 0;
  double value = 0.0;
  double variance = 0.0;

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.pose, self.value, self.variance);
  }
};

/// What a sensor errs by beside what its robot file says: ranges by an offset [m] and a share, bearings by an
/// offset [rad], it stands elsewhere on the body by (x, y) [m], and its depth_share is larger.
using SensorErrors = Eigen::Matrix<double, 6, 1>;
/// By each of so many unknowns.
using SensorErrorsBy = Eigen::Matrix<double, 6, Eigen::Dynamic>;

/// All that is known of poses, landmarks and parameters. docs/theory/smoother.md, eq. 1-4.
struct SmoothingProblem {
  std::vector<LandmarkSensor> sensors;  ///< one for each robot
  int poses = 0;
  int landmarks = 0;
  std::vector<MotionLink> motions;
  std::vector<SightingLink> sightings;
  std::vector<RobotLink> robots_seen = {};
  std::vector<PositionLink> positions = {};
  int free_starts = 0;                    ///< tracks of which nobody knows where they start
  Eigen::VectorXd parameter_information;  ///< prior of each parameter, about its mean; 0: none
  Eigen::VectorXd parameter_mean = {};    ///< none: 0
  /// What else is known of the parameters, linearised at 0: −2 log p = χ² − 2 gradientᵀ p + pᵀ matrix p.
  Information parameter_evidence = Information::zero(0);
  bool has_bias = false;  ///< every pose has a bias beside it
  std::vector<BiasLink> bias_readings = {};
  double gate = 0.0;  ///< NIS beyond which a sighting has less weight than its square: an outlier
  /// By each parameter, what each sensor still errs by (SensorErrors); none: they err by nothing.
  std::vector<SensorErrorsBy> sensor_errors = {};
};

/// Values of the unknowns.
struct SmoothingState {
  std::vector<Pose2> poses;
  std::vector<Vector2> landmarks;
  Eigen::VectorXd parameters;
  std::vector<double> biases = {};  ///< at each pose; none: 0

  [[nodiscard]] double bias_at(int pose) const { return biases.empty() ? 0.0 : biases[nth(pose)]; }

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.poses, self.landmarks, self.parameters, self.biases);
  }
};

/// How what depends on a sensor's errors so depends on the parameters; no columns: sensors err by nothing.
[[nodiscard]] Eigen::Matrix2Xd through_errors_of(int sensor, const SmoothingProblem& problem,
                                                 const Eigen::Matrix<double, 2, 6>& by_sensor);

/// Where a link begins, by the state or as it is known.
[[nodiscard]] KnownStart start_of(const MotionLink& link, const SmoothingState& state);

/// (e, w): e = Log(mean⁻¹ a⁻¹ b) − S p − g β_a + included, w = β_b − β_a, and derivatives by moves a ·
/// exp(δ), b · exp(δ) with the bias of each; that of e by p is −S. Eq. 1, 5.
struct MotionResidual {
  Eigen::Vector4d error;
  Eigen::Matrix4d by_from;
  Eigen::Matrix4d by_to;
};
[[nodiscard]] MotionResidual motion_residual(const MotionLink& link, const SmoothingState& state);

/// Sensitivities and covariances of all motions become those of the motions that a state says, where they are
/// those of noisy readings. docs/theory/landmark-calibration.md, eq. 13d.
void correct_readings(const SmoothingState& state, SmoothingProblem& problem);

/// Reading minus expectation over its sigmas, and derivatives by a move pose · exp(δ), by the landmark and by
/// the sensor's errors. Eq. 2, 6; docs/theory/landmark-calibration.md, eq. 13a.
struct SightingResidual {
  Vector2 error;
  Matrix23 by_pose;
  Matrix2 by_landmark;
  Eigen::Matrix<double, 2, 6> by_sensor;
};
[[nodiscard]] SightingResidual sighting_residual(const LandmarkSensor& sensor, const Observation& observation,
                                                 const Pose2& pose, const Vector2& landmark,
                                                 const SensorErrors& errors = SensorErrors::Zero());
[[nodiscard]] SightingResidual sighting_residual(const SmoothingProblem& problem, const SightingLink& link,
                                                 const SmoothingState& state);

/// Reading of the other robot's marker minus expectation over its sigmas, and derivatives by moves of both
/// poses. docs/theory/together.md, eq. 25, 26.
struct RobotResidual {
  Vector2 error;
  Matrix23 by_pose;
  Matrix23 by_seen;
  Eigen::Matrix<double, 2, 6> by_sensor;
};
[[nodiscard]] RobotResidual robot_residual(const SmoothingProblem& problem, const RobotLink& link,
                                           const SmoothingState& state);

/// Position minus expectation over its sigma, and its derivative by a move of the pose.
/// docs/theory/landmark-reference.md, eq. 13g.
struct PositionResidual {
  Vector2 error;
  Matrix23 by_pose;
};
[[nodiscard]] PositionResidual position_residual(const PositionLink& link, const SmoothingState& state);

/// What a squared residual counts for: itself up to the gate, then its logarithm; and the derivative. Eq. 3.
[[nodiscard]] inline double robust_cost(double squared, double gate) {
  return squared <= gate ? squared : gate * (1.0 + std::log(squared / gate));
}
[[nodiscard]] inline double robust_weight(double squared, double gate) {
  return squared <= gate ? 1.0 : gate / squared;
}

/// To first order pose · exp(δ). Without the arc's bend poses at one place stay at one place, whatever each
/// turns: turns on the spot are links so stiff that the difference would forbid every step.
[[nodiscard]] inline Pose2 moved_by(const Vector3& delta, const Pose2& pose) {
  const Vector2 position = pose * Vector2(delta.head<2>());
  return {position.x(), position.y(), pose.heading + delta.z()};
}

/// Eq. 4.
[[nodiscard]] double cost_of(const SmoothingProblem& problem, const SmoothingState& state);

}  // namespace trundle::slam
