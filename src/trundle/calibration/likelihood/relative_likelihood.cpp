#include "trundle/calibration/likelihood/relative_likelihood.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "trundle/odometry/odometer.hpp"
#include "trundle/recording/alignment/share_of.hpp"
#include "trundle/statistics/median.hpp"

namespace trundle::calibration {
namespace {

/// Steps through what was read between two times. False where the readings do not cover them.
bool step_between(const Run& run, double start_s, double end_s, std::size_t& from, Odometer& odometer) {
  const auto& increments = run.readings.increments;
  const double tolerance = 1e-9 * std::max(1.0, std::abs(end_s));
  while (from > 0 && increments.time_s(from - 1) > start_s + tolerance) --from;
  while (from < increments.size() && increments.time_s(from) <= start_s + tolerance) ++from;
  if (increments.empty() || start_s < run.readings.start_s - tolerance) return false;
  double time = start_s;
  for (std::size_t i = from; i < increments.size() && time < end_s - tolerance; ++i) {
    const double until = std::min(increments.time_s(i), end_s);
    odometer.step(share_of(increments[i], std::min(1.0, (until - time) / increments[i].duration_s)));
    time = until;
  }
  return time >= end_s - tolerance;
}

}  // namespace

RelativeResiduals relative_residuals(const Run& run, const Robot& robot,
                                     std::span<const Parameter> parameters) {
  RelativeResiduals result;
  const Pose2& mount = robot.body_from_reference;
  Odometer odometer(robot, {.parameters = {parameters.begin(), parameters.end()}});
  std::size_t from = 0;
  for (const RelativeMotion& measured : run.relative_motions) {
    odometer.restart();
    if (!step_between(run, measured.start_s + robot.reference_time_offset_s,
                      measured.end_s + robot.reference_time_offset_s, from, odometer))
      continue;
    const Pose2 body = odometer.pose();
    const Pose2 predicted = mount.inverse() * body * mount;
    // s = R(−ψ) (t + (R(θ) − 1) l): derivatives by the body's motion, by l and by ψ.
    const Matrix2 back = rotation(-mount.heading);
    const Matrix2 R = rotation(body.heading);
    const Vector2 turned = R * mount.translation();
    Matrix3 H = Matrix3::Identity();
    H.topLeftCorner<2, 2>() = back;
    H.topRightCorner<2, 1>() = back * Vector2(-turned.y(), turned.x());
    Eigen::Matrix<double, 3, Eigen::Dynamic> J = H * odometer.sensitivity();
    const Matrix2 by_lever = back * (R - Matrix2::Identity());
    for (std::size_t j = 0; j < parameters.size(); ++j) {
      const auto column = static_cast<Eigen::Index>(j);
      if (parameters[j].kind == ParameterKind::reference_x) J.col(column).head<2>() += by_lever.col(0);
      if (parameters[j].kind == ParameterKind::reference_y) J.col(column).head<2>() += by_lever.col(1);
      if (parameters[j].kind == ParameterKind::reference_heading)
        J.col(column).head<2>() += Vector2(predicted.y, -predicted.x);
    }
    result.residual.emplace_back(measured.motion.x - predicted.x, measured.motion.y - predicted.y,
                                 wrap_angle(measured.motion.heading - predicted.heading));
    result.jacobian.push_back(std::move(J));
    result.start_s.push_back(measured.start_s);
  }
  return result;
}

Matrix3 robust_covariance(const std::vector<Vector3>& residuals) {
  constexpr int kConcentrations = 20;  // steps; none makes the determinant larger
  // Of a 3-D Gaussian, the half nearest to the mean has this times the whole's covariance: P(χ²₅ < q)/P(χ²₃ <
  // q) at the median q = 2.366 of χ²₃.
  constexpr double kHalfCovariance = 0.40694;
  Vector3 spread;
  std::vector<double> distance(residuals.size());
  for (int c = 0; c < 3; ++c) {
    std::ranges::transform(residuals, distance.begin(), [c](const Vector3& r) { return std::abs(r[c]); });
    spread[c] = std::max(kSigmaOfMedian * median(distance), 1e-12);
  }
  Matrix3 covariance = spread.cwiseAbs2().asDiagonal();
  for (int step = 0; step < kConcentrations; ++step) {
    const Matrix3 W = covariance.inverse();
    std::ranges::transform(residuals, distance.begin(), [&W](const Vector3& r) { return r.dot(W * r); });
    std::vector<double> sorted = distance;
    const auto half = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::ranges::nth_element(sorted, half);
    Matrix3 sum = Matrix3::Zero();
    int count = 0;
    for (std::size_t i = 0; i < residuals.size(); ++i) {
      if (distance[i] > *half) continue;
      sum += residuals[i] * residuals[i].transpose();
      ++count;
    }
    covariance = sum / (count * kHalfCovariance) + Matrix3::Identity() * 1e-24;
  }
  return covariance;
}

}  // namespace trundle::calibration
