#include "trundle/slam/smoothing/sensor_score.hpp"

#include <cmath>

#include "trundle/geometry/decompositions.hpp"
#include "trundle/slam/smoothing/solver/minimise.hpp"

namespace trundle::slam {

// With A = ∂f/∂(range offset, bearing offset, depth share) of all sightings: U = Aᵀ W f,
// I = Aᵀ W A − (Jᵀ W A)ᵀ Λ⁻¹ (Jᵀ W A); the errors are −I⁻¹ U, with the covariance I⁻¹.
SensorScores sensor_scores(const SmoothingProblem& problem, const SmoothingState& state,
                           const Minimiser& linearised) {
  constexpr Eigen::Index kErrors[] = {0, 2, 5};  // of SensorErrors
  Vector3 score = Vector3::Zero();
  Matrix3 information = Matrix3::Zero();
  Vector3 squares = Vector3::Zero();
  Eigen::MatrixX3d by_unknowns = Eigen::MatrixX3d::Zero(linearised.unknowns(), 3);
  for (const SightingLink& link : problem.sightings) {
    const SightingResidual r = sighting_residual(problem, link, state);
    const double weight = robust_weight(r.error.squaredNorm(), problem.gate);
    const Matrix23 a = r.by_sensor(Eigen::all, kErrors);
    const Matrix23 W_a = weight * a;
    score += W_a.transpose() * r.error;
    information += W_a.transpose() * a;
    squares += a.colwise().squaredNorm().transpose();
    by_unknowns.middleRows<3>(linearised.row_of_pose(link.pose)) += r.by_pose.transpose() * W_a;
    by_unknowns.middleRows<2>(linearised.row_of_landmark(link.landmark)) += r.by_landmark.transpose() * W_a;
    if (problem.sensor_errors.empty()) continue;
    const Eigen::Matrix2Xd by_parameters = through_errors_of(link.sensor, problem, r.by_sensor);
    by_unknowns.middleRows(linearised.row_of_parameters(), by_parameters.cols()) +=
        by_parameters.transpose() * W_a;
  }
  SensorScores scores;
  for (Eigen::Index i = 0; i < 3; ++i)
    information.col(i) -= by_unknowns.transpose() * linearised.solve(by_unknowns.col(i));
  for (Eigen::Index i = 0; i < 3; ++i) {
    if (problem.sensor_errors.empty() || problem.sensor_errors.front().row(kErrors[i]).isZero(0.0)) continue;
    score[i] = 0.0;  // a parameter is it: there is nothing left to find
    information.row(i).setZero();
    information.col(i).setZero();
  }
  // No error is larger than 1 m, 1 rad, 1: what these readings cannot show stays finite.
  const Matrix3 covariance = inverse_of(0.5 * (information + information.transpose()) + Matrix3::Identity());
  const Vector3 errors = -covariance * score;
  for (const auto& [which, i] :
       {std::pair{&scores.range, 0}, std::pair{&scores.bearing, 1}, std::pair{&scores.depth, 2}}) {
    which->value = errors[i];
    which->sigma = std::sqrt(covariance(i, i));
    which->of_reading =
        std::abs(which->value) * std::sqrt(squares[i] / static_cast<double>(problem.sightings.size()));
  }
  return scores;
}

}  // namespace trundle::slam
