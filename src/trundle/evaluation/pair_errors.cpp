#include "trundle/evaluation/pair_errors.hpp"

#include <algorithm>
#include <cmath>

#include "trundle/geometry/decompositions.hpp"

namespace trundle::evaluation {

bool has_heading(const PosePair& pair) {
  return !std::isnan(pair.reference.heading);
}

double position_error(const PosePair& pair) {
  return (pair.estimate.translation() - pair.reference.translation()).norm();
}

double heading_error(const PosePair& pair) {
  return wrap_angle(pair.estimate.heading - pair.reference.heading);
}

int degrees_of_freedom(const std::vector<PosePair>& pairs) {
  return std::ranges::all_of(pairs, has_heading) ? 3 : 2;
}

std::vector<double> way_along(const std::vector<PosePair>& pairs, double shortest_step_m) {
  std::vector<double> way(pairs.size());
  Vector2 anchor = pairs.front().reference.translation();
  for (std::size_t i = 1; i < pairs.size(); ++i) {
    const double step = (pairs[i].reference.translation() - anchor).norm();
    way[i] = way[i - 1];
    if (step < shortest_step_m) continue;
    way[i] += step;
    anchor = pairs[i].reference.translation();
  }
  return way;
}

std::optional<double> normalised_error(const PosePair& pair, int dof) {
  Vector3 error;
  error.head<2>() = pair.estimate.translation() - pair.reference.translation();
  error.z() = dof == 3 ? heading_error(pair) : 0.0;
  const auto misfit = gaussian_misfit(error.head(dof), pair.covariance->topLeftCorner(dof, dof));
  if (!misfit) return std::nullopt;
  return misfit->squared_mahalanobis;
}

}  // namespace trundle::evaluation
