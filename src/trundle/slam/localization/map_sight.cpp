#include "trundle/slam/localization/map_sight.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "trundle/geometry/gaussian.hpp"
#include "trundle/slam/association/association.hpp"

namespace trundle {
namespace {

/// Landmarks that a reading might show: those about where it points.
std::vector<Fit> fits_of(const PoseEstimate& belief, const KnownMap& map, const LandmarkSensor& sensor,
                         const Observation& observation, double gate) {
  const SightedLandmark sighted = sighted_landmark(belief.pose, sensor.body_from_sensor, observation);
  const double variance = (sighted.by_pose * belief.covariance * sighted.by_pose.transpose()).trace() +
                          sighted.spread(reading_covariance(sensor)).trace() + map.largest_variance();
  std::vector<Fit> fits;
  for (const LandmarkId id : map.within(sighted.in_world, std::sqrt(2.0 * gate * variance))) {
    const MapSight sight = map_sight(belief, sensor, map[id], observation);
    fits.push_back({id, sight.nis, -2.0 * sight.log_density});
  }
  return fits;
}

}  // namespace

MapSight map_sight(const PoseEstimate& belief, const LandmarkSensor& sensor, const KnownLandmark& landmark,
                   const Observation& observation) {
  MapSight sight;
  sight.expected = expected_reading(belief.pose, sensor.body_from_sensor, landmark.position);
  sight.innovation = innovation_of(observation, sight.expected);
  const Matrix23& G = sight.expected.by_pose;
  const Matrix2& L = sight.expected.by_landmark;
  sight.S = G * belief.covariance * G.transpose() + L * landmark.covariance * L.transpose() +
            reading_covariance(sensor);
  sight.nis = sight.innovation.dot(sight.S.llt().solve(sight.innovation));
  sight.log_density = -0.5 * (sight.nis + std::log(sight.S.determinant())) - std::log(2.0 * kPi);
  return sight;
}

std::vector<LandmarkId> identify(const PoseEstimate& belief, const KnownMap& map,
                                 const LandmarkSensor& sensor, std::span<const Observation> observations,
                                 double gate) {
  std::vector<LandmarkId> landmarks(observations.size(), kUnknownLandmark);
  std::vector<std::size_t> nameless;
  std::vector<std::vector<Fit>> fits;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    if (!is_valid(observations[i])) continue;
    if (observations[i].landmark != kUnknownLandmark) {
      if (map.has(observations[i].landmark)) landmarks[i] = observations[i].landmark;
      continue;
    }
    nameless.push_back(i);
    fits.push_back(fits_of(belief, map, sensor, observations[i], gate));
  }
  const auto found = associate(fits, {.gate = gate, .max_range_m = sensor.max_range_m});
  for (std::size_t k = 0; k < nameless.size(); ++k)
    if (found[k].kind == Association::matched) landmarks[nameless[k]] = found[k].landmark;
  return landmarks;
}

std::size_t landmarks_in_view(const PoseEstimate& belief, const KnownMap& map, const LandmarkSensor& sensor) {
  return map.within((belief.pose * sensor.body_from_sensor).translation(), sensor.max_range_m).size();
}

double log_against(double fitting, double max_range_m, double outlier_share) {
  const double anywhere = 1.0 / (2.0 * kPi * max_range_m);
  return -std::log((1.0 - outlier_share) * std::exp(fitting) / anywhere + outlier_share);
}

PoseEstimate moved(const PoseEstimate& belief, const Motion& motion) {
  PoseEstimate after = belief;
  after.pose = belief.pose * motion.mean;
  Matrix3 F = Matrix3::Identity();
  F(0, 2) = -(after.pose.y - belief.pose.y);
  F(1, 2) = after.pose.x - belief.pose.x;
  after.covariance =
      F * belief.covariance * F.transpose() + world_covariance({after.pose, motion.covariance});
  return after;
}

}  // namespace trundle
