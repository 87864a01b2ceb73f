#include "trundle/calibration/validation/held_out.hpp"

#include <algorithm>
#include <span>
#include <vector>

#include "trundle/evaluation/evaluate.hpp"
#include "trundle/geometry/squared.hpp"
#include "trundle/io/error.hpp"
#include "trundle/odometry/integrate.hpp"

namespace trundle::calibration {
namespace {

using evaluation::PosePair;

/// The derivative of a rotated way by its angle.
Vector2 across(const Vector2& way) {
  return {-way.y(), way.x()};
}

/// Odometry at the reference's stamps, laid on it.
struct Laid {
  std::vector<PosePair> pairs;
  Pose2 reference_from_odometry;

  /// In the reference's axes.
  Vector2 error(std::size_t i) const {
    return reference_from_odometry * pairs[i].estimate.translation() - pairs[i].reference.translation();
  }
};

Laid laid(const Run& run, const Robot& robot, bool learn_gyro_bias) {
  Robot plain = robot;
  plain.calibration.reset();
  if (plain.chassis.gyro && !learn_gyro_bias) plain.chassis.gyro->bias_sigma_rad_s = 0.0;
  const std::vector<bool> compared = poses_about_reference(run, plain);
  IntegrateOptions options{.learn_gyro_bias = learn_gyro_bias};
  options.keeps = [&](std::size_t pose) { return compared[pose]; };
  const Trajectory odometry = integrate(run.readings, plain, options).trajectory;
  Laid result{evaluation::common_poses(evaluation::of_reference_sensor(odometry, plain),
                                       evaluation::positions_of(run.reference),
                                       evaluation::EvaluateOptions{}.longest_gap_s),
              {}};
  result.reference_from_odometry = evaluation::align_se2(result.pairs);
  return result;
}

/// Only the stamps that both have: the robots may differ in their clocks.
void keep_common(Laid& a, Laid& b) {
  const auto keep = [](std::vector<PosePair>& some, const std::vector<PosePair>& others) {
    std::erase_if(some, [&](const PosePair& pair) {
      return !std::ranges::binary_search(others, pair.time_s, {}, &PosePair::time_s);
    });
  };
  keep(a.pairs, b.pairs);
  keep(b.pairs, a.pairs);
}

/// What of a change of positions is not a motion of them all: only that is left once they are laid.
void take_out_rigid_motion(const Laid& at, std::vector<Vector2>& change) {
  Vector2 centre = Vector2::Zero(), mean = Vector2::Zero();
  const auto n = static_cast<double>(change.size());
  for (std::size_t i = 0; i < change.size(); ++i) {
    centre += at.pairs[i].reference.translation() / n;
    mean += change[i] / n;
  }
  double turned = 0.0, size = 0.0;
  const auto lever = [&](std::size_t i) -> Vector2 {
    return across(at.pairs[i].reference.translation() - centre);
  };
  for (std::size_t i = 0; i < change.size(); ++i) {
    turned += lever(i).dot(change[i]);
    size += lever(i).squaredNorm();
  }
  for (std::size_t i = 0; i < change.size(); ++i) change[i] -= mean + turned / size * lever(i);
}

/// Variance of Σ weightᵢ·eᵢ where e are odometry's position errors. They are a walk, eᵢ = Fᵢ eᵢ₋₁ + wᵢ, so
/// that it is Σ λᵢᵀ Qᵢ λᵢ with λᵢ = (weightᵢ, 0) + Fᵢ₊₁ᵀ λᵢ₊₁ and Qᵢ = Pᵢ − Fᵢ Pᵢ₋₁ Fᵢᵀ.
double variance_of_sum(const Laid& odometry, const std::vector<Vector2>& weights) {
  const Matrix2 odometry_from_reference = rotation(-odometry.reference_from_odometry.heading);
  double variance = 0.0;
  Vector3 later = Vector3::Zero();
  for (std::size_t i = weights.size(); i-- > 0;) {
    const PosePair& pair = odometry.pairs[i];
    later.head<2>() += odometry_from_reference * weights[i];
    variance += later.dot(*pair.covariance * later);
    if (i == 0) break;
    const Vector2 way = pair.estimate.translation() - odometry.pairs[i - 1].estimate.translation();
    later[2] += across(way).dot(later.head<2>());
    variance -= later.dot(*odometry.pairs[i - 1].covariance * later);
  }
  return variance;
}

}  // namespace

void HeldOutErrors::add(const HeldOutErrors& other) {
  given_m2 += other.given_m2;
  calibrated_m2 += other.calibrated_m2;
  pull_m2 += other.pull_m2;
  pull_variance_m4 += other.pull_variance_m4;
}

std::optional<HeldOutErrors> held_out_errors(const Run& run, const Robot& given, const Robot& calibrated,
                                             const ReferenceNoise& reference, bool learn_gyro_bias) {
  if (run.epochs.empty()) return std::nullopt;
  try {
    Laid before = laid(run, given, learn_gyro_bias);
    Laid after = laid(run, calibrated, learn_gyro_bias);
    keep_common(before, after);
    if (after.pairs.empty()) return std::nullopt;
    HeldOutErrors errors;
    std::vector<Vector2> change;
    const double reference_m = reference.position_m * reference.position_persistence;
    for (std::size_t i = 0; i < after.pairs.size(); ++i) {
      change.push_back(after.error(i) - before.error(i));
      errors.given_m2 += before.error(i).squaredNorm();
      errors.calibrated_m2 += after.error(i).squaredNorm();
    }
    take_out_rigid_motion(after, change);
    for (std::size_t i = 0; i < change.size(); ++i) {
      errors.pull_m2 += after.error(i).dot(change[i]);
      errors.pull_variance_m4 += squared(reference_m) * change[i].squaredNorm();
    }
    errors.pull_variance_m4 += variance_of_sum(after, change);
    const auto n = static_cast<double>(change.size());
    errors.given_m2 /= n;
    errors.calibrated_m2 /= n;
    errors.pull_m2 /= n;
    errors.pull_variance_m4 /= n * n;
    return errors;
  } catch (const CannotAnswer&) {
    return std::nullopt;
  }
}

}  // namespace trundle::calibration
