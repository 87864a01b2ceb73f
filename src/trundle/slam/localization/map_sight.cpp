#include "trundle/slam/localization/map_sight.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "trundle/geometry/decompositions.hpp"
#include "trundle/geometry/gaussian.hpp"
#include "trundle/slam/association/association.hpp"

namespace trundle::slam {
namespace {

std::vector<Fit> fits_of(const PoseEstimate& belief, const KnownMap& map, const LandmarkSensor& sensor,
                         const Observation& observation, double gate) {
  std::vector<Fit> fits;
  for (const LandmarkId id : candidates(belief, map, sensor, observation, gate)) {
    const MapSight sight = map_sight(belief, sensor, map[id], observation);
    fits.push_back({id, sight.nis, -2.0 * sight.log_density});
  }
  return fits;
}

}  // namespace

Vector3 difference(const Pose2& from, const Pose2& to) {
  return {to.x - from.x, to.y - from.y, wrap_angle(to.heading - from.heading)};
}

bool is_one_place(const PoseEstimate& belief, const SamePlace& same) {
  constexpr double kSigmas = 3.0;  // as the distances of SamePlace are meant
  const Eigen::VectorXd place = symmetric_eigenvalues(belief.covariance.topLeftCorner<2, 2>());
  return kSigmas * std::sqrt(place.maxCoeff()) < same.place_m &&
         kSigmas * std::sqrt(belief.covariance(2, 2)) < same.heading_rad;
}

MapSight map_sight(const PoseEstimate& belief, const LandmarkSensor& sensor, const KnownLandmark& landmark,
                   const Observation& observation) {
  MapSight sight;
  sight.expected = expected_reading(belief.pose, sensor.body_from_sensor, landmark.position);
  sight.innovation = innovation_of(observation, sight.expected);
  const Matrix23& G = sight.expected.by_pose;
  const Matrix2& L = sight.expected.by_landmark;
  sight.S = G * belief.covariance * G.transpose() + L * landmark.covariance * L.transpose() +
            reading_covariance(sensor);
  sight.nis = squared_mahalanobis(sight.innovation, sight.S);
  sight.log_density = -0.5 * (sight.nis + std::log(sight.S.determinant())) - std::log(2.0 * kPi);
  return sight;
}

std::vector<LandmarkId> candidates(const PoseEstimate& belief, const KnownMap& map,
                                   const LandmarkSensor& sensor, const Observation& observation,
                                   double gate) {
  const SightedLandmark sighted = sighted_landmark(belief.pose, sensor.body_from_sensor, observation);
  const double variance = (sighted.by_pose * belief.covariance * sighted.by_pose.transpose()).trace() +
                          sighted.spread(reading_covariance(sensor)).trace() + map.largest_variance();
  return map.within(sighted.in_world, std::sqrt(2.0 * gate * variance));
}

std::vector<LandmarkId> identify(const PoseEstimate& belief, const KnownMap& map,
                                 const LandmarkSensor& sensor, std::span<const Observation> observations,
                                 double gate) {
  std::vector<LandmarkId> landmarks(observations.size(), kUnknownLandmark);
  std::vector<std::size_t> unidentified;
  std::vector<std::vector<Fit>> fits;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    if (!is_valid(observations[i])) continue;
    if (observations[i].landmark != kUnknownLandmark) {
      if (map.has(observations[i].landmark)) landmarks[i] = observations[i].landmark;
      continue;
    }
    unidentified.push_back(i);
    fits.push_back(fits_of(belief, map, sensor, observations[i], gate));
  }
  const auto found = associate(fits, {.gate = gate, .max_range_m = sensor.max_range_m});
  for (std::size_t k = 0; k < unidentified.size(); ++k)
    if (found[k].kind == Association::matched) landmarks[unidentified[k]] = found[k].landmark;
  return landmarks;
}

GatedReading gated(const Observation& observation, LandmarkId landmark, const MapSight* sight, double in_view,
                   const LandmarkSensor& sensor, const MapSightOptions& options) {
  GatedReading reading;
  double density = 0.0;  // of the landmark, spread over as many as it might have been
  if (sight != nullptr) {
    reading.report.innovation = sight->innovation;
    reading.report.nis = sight->nis;
    if (sight->nis <= options.gate) {
      reading.report.decision = Decision::matched;
      reading.report.landmark = landmark;
      const bool unidentified = observation.landmark == kUnknownLandmark;
      density = std::exp(sight->log_density - (unidentified ? std::log(in_view) : 0.0));
    }
  }
  const double anywhere = 1.0 / (2.0 * kPi * sensor.max_range_m);
  reading.against = -std::log((1.0 - options.outlier_share) * density / anywhere + options.outlier_share);
  return reading;
}

