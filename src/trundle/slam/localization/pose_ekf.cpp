#include "trundle/slam/localization/pose_ekf.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <Eigen/LU>

#include "trundle/geometry/decompositions.hpp"
#include "trundle/geometry/gaussian.hpp"

namespace trundle::slam {
namespace {

using Index = Eigen::Index;

Index column_of(LandmarkId landmark) {
  return 2 * static_cast<Index>(landmark);
}

Index row_of(std::size_t match) {
  return 2 * static_cast<Index>(match);
}

/// Where an error (x, y, heading) in the world's axes moves a pose: along the arc of a constant twist, so
/// that a turn about a landmark, of which its sightings say nothing, keeps their distance.
Pose2 along_arc(const Pose2& from, const Vector3& error) {
  return from * exp(Twist2::from(world_from_body_axes(from).transpose() * error));
}

/// Errors about one pose, as errors about another: F of eq. 41. A turn about a point stays one.
Matrix3 carried(const Pose2& from, const Pose2& to) {
  Matrix3 F = Matrix3::Identity();
  F.col(2).head<2>() = Vector2(from.y - to.y, to.x - from.x);
  return F;
}

}  // namespace

PoseEkf::PoseEkf(const KnownMap& map, const LandmarkSensor& sensor, const PoseEstimate& start,
                 const MapSightOptions& options)
    : map_(&map), sensor_(sensor), options_(options), belief_(start) {
  if (!map.is_exact()) with_map_.setZero(3 + start.systematic.size(), 2 * static_cast<Index>(map.size()));
}

PoseEkf::PoseEkf(const KnownMap& map, const LandmarkSensor& sensor, const PoseEstimate& start,
                 const MapSightOptions& options, std::span<const LandmarkGain> made_of)
    : PoseEkf(map, sensor, start, options) {
  if (map.is_exact()) return;
  for (const auto& [landmark, D] : made_of) with_map_.topRows<3>() += D * map.covariance_with_all(landmark);
  for (const auto& [landmark, D] : made_of) {
    const Eigen::Matrix<double, 3, 2> by_others =
        with_map_.block<3, 2>(0, column_of(landmark)) - D * map.covariance(landmark, landmark);
    belief_.covariance += by_others * D.transpose();
  }
}

const MapStepReport& PoseEkf::step(const Motion& motion, std::span<const Observation> observations,
                                   std::span<const double> novelty) {
  report_.observations.assign(observations.size(), {});
  report_.against = report_.new_evidence_against = 0.0;
  predict(motion);
  update(matches_of(observations, novelty), observations);
  return report_;
}

bool PoseEkf::is_ambiguous(const Motion& motion, std::span<const Observation> observations) const {
  const auto is_unidentified = [](const Observation& o) {
    return is_valid(o) && o.landmark == kUnknownLandmark;
  };
  if (std::ranges::none_of(observations, is_unidentified)) return false;
  if (is_one_place(moved(belief_, motion), options_.same)) return false;
  PoseEkf predicted = *this;
  predicted.predict(motion);
  return std::ranges::any_of(observations, [&](const Observation& o) {
    if (!is_unidentified(o)) return false;
    const auto near = candidates(predicted.belief_, *map_, sensor_, o, options_.gate);
    const auto fits = [&](LandmarkId id) { return predicted.sight_of(id, o).nis <= options_.gate; };
    return std::ranges::count_if(near, fits) > 1;
  });
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
  sight.nis = squared_mahalanobis(sight.innovation, sight.S);
  sight.log_density = -0.5 * (sight.nis + std::log(sight.S.determinant())) - std::log(2.0 * kPi);
  return sight;
}

/// Those that pass the gate; reports all.
std::vector<PoseEkf::Match> PoseEkf::matches_of(std::span<const Observation> observations,
                                                std::span<const double> novelty) {
  const auto landmarks = identify(belief_, *map_, sensor_, observations, options_.gate);
  const double in_view = map_->most_in_view();
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

/// Eq. 44, with the matches as they are linearised.
PoseEkf::Gain PoseEkf::gain_of(const std::vector<Match>& matches) const {
  const auto rows = 2 * static_cast<Index>(matches.size());
  const Index body = 3 + belief_.systematic.size();
  Gain gain{Eigen::MatrixXd::Zero(rows, body),
            Eigen::MatrixXd::Zero(body, rows),
            Eigen::MatrixXd::Zero(rows, rows),
            {}};
  auto& [G, X, W, K] = gain;
  for (std::size_t k = 0; k < matches.size(); ++k) {
    const auto& [observation, landmark, sight] = matches[k];
    G.block<2, 3>(row_of(k), 0) = sight.expected.by_pose;
    W.block<2, 2>(row_of(k), row_of(k)) += reading_covariance(sensor_);
    if (with_map_.size() == 0) continue;
    const Matrix2& L = sight.expected.by_landmark;
    X.middleCols<2>(row_of(k)) = with_map_.middleCols<2>(column_of(landmark)) * L.transpose();
    for (std::size_t l = 0; l < matches.size(); ++l)
      W.block<2, 2>(row_of(k), row_of(l)) += L * map_->covariance(landmark, matches[l].landmark) *
                                             matches[l].sight.expected.by_landmark.transpose();
  }
  const Eigen::MatrixXd PHt = body_covariance_of(belief_) * G.transpose() + X;
  K = divide_cholesky(PHt, G * PHt + X.transpose() * G.transpose() + W);
  return gain;
}

/// At the present pose, by errors about the prior.
std::vector<PoseEkf::Match> PoseEkf::linearised(std::vector<Match> matches,
                                                std::span<const Observation> observations,
                                                const Matrix3& F) const {
  for (auto& [observation, landmark, sight] : matches) {
    sight.expected = expected_reading(belief_.pose, sensor_.body_from_sensor, (*map_)[landmark].position);
    sight.innovation = innovation_of(observations[observation], sight.expected);
    sight.expected.by_pose *= F;
  }
  return matches;
}

/// Whether a straight line tells what is read so far from where the matches were linearised before.
bool PoseEkf::is_straight(const std::vector<Match>& before, const std::vector<Match>& now,
                          const Vector3& moved) const {
  constexpr double kStraight = 0.1;  // 1σ of a reading
  const Vector2 sigma = reading_covariance(sensor_).diagonal().cwiseSqrt();
  for (std::size_t k = 0; k < before.size(); ++k) {
    const MapSight& sight = before[k].sight;
    const Vector2 expected = sight.innovation - sight.expected.by_pose * moved;
    const Vector2 missed = (now[k].sight.innovation - expected).cwiseAbs();
    if ((missed.array() >= kStraight * sigma.array()).any()) return false;
  }
  return true;
}

/// Eq. 45 to 45b: only the pose is moved, with the systematic errors; the map is not. Linearised again at the
/// pose that the sightings make of it, until a straight line tells what is read there: a start that is vague
/// beside them would be sure of a wrong pose [Bell, Cathey 1993]. The covariance is that of errors about the
/// prior: it follows the pose, or what one sighting leaves open another of the same would seem to tell.
void PoseEkf::update(std::vector<Match> matches, std::span<const Observation> observations) {
  if (matches.empty()) return;
  constexpr int kMostLinearisations = 8;  // each squares what is left; more: sightings that do not fit
  const Pose2 prior = belief_.pose;
  Vector3 at = Vector3::Zero();  // of the linearisation, from the prior
  for (int left = kMostLinearisations;; --left) {
    const Gain gain = gain_of(matches);
    Eigen::VectorXd innovation(gain.W.rows());
    for (std::size_t k = 0; k < matches.size(); ++k)
      innovation.segment<2>(row_of(k)) = matches[k].sight.innovation + matches[k].sight.expected.by_pose * at;
    const Eigen::VectorXd change = gain.K * innovation;
    const Vector3 error = change.head<3>();
    belief_.pose = along_arc(prior, error);
    const Matrix3 F = carried(prior, belief_.pose);
    std::vector<Match> here = linearised(matches, observations, F);
    if (left == 1 || is_straight(matches, here, error - at)) {
      belief_.systematic += change.tail(belief_.systematic.size());
      update_covariance(matches, gain);
      return follow(F);
    }
    matches = std::move(here);
    at = error;
  }
}

void PoseEkf::update_covariance(const std::vector<Match>& matches, const Gain& gain) {
  const auto& [G, X, W, K] = gain;
  const BodyCovariance P = body_covariance_of(belief_);
  // Joseph's form: what is much surer afterwards is no difference of large numbers.
  const Eigen::MatrixXd A = Eigen::MatrixXd::Identity(P.rows(), P.rows()) - K * G;
  const Eigen::MatrixXd mixed = A * X * K.transpose();
  set_body_covariance(A * P * A.transpose() - mixed - mixed.transpose() + K * W * K.transpose(), belief_);
  if (with_map_.size() == 0) return;
  Eigen::MatrixXd HC(W.rows(), with_map_.cols());  // H times the covariance of everything with the landmarks
  for (std::size_t k = 0; k < matches.size(); ++k) {
    const ExpectedReading& expected = matches[k].sight.expected;
    HC.middleRows<2>(row_of(k)) = expected.by_pose * with_map_.topRows<3>() +
                                  expected.by_landmark * map_->covariance_with_all(matches[k].landmark);
  }
  with_map_ -= K * HC;
}

/// Errors of (x, y, heading) about the prior become those about the pose. Eq. 45b.
void PoseEkf::follow(const Matrix3& F) {
  BodyCovariance P = body_covariance_of(belief_);
  P.topRows<3>() = (F * P.topRows<3>()).eval();
  P.leftCols<3>() = (P.leftCols<3>() * F.transpose()).eval();
  set_body_covariance(P, belief_);
  if (with_map_.size() > 0) with_map_.topRows<3>() = (F * with_map_.topRows<3>()).eval();
}

}  // namespace trundle::slam
