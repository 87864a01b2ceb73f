#include "trundle/slam/localization/pose_ekf.hpp"

#include <cmath>
#include <optional>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "trundle/geometry/decompositions.hpp"

namespace trundle::slam {
namespace {

using Index = Eigen::Index;

Index column_of(LandmarkId landmark) {
  return 2 * static_cast<Index>(landmark);
}

}  // namespace

PoseEkf::PoseEkf(const KnownMap& map, const LandmarkSensor& sensor, const PoseEstimate& start,
                 const MapSightOptions& options)
    : map_(&map), sensor_(sensor), options_(options), belief_(start) {
  if (!map.is_exact()) with_map_.setZero(3 + start.systematic.size(), 2 * static_cast<Index>(map.size()));
}

const MapStepReport& PoseEkf::step(const Motion& motion, std::span<const Observation> observations,
                                   std::span<const double> novelty) {
  report_.observations.assign(observations.size(), {});
  report_.against = report_.new_evidence_against = 0.0;
  predict(motion);
  update(matches_of(observations, novelty), observations);
  return report_;
}

void PoseEkf::predict(const Motion& motion) {
  const Pose2 before = belief_.pose;
  belief_ = moved(belief_, motion);
  if (with_map_.size() == 0) return;
  const double dx = belief_.pose.x - before.x;
  const double dy = belief_.pose.y - before.y;
  with_map_.row(0) -= dy * with_map_.row(2);
  with_map_.row(1) += dx * with_map_.row(2);
  const Eigen::Index n = belief_.systematic.size();
  if (n == 0) return;
  const BySystematic W = world_from_body_axes(belief_.pose) * motion.by_first(n);
  with_map_.topRows<3>() += W * with_map_.bottomRows(n);
}

void PoseEkf::read_bias(const BiasReading& reading) {
  if (belief_.systematic.size() == 0) return;
  const BodyCovariance P = body_covariance_of(belief_);
  if (const double S = P(3, 3) + reading.variance; with_map_.size() > 0 && S > 0.0)
    with_map_ -= P.col(3) / S * Eigen::RowVectorXd(with_map_.row(3));
  trundle::slam::read_bias(reading, belief_);
}

/// With the correlation of pose and landmark.
MapSight PoseEkf::sight_of(LandmarkId landmark, const Observation& observation) const {
  MapSight sight = map_sight(belief_, sensor_, (*map_)[landmark], observation);
  if (with_map_.size() == 0) return sight;
  const Matrix2 mixed = sight.expected.by_pose * with_map_.block<3, 2>(0, column_of(landmark)) *
                        sight.expected.by_landmark.transpose();
  sight.S += mixed + mixed.transpose();
  sight.nis = sight.innovation.dot(sight.S.llt().solve(sight.innovation));
  sight.log_density = -0.5 * (sight.nis + std::log(sight.S.determinant())) - std::log(2.0 * kPi);
  return sight;
}

/// Those that pass the gate; reports all.
std::vector<PoseEkf::Match> PoseEkf::matches_of(std::span<const Observation> observations,
                                                std::span<const double> novelty) {
  const auto landmarks = identify(belief_, *map_, sensor_, observations, options_.gate);
  const double in_view = landmarks_in_view(belief_, *map_, sensor_);
  std::vector<Match> matches;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    if (!may_be_mapped(observations[i], *map_)) continue;
    std::optional<MapSight> sight;
    if (landmarks[i] != kUnknownLandmark) sight = sight_of(landmarks[i], observations[i]);
    const GatedReading reading =
        gated(observations[i], landmarks[i], sight ? &*sight : nullptr, in_view, sensor_, options_);
    if (reading.report.decision == Decision::matched) matches.push_back({i, landmarks[i], *sight});
    report_.observations[i] = reading.report;
    report_.against += reading.against;
    report_.new_evidence_against += novelty[i] * reading.against;
  }
  return matches;
}

/// Linearised again at the pose that the sightings make of it, until a straight line tells what is read
/// there: a start that is vague beside them would be sure of a wrong pose [Bell, Cathey 1993].
void PoseEkf::update(std::vector<Match> matches, std::span<const Observation> observations) {
  if (matches.empty()) return;
  constexpr int kMostLinearisations = 8;  // each squares what is left; more: sightings that do not fit
  const PoseEstimate prior = belief_;
  const Eigen::MatrixXd prior_with_map = with_map_;
  Vector3 at = Vector3::Zero();  // from the prior
  for (int i = 0; i < kMostLinearisations; ++i) {
    belief_ = prior;
    with_map_ = prior_with_map;
    update_linearised(matches, at);
    const Vector3 moved = difference(prior.pose, belief_.pose);
    if (relinearise(matches, observations, moved - at)) return;
    at = moved;
  }
}

