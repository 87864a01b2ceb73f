#include "trundle/slam/localization/pair_prediction.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

namespace trundle::slam {

std::optional<PairPrediction> prediction_of(const SightedPair& pair, const LocalMap& seen,
                                            const KnownMap& map, const MapSightOptions& options) {
  const auto points = seen.points();
  const Matrix2 of_map = map.largest_variance() * Matrix2::Identity();
  const auto as_seen = [&](std::size_t i) {
    return PointMatch{points[i].in_body, points[i].covariance, points[i].in_body, of_map};
  };
  const PointMatch ends[] = {as_seen(pair.first), as_seen(pair.second)};
  const std::optional<PoseFit> fit = fit_pose(ends);
  if (!fit) return std::nullopt;
  PairPrediction prediction{};
  prediction.share = pair.variance() > 0.0 ? pair.first_variance / pair.variance() : 0.5;
  const Baseline in_body = Baseline::between(ends[0].in_body, ends[1].in_body, prediction.share);
  prediction.log_most = 0.5 * std::log(fit->covariance.determinant()) - 0.5 * std::log(2.0 * kPi);
  for (const std::size_t i : {pair.first, pair.second})
    prediction.log_most -= 0.5 * std::log(points[i].covariance.determinant());
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i == pair.first || i == pair.second || !is_usable(points[i], map)) continue;
    const double radius_m =
        gate_radius({{}, fit->covariance}, point_innovation({}, as_seen(i)), options.gate);
    prediction.others.push_back({i, in_body.coordinates_of(points[i].in_body), radius_m});
  }
  std::ranges::stable_sort(prediction.others, {}, &PairPrediction::Expected::radius_m);
  return prediction;
}

double gate_radius(const PoseEstimate& pose, const PointInnovation& innovation, double gate) {
  return std::sqrt(gate *
                   (innovation.H * pose.covariance * innovation.H.transpose() + innovation.noise).trace());
}

}  // namespace trundle::slam
