#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "trundle/chassis/robot.hpp"
#include "trundle/geometry/trajectory.hpp"
#include "trundle/recording/recording.hpp"
#include "trundle/recording/reference_noise.hpp"

namespace trundle::evaluation {

/// How the estimate is brought into the reference's frame before they are compared.
enum class Alignment {
  none,   ///< they share a frame already
  start,  ///< their first common poses are laid on each other, heading included
  se2,    ///< the rigid motion with the least sum of squared position errors
};

[[nodiscard]] std::string_view name_of(Alignment alignment);

struct EvaluateOptions {
  Alignment alignment = Alignment::start;
  double longest_gap_s = 0.5;  ///< the estimate is not interpolated across longer ones
  std::vector<double> distances_m = {1.0, 2.0, 5.0, 10.0};  ///< of the relative pose error
  double shortest_step_m =
      0.01;  ///< the reference's path is measured in steps of at least this: noise is no way
  double shortest_turn_rad = 0.02;  ///< by less, and by less than such a step, the robot has not moved yet
  ReferenceSigmas reference_noise = {};  ///< added to the covariances that errors are judged by
};

/// Of errors >= 0.
struct ErrorStatistics {
  double rms = 0.0;
  double mean = 0.0;
  double median = 0.0;
  double max = 0.0;
};

/// Error of the motion between two poses a distance apart along the reference's path, over all such pairs.
struct RelativePoseError {
  double distance_m = 0.0;
  std::size_t pairs = 0;  ///< 0: the path is too short; the numbers below mean nothing
  double translation_rms_m = 0.0;
  double translation_mean_percent = 0.0;  ///< of the way between the two poses
  double heading_rms_rad = 0.0;
};

/// Normalised estimation error squared eᵀ Σ⁻¹ e: do the covariances say how large the errors are?
/// Errors along one trajectory are correlated: the mean of a single run scatters far more than that of
/// independent ones.
struct Nees {
  int degrees_of_freedom =
      3;  ///< what a consistent estimate has as its mean; 2: the reference has no heading
  double mean = 0.0;
  double bound_95 = 0.0;         ///< the 95 % quantile of χ² with these degrees of freedom
  double share_inside_95 = 0.0;  ///< of poses below it; 0.95 if consistent
  std::size_t poses = 0;
  std::size_t before_motion = 0;  ///< compared poses left out with Alignment::start: nothing has happened yet
  std::size_t without_covariance = 0;  ///< compared poses left out: their covariance is not positive definite
};

/// An estimate against a reference, at the reference's stamps. docs/evaluation.md.
struct Evaluation {
  Alignment alignment = Alignment::none;
  Pose2 reference_from_estimate;  ///< the motion that was applied to the estimate
  std::size_t estimate_poses = 0;
  std::size_t reference_poses = 0;
  std::size_t compared = 0;
  double first_s = 0.0;  ///< stamp of the first pose compared
  double last_s = 0.0;
  double path_m = 0.0;                      ///< of the reference between them
  ErrorStatistics position_m;               ///< absolute trajectory error
  std::optional<double> heading_rms_rad;    ///< nothing: the reference has no heading
  double final_position_m = 0.0;            ///< error of the last pose compared
  std::optional<double> final_percent;      ///< the same in percent of path_m; nothing: no way was made
  std::optional<double> final_heading_rad;  ///< signed, estimate − reference
  std::vector<RelativePoseError>
      relative;                     ///< one for each distance; empty when the reference has no heading
  std::optional<Nees> nees;         ///< when the estimate has covariances
  ReferenceSigmas reference_noise;  ///< that the NEES counts; not stated: the reference is taken as exact

  [[nodiscard]] double overlap_s() const { return last_s - first_s; }
};

/// Compares the estimate, interpolated along its twist, at every stamp of the reference that it covers.
/// Headings of the reference that are NaN were not measured. With Alignment::start covariances are those of
/// the motion since the first common pose, for errors that come with the motion (odometry), and the NEES
/// begins where the estimate moves. Throws CannotAnswer when fewer than two stamps are covered, or the
/// alignment asks for what was not measured.
Evaluation evaluate(const Trajectory& estimate, const Trajectory& reference,
                    const EvaluateOptions& options = {});

/// The trajectory of the robot's reference sensor, on the reference's clock, from that of its body.
[[nodiscard]] Trajectory of_reference_sensor(const Trajectory& world_from_body, const Robot& robot);

/// The reference where at least x and y were measured; headings that were not are NaN.
[[nodiscard]] Trajectory positions_of(const ReferenceStream& reference);

/// One stamp with both poses, in their own frames.
struct PosePair {
  double time_s = 0.0;
  Pose2 estimate;
  Pose2 reference;
  std::optional<Matrix3> covariance;  ///< of the estimate's (x, y, heading) in its world axes
};

[[nodiscard]] std::vector<PosePair> common_poses(const Trajectory& estimate, const Trajectory& reference,
                                                 double longest_gap_s);

/// The rigid motion T that minimises Σ |p_reference − T p_estimate|²: rigid_motion. Throws CannotAnswer when
/// the positions do not show a rotation (all in one place).
[[nodiscard]] Pose2 align_se2(const std::vector<PosePair>& pairs);

}  // namespace trundle::evaluation
