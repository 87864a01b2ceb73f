#include "trundle/pipeline/sound.hpp"

#include <cmath>

#include <fmt/format.h>

#include "trundle/calibration/preparation/initial_scale.hpp"
#include "trundle/io/error.hpp"

namespace trundle::pipeline {
namespace {

constexpr std::string_view kAdvice = "a reading, a noise or a start is out of all proportion";

/// Of a wheelbase: nobody measures it five times too long, or to the other side.
constexpr double kLeastShareOfPlace = 0.2;

template <class Covariance>
bool is_sound(const Covariance& covariance) {
  return covariance.allFinite() && covariance.diagonal().minCoeff() >= 0.0;
}

/// What a robot file cannot say is no robot: that is better told here, of the data, than by whoever reads the
/// file.
void require_writable(const Robot& calibrated) {
  try {
    (void)parse_robot(to_toml(calibrated), "calibrated");
  } catch (const InputError& fault) {
    const std::string_view words = fault.what();  // behind the line of a file that is not there
    throw CannotAnswer(
        fmt::format("the calibrated robot would be none: {}; check units, levers and clocks of "
                    "what it was learned from",
                    words.substr(words.find(": ") + 2)));
  }
}

}  // namespace

void require_sound(const Trajectory& trajectory, std::string_view what) {
  const auto& [poses, covariances] = trajectory;
  for (std::size_t i = 0; i < poses.size(); ++i)
    require_sound(poses[i], i < covariances.size() ? covariances[i] : Matrix3::Zero(), what);
}

void require_sound(const StampedPose& stamped, const Matrix3& covariance, std::string_view what) {
  const auto& [time_s, pose] = stamped;
  if (!std::isfinite(pose.x) || !std::isfinite(pose.y) || !std::isfinite(pose.heading))
    throw CannotAnswer(fmt::format("{}: the pose at {:.3f} s is no number; {}", what, time_s, kAdvice));
  if (!is_sound(covariance))
    throw CannotAnswer(
        fmt::format("{}: the covariance of the pose at {:.3f} s is none; {}", what, time_s, kAdvice));
}

void require_sound(const std::vector<MappedLandmark>& map, std::string_view what) {
  for (const MappedLandmark& landmark : map)
    if (!landmark.position.allFinite() || !is_sound(landmark.covariance))
      throw CannotAnswer(fmt::format("{}: landmark number {} of the map has no position or no covariance; {}",
                                     what, landmark.id + 1, kAdvice));
}

void require_sound(const CalibrationResult& calibration) {
  for (const ParameterEstimate& estimate : calibration.parameters) {
    if (!std::isfinite(estimate.value) || !std::isfinite(estimate.sigma_total) || estimate.sigma_total < 0.0)
      throw CannotAnswer(fmt::format("{} comes out as {} ± {} {}, which is no number; {}", estimate.name,
                                     estimate.value, estimate.sigma_total, estimate.unit, kAdvice));
    const double size = std::abs(estimate.value);
    if (estimate.parameter.kind == ParameterKind::diameter && estimate.value < 0.0)
      throw CannotAnswer(
          fmt::format("{} comes out as {:.4g} m: the wheel counts backwards; turn the sign of its "
                      "ticks_per_revolution, or its direction_deg",
                      estimate.name, estimate.value));
    if (estimate.parameter.kind == ParameterKind::diameter &&
        (size < kLeastDiameter_m || size > kGreatestDiameter_m))
      throw CannotAnswer(
          fmt::format("{} comes out as {:.4g} m, which no wheel has: check the reference's unit, "
                      "ticks_per_revolution, gears and diameters",
                      estimate.name, estimate.value));
    if (estimate.parameter.kind == ParameterKind::track && size < kLeastDiameter_m)
      throw CannotAnswer(
          fmt::format("track comes out as {:.2g} m, which no robot has: the wheels do not show "
                      "the turns; is each column that of its wheel?",
                      estimate.value));
    if (estimate.parameter.kind == ParameterKind::place_x &&
        estimate.value * estimate.nominal < kLeastShareOfPlace * estimate.nominal * estimate.nominal)
      throw CannotAnswer(
          fmt::format("{} comes out as {:.4g} m, where the robot file has {:.4g}: is a steering reversed "
                      "(the sign of its steering_scale), or in degrees?",
                      estimate.name, estimate.value, estimate.nominal));
    const bool is_scale = estimate.parameter.kind == ParameterKind::velocity_forward_scale ||
                          estimate.parameter.kind == ParameterKind::velocity_yaw_scale;
    if (is_scale && (size < kLeastVelocityScale || size > kGreatestVelocityScale))
      throw CannotAnswer(fmt::format("{} comes out as {:.4g}: check the units of velocity.csv", estimate.name,
                                     estimate.value));
  }
  require_writable(calibration.calibrated);
}

}  // namespace trundle::pipeline
