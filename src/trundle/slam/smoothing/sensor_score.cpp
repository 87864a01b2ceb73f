#include "trundle/slam/smoothing/sensor_score.hpp"

#include <cmath>

namespace trundle::slam {

// With a = ∂f/∂(offset) of all sightings: U = aᵀ W f, I = aᵀ W a − (Jᵀ W a)ᵀ A⁻¹ (Jᵀ W a); offset = −U/I.
SensorScores sensor_scores(const SmoothingProblem& problem, const SmoothingState& state,
                           const Minimiser& linearised) {
  constexpr Eigen::Index kRange = 0, kBearing = 2;  // of SensorErrors
  const Vector2 sigma(problem.sensor.range_sigma_m, problem.sensor.bearing_sigma_rad);
  Vector2 score = Vector2::Zero();
  Vector2 information = Vector2::Zero();
  Eigen::MatrixX2d by_unknowns = Eigen::MatrixX2d::Zero(linearised.unknowns(), 2);
  for (const SightingLink& link : problem.sightings) {
    const SightingResidual r = sighting_residual(problem, link, state);
    const double weight = robust_weight(r.error.squaredNorm(), problem.gate);
    const Vector2 a(r.by_sensor(0, kRange), r.by_sensor(1, kBearing));
    score += weight * a.cwiseProduct(r.error);
    information += weight * a.cwiseAbs2();
    by_unknowns.middleRows<3>(linearised.row_of_pose(link.pose)) +=
        weight * r.by_pose.transpose() * a.asDiagonal();
    by_unknowns.middleRows<2>(linearised.row_of_landmark(link.landmark)) +=
        weight * r.by_landmark.transpose() * a.asDiagonal();
    if (problem.sensor_errors.cols() > 0)
      by_unknowns.middleRows(linearised.row_of_parameters(), problem.sensor_errors.cols()) +=
          weight * (r.by_sensor * problem.sensor_errors).transpose() * a.asDiagonal();
  }
  SensorScores scores;
  for (const auto& [which, i] : {std::pair{&scores.range, 0}, std::pair{&scores.bearing, 1}}) {
    const double left = information[i] - by_unknowns.col(i).dot(linearised.solve(by_unknowns.col(i)));
    if (!(left > 0.0)) continue;
    which->value = -score[i] / left;
    which->sigma = 1.0 / std::sqrt(left);
    which->of_reading = std::abs(which->value) / sigma[i];
  }
  return scores;
}

}  // namespace trundle::slam