void update(const PoseReading& reading, PoseEstimate& belief) {
  const auto& [innovation, H, S, noise] = reading;
  const Eigen::Matrix<double, 3, 2> K = belief.covariance * H.transpose() * S.inverse();
  const Vector3 change = K * innovation;
  belief.pose = {belief.pose.x + change.x(), belief.pose.y + change.y(), belief.pose.heading + change.z()};
  // Joseph's form: what is much surer afterwards is no difference of large numbers.
  const Matrix3 A = Matrix3::Identity() - K * H;
  if (belief.systematic.size() > 0) {
    const Eigen::Matrix<double, Eigen::Dynamic, 2, 0, kMostSystematic, 2> gain =
        belief.with_systematic.transpose() * H.transpose() * S.inverse();
    belief.systematic += gain * innovation;
    belief.systematic_covariance -= gain * H * belief.with_systematic;
    belief.with_systematic = (A * belief.with_systematic).eval();
  }
  belief.covariance = (A * belief.covariance * A.transpose() + K * noise * K.transpose()).eval();
}

PoseEstimate moved(const PoseEstimate& belief, const Motion& motion) {
  PoseEstimate after = belief;
  after.pose = belief.pose * about(belief.systematic, motion).mean;
  Matrix3 F = Matrix3::Identity();
  F(0, 2) = -(after.pose.y - belief.pose.y);
  F(1, 2) = after.pose.x - belief.pose.x;
  after.covariance =
      F * belief.covariance * F.transpose() + world_covariance({after.pose, motion.covariance});
  if (belief.systematic.size() == 0) return after;
  const Matrix3 R = world_from_body_axes(after.pose);
  const BySystematic W = R * motion.by_first(belief.systematic.size());
  const BySystematic carried = F * belief.with_systematic;
  const BySystematic more = W * belief.systematic_covariance;
  const Matrix3 mixed = carried * W.transpose();
  after.covariance += mixed + mixed.transpose() + more * W.transpose();
  after.with_systematic = carried + more;
  after.with_systematic.col(0) += R * motion.with_walk;
  after.systematic_covariance(0, 0) += motion.walk;
  return after;
}

void read_bias(const BiasReading& reading, PoseEstimate& belief) {
  if (belief.systematic.size() == 0) return;
  const double S = belief.systematic_covariance(0, 0) + reading.variance;
  if (S <= 0.0) return;
  const double innovation = reading.rad_s - belief.systematic[0];
  const BodyCovariance P = body_covariance_of(belief);
  const Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 3 + kMostSystematic, 1> K = P.col(3) / S;
  belief.pose = {belief.pose.x + K[0] * innovation, belief.pose.y + K[1] * innovation,
                 belief.pose.heading + K[2] * innovation};
  belief.systematic += K.tail(belief.systematic.size()) * innovation;
  // Joseph's form: what is much surer afterwards is no difference of large numbers.
  BodyCovariance A = BodyCovariance::Identity(P.rows(), P.cols());
  A.col(3) -= K;
  set_body_covariance(A * P * A.transpose() + reading.variance * K * K.transpose(), belief);
}

PoseEstimate with_systematic(const PoseEstimate& pose, const PoseEstimate& odometry) {
  return {pose.pose, pose.covariance, odometry.systematic, odometry.systematic_covariance,
          BySystematic::Zero(3, odometry.systematic.size())};
}

BodyCovariance body_covariance_of(const PoseEstimate& belief) {
  const Eigen::Index n = belief.systematic.size();
  BodyCovariance P(3 + n, 3 + n);
  P.topLeftCorner<3, 3>() = belief.covariance;
  P.topRightCorner(3, n) = belief.with_systematic;
  P.bottomLeftCorner(n, 3) = belief.with_systematic.transpose();
  P.bottomRightCorner(n, n) = belief.systematic_covariance;
  return P;
}

void set_body_covariance(const BodyCovariance& P, PoseEstimate& belief) {
  const Eigen::Index n = belief.systematic.size();
  const Matrix3 of_pose = P.topLeftCorner<3, 3>();
  const SystematicCovariance of_systematic = P.bottomRightCorner(n, n);
  belief.covariance = 0.5 * (of_pose + of_pose.transpose());
  belief.with_systematic = P.topRightCorner(3, n);
  belief.systematic_covariance = 0.5 * (of_systematic + of_systematic.transpose());
}

}  // namespace trundle::slam