/// At the present pose, so far from the one before. True where they were straight from there to here.
bool PoseEkf::relinearise(std::vector<Match>& matches, std::span<const Observation> observations,
                          const Vector3& moved) const {
  constexpr double kStraight = 0.1;  // 1σ of a reading
  const Vector2 sigma = reading_covariance(sensor_).diagonal().cwiseSqrt();
  bool straight = true;
  for (auto& [observation, landmark, sight] : matches) {
    const Vector2 expected = sight.innovation - sight.expected.by_pose * moved;
    sight.expected = expected_reading(belief_.pose, sensor_.body_from_sensor, (*map_)[landmark].position);
    sight.innovation = innovation_of(observations[observation], sight.expected);
    const Vector2 missed = (sight.innovation - expected).cwiseAbs();
    straight = straight && (missed.array() < kStraight * sigma.array()).all();
  }
  return straight;
}

/// Eq. 44, 45: only the pose is moved, with the systematic errors; the map is not. The matches are linearised
/// `at` a pose so far from the belief's.
void PoseEkf::update_linearised(const std::vector<Match>& matches, const Vector3& at) {
  const auto rows = 2 * static_cast<Index>(matches.size());
  const Index body = 3 + belief_.systematic.size();
  const bool exact = with_map_.size() == 0;
  Eigen::MatrixXd G = Eigen::MatrixXd::Zero(rows, body);  // of the readings by the body
  Eigen::MatrixXd X = Eigen::MatrixXd::Zero(body, rows);  // of body and readings, by the map
  Eigen::MatrixXd W = Eigen::MatrixXd::Zero(rows, rows);  // of the readings, were the body certain
  Eigen::VectorXd innovation(rows);
  const auto row_of = [](std::size_t k) { return 2 * static_cast<Index>(k); };
  Eigen::MatrixXd HC;  // H times the covariance of everything with the landmarks
  if (!exact) HC.resize(rows, with_map_.cols());
  for (std::size_t k = 0; k < matches.size(); ++k) {
    const auto& [observation, landmark, sight] = matches[k];
    G.block<2, 3>(row_of(k), 0) = sight.expected.by_pose;
    W.block<2, 2>(row_of(k), row_of(k)) += reading_covariance(sensor_);
    innovation.segment<2>(row_of(k)) = sight.innovation + sight.expected.by_pose * at;
    if (exact) continue;
    const Matrix2& L = sight.expected.by_landmark;
    X.middleCols<2>(row_of(k)) = with_map_.middleCols<2>(column_of(landmark)) * L.transpose();
    HC.middleRows<2>(row_of(k)) =
        sight.expected.by_pose * with_map_.topRows<3>() + L * map_->covariance_with_all(landmark);
    for (std::size_t l = 0; l < matches.size(); ++l)
      W.block<2, 2>(row_of(k), row_of(l)) += L * map_->covariance(landmark, matches[l].landmark) *
                                             matches[l].sight.expected.by_landmark.transpose();
  }
  const BodyCovariance P = body_covariance_of(belief_);
  const Eigen::MatrixXd PHt = P * G.transpose() + X;
  const Eigen::MatrixXd S = G * PHt + X.transpose() * G.transpose() + W;
  const Eigen::MatrixXd K = divide_cholesky(PHt, S);
  const Eigen::VectorXd change = K * innovation;
  belief_.pose = {belief_.pose.x + change[0], belief_.pose.y + change[1], belief_.pose.heading + change[2]};
  belief_.systematic += change.tail(body - 3);
  // Joseph's form: what is much surer afterwards is no difference of large numbers.
  const Eigen::MatrixXd A = Eigen::MatrixXd::Identity(body, body) - K * G;
  const Eigen::MatrixXd mixed = A * X * K.transpose();
  set_body_covariance(A * P * A.transpose() - mixed - mixed.transpose() + K * W * K.transpose(), belief_);
  if (!exact) with_map_ -= K * HC;
}

}  // namespace trundle::slam
