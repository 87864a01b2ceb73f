#include "trundle/evaluation/align.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "trundle/geometry/gaussian.hpp"
#include "trundle/geometry/rigid_motion.hpp"
#include "trundle/io/error.hpp"
#include "trundle/io/interruption.hpp"

namespace trundle::evaluation {
namespace {

/// The covariance at a time by linear interpolation between the neighbouring poses'.
Matrix3 covariance_at(const Trajectory& trajectory, double time_s) {
  const auto& poses = trajectory.poses;
  const auto after = std::lower_bound(poses.begin(), poses.end(), time_s,
                                      [](const StampedPose& p, double t) { return p.time_s < t; });
  const auto i = static_cast<std::size_t>(after - poses.begin());
  if (after->time_s == time_s) return trajectory.covariances[i];
  const double u = (time_s - poses[i - 1].time_s) / (after->time_s - poses[i - 1].time_s);
  return (1.0 - u) * trajectory.covariances[i - 1] + u * trajectory.covariances[i];
}

Pose2 align_start(const std::vector<PosePair>& pairs) {
  const PosePair& first = pairs.front();
  if (std::isnan(first.reference.heading))
    throw CannotAnswer(fmt::format(
        "the reference has no heading at its first common stamp {:.3f} s, so start poses cannot be "
        "laid on each other: align with se2 or none",
        first.time_s));
  return first.reference * first.estimate.inverse();
}

/// Adds the reference's own noise, at each stamp; with `from_start` also that of the first stamp, on which
/// the estimate was laid: an error (e, ε) of that pose moves the k-th by e + ε J (p_k − p_0) and turns it by
/// ε. docs/theory/evaluation.md (3).
void add_reference_noise(std::vector<PosePair>& pairs, const ReferenceSigmas& noise, bool from_start) {
  const Vector3 variances(noise.position_sigma_m * noise.position_sigma_m,
                          noise.position_sigma_m * noise.position_sigma_m,
                          noise.heading_sigma_rad * noise.heading_sigma_rad);
  const Matrix3 R = variances.asDiagonal();
  const Vector2 start = pairs.front().reference.translation();
  for (PosePair& pair : pairs) {
    if (!pair.covariance) continue;
    *pair.covariance += R;
    if (!from_start) continue;
    const Vector2 way = pair.reference.translation() - start;
    Matrix3 G = Matrix3::Identity();
    G(0, 2) = -way.y();
    G(1, 2) = way.x();
    *pair.covariance += G * R * G.transpose();
  }
}

std::string extent_of(const Trajectory& trajectory) {
  if (trajectory.poses.empty()) return "nothing";
  return fmt::format("{:.3f} to {:.3f} s", trajectory.poses.front().time_s, trajectory.poses.back().time_s);
}

}  // namespace

std::string_view name_of(Alignment alignment) {
  switch (alignment) {
    case Alignment::none:
      return "none";
    case Alignment::start:
      return "start";
    case Alignment::se2:
      return "se2";
  }
  return "";
}

std::vector<PosePair> common_poses(const Trajectory& estimate, const Trajectory& reference,
                                   double longest_gap_s) {
  std::vector<PosePair> pairs;
  for (const StampedPose& truth : reference.poses) {
    check_interruption();
    const auto pose = pose_at(estimate, truth.time_s, longest_gap_s);
    if (!pose) continue;
    pairs.push_back({truth.time_s, *pose, truth.pose, std::nullopt});
    if (estimate.has_covariance()) pairs.back().covariance = covariance_at(estimate, truth.time_s);
  }
  return pairs;
}

void demand_overlap(const std::vector<PosePair>& pairs, const Trajectory& estimate,
                    const Trajectory& reference, double longest_gap_s) {
  if (pairs.size() >= 2) return;
  throw CannotAnswer(
      fmt::format("the estimate (stamps {}) covers {} stamps of the reference (stamps {}) without a gap over "
                  "{} s; at least 2 "
                  "are needed: are both on the same clock?",
                  extent_of(estimate), pairs.size(), extent_of(reference), longest_gap_s));
}

Pose2 align_se2(const std::vector<PosePair>& pairs) {
  std::vector<PointPair> places;
  for (const PosePair& pair : pairs)
    places.push_back({pair.estimate.translation(), pair.reference.translation()});
  const std::optional<Pose2> motion = rigid_motion(places);
  if (!motion)
    throw CannotAnswer(
        "all common positions are in one place, which fixes no rotation: align with start or none");
  return *motion;
}

Pose2 alignment_of(const std::vector<PosePair>& pairs, Alignment alignment) {
  switch (alignment) {
    case Alignment::none:
      return {};
    case Alignment::start:
      return align_start(pairs);
    case Alignment::se2:
      return align_se2(pairs);
  }
  return {};
}

std::vector<PosePair> aligned(std::vector<PosePair> pairs, const Pose2& reference_from_estimate) {
  const Matrix3 R = world_from_body_axes(reference_from_estimate);
  for (PosePair& pair : pairs) {
    check_interruption();
    pair.estimate = reference_from_estimate * pair.estimate;
    if (pair.covariance) pair.covariance = R * *pair.covariance * R.transpose();
  }
  return pairs;
}

void start_covariances_from_zero(std::vector<PosePair>& pairs) {
  if (!pairs.front().covariance) return;
  const Pose2 start = pairs.front().estimate;
  const Matrix3 at_start = body_covariance(start, *pairs.front().covariance);
  for (PosePair& pair : pairs) {
    check_interruption();
    const Matrix3 Ad = adjoint((start.inverse() * pair.estimate).inverse());
    const Matrix3 since = body_covariance(pair.estimate, *pair.covariance) - Ad * at_start * Ad.transpose();
    pair.covariance = world_covariance({pair.estimate, since});
  }
}

std::vector<PosePair> judged(const std::vector<PosePair>& pairs, const Pose2& reference_from_estimate,
                             const EvaluateOptions& options) {
  std::vector<PosePair> result = aligned(pairs, reference_from_estimate);
  const bool from_start = options.alignment == Alignment::start;
  if (from_start) start_covariances_from_zero(result);
  if (options.reference_noise.stated()) add_reference_noise(result, options.reference_noise, from_start);
  return result;
}

std::size_t first_moved(const std::vector<PosePair>& pairs, const EvaluateOptions& options) {
  const Pose2& start = pairs.front().estimate;
  const auto moved = std::ranges::find_if(pairs, [&](const PosePair& pair) {
    return (pair.estimate.translation() - start.translation()).norm() >= options.shortest_step_m ||
           std::abs(wrap_angle(pair.estimate.heading - start.heading)) >= options.shortest_turn_rad;
  });
  return static_cast<std::size_t>(moved - pairs.begin());
}

}  // namespace trundle::evaluation
