#include "trundle/slam/ekf.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace trundle {
namespace {

constexpr Eigen::Index kFirstCapacity = 6 + 2 * 32;

Matrix2 block_of(const Eigen::MatrixXd& S, std::size_t k) {
  return S.block<2, 2>(2 * static_cast<Eigen::Index>(k), 2 * static_cast<Eigen::Index>(k));
}

Matrix3 full(const Eigen::MatrixXd& lower) {
  return Matrix3(lower.topLeftCorner<3, 3>().selfadjointView<Eigen::Lower>());
}

Matrix3 world_from_body_axes(const Pose2& pose) {
  Matrix3 R = Matrix3::Identity();
  R.topLeftCorner<2, 2>() = rotation(pose.heading);
  return R;
}

}  // namespace

EkfSlam::EkfSlam(const LandmarkSensor& sensor, const EkfSlamOptions& options)
    : body_from_sensor_(sensor.body_from_sensor),
      max_range_m_(sensor.max_range_m),
      R_(reading_covariance(sensor)),
      gate_(options.gate) {
  mean_ = Eigen::VectorXd::Zero(kFirstCapacity);
  P_ = Eigen::MatrixXd::Zero(kFirstCapacity, kFirstCapacity);
  const SlamPrior& prior = options.prior;
  mean_.head<3>() << prior.start.x, prior.start.y, prior.start.heading;
  P_.topLeftCorner<3, 3>() = prior.start_covariance;
  P_.block<3, 3>(3, 3) = prior.systematic_sigma.cwiseAbs2().asDiagonal();
}

const StepReport& EkfSlam::step(const Motion& motion, std::span<const Observation> given) {
  predict(motion);
  report_.observations.assign(given.size(), {});
  const std::vector<Observation> observations = recognise(given);
  std::vector<std::size_t> open;
  for (std::size_t i = 0; i < observations.size(); ++i)
    if (is_valid(observations[i]) && observations[i].landmark >= 0) open.push_back(i);
  // What creates a landmark and is followed by another sighting of the same one takes a second round.
  while (!open.empty()) {
    update(matches_of(observations, open));
    std::vector<std::size_t> again;
    for (const std::size_t i : open) {
      if (find(observations[i].landmark) >= 0) {
        again.push_back(i);
      } else {
        add_landmark(observations[i]);
        report_.observations[i].decision = Decision::created;
        report_.observations[i].landmark = static_cast<LandmarkId>(ids_.size()) - 1;
      }
    }
    open = std::move(again);
  }
  return report_;
}

/// Names for those that have none: of a landmark in the map, or the next free one. What is neither keeps none
/// and is rejected.
std::vector<Observation> EkfSlam::recognise(std::span<const Observation> given) {
  std::vector<Observation> observations(given.begin(), given.end());
  std::vector<std::size_t> nameless;
  std::vector<std::vector<Fit>> fits;
  for (std::size_t i = 0; i < given.size(); ++i) {
    if (given[i].landmark >= 0 || !is_valid(given[i])) continue;
    nameless.push_back(i);
    fits.push_back(fits_of(given[i]));
  }
  if (nameless.empty()) return observations;
  const auto found = associate(fits, {.gate = gate_, .max_range_m = max_range_m_});
  auto next = static_cast<LandmarkId>(index_of_.size());
  for (std::size_t k = 0; k < nameless.size(); ++k) {
    const std::size_t i = nameless[k];
    if (found[k].kind == Association::matched) observations[i].landmark = found[k].landmark;
    if (found[k].kind == Association::fresh) observations[i].landmark = next++;
    if (found[k].kind == Association::doubtful) report_.observations[i].decision = Decision::rejected;
  }
  return observations;
}

/// Of all landmarks that the sensor might see, with the covariance of eq. 6.
std::vector<Fit> EkfSlam::fits_of(const Observation& observation) const {
  std::vector<Fit> fits;
  const Matrix3 of_pose = full(P_);
  for (std::size_t k = 0; k < ids_.size(); ++k) {
    const Index at = kBody + 2 * static_cast<Index>(k);
    const ExpectedReading expected = expected_reading(pose(), body_from_sensor_, mean_.segment<2>(at));
    const Matrix23& G = expected.by_pose;
    const Matrix2& L = expected.by_landmark;
    const Matrix2 mixed = L * P_.block<2, 3>(at, 0) * G.transpose();
    const Matrix2 S = G * of_pose * G.transpose() + mixed + mixed.transpose() +
                      L * P_.block<2, 2>(at, at).selfadjointView<Eigen::Lower>() * L.transpose() + R_;
    const Vector2 innovation = innovation_of(observation, expected);
    const double nis = innovation.dot(S.llt().solve(innovation));
    fits.push_back({ids_[k], nis, nis + std::log(S.determinant()) + 2.0 * std::log(2.0 * kPi)});
  }
  return fits;
}

/// Eq. 5. Landmarks stay where they are: of their part only the covariance with the pose changes.
void EkfSlam::predict(const Motion& motion) {
  const Pose2 before = pose();
  const Vector3 s = mean_.segment<3>(3);
  const Pose2 after = before * motion.mean * exp(Twist2::from(motion.by_systematic * s));
  const Matrix3 R = world_from_body_axes(after);
  Matrix3 F = Matrix3::Identity();
  F(0, 2) = -(after.y - before.y);
  F(1, 2) = after.x - before.x;
  const Matrix3 W = R * motion.by_systematic;
  const Matrix3 of_pose = full(P_);
  const Matrix3 of_systematic = P_.block<3, 3>(3, 3).selfadjointView<Eigen::Lower>();
  const Matrix3 mixed = P_.block<3, 3>(3, 0);  // systematic by pose
  const Matrix3 pose_with_systematic = F * mixed.transpose() + W * of_systematic;
  P_.topLeftCorner<3, 3>() = F * (of_pose * F.transpose() + mixed.transpose() * W.transpose()) +
                             W * (mixed * F.transpose() + of_systematic * W.transpose()) +
                             R * motion.covariance * R.transpose();
  P_.block<3, 3>(3, 0) = pose_with_systematic.transpose();
  const Index rest = size_ - kBody;
  P_.block(kBody, 0, rest, 3) =
      (P_.block(kBody, 0, rest, 3) * F.transpose() + P_.block(kBody, 3, rest, 3) * W.transpose()).eval();
  mean_.head<3>() << after.x, after.y, after.heading;
}

/// Those of `open` whose landmark is in the map; they leave `open`.
std::vector<EkfSlam::Match> EkfSlam::matches_of(std::span<const Observation> observations,
                                                std::vector<std::size_t>& open) {
  std::vector<Match> matches;
  std::erase_if(open, [&](std::size_t i) {
    const Index at = find(observations[i].landmark);
    if (at < 0) return false;
    const ExpectedReading expected = expected_reading(pose(), body_from_sensor_, mean_.segment<2>(at));
    matches.push_back({i, at, expected, innovation_of(observations[i], expected)});
    return true;
  });
  return matches;
}

/// Columns of P Hᵀ: H has entries at the pose and at one landmark only.
Eigen::MatrixXd EkfSlam::cross_covariance(const std::vector<Match>& matches) const {
  Eigen::MatrixXd PHt(size_, 2 * static_cast<Index>(matches.size()));
  Eigen::MatrixXd of_landmark(size_, 2);
  Eigen::MatrixXd of_pose(size_, 3);
  of_pose.topRows<3>() = full(P_);
  of_pose.bottomRows(size_ - 3) = P_.block(3, 0, size_ - 3, 3);
  for (std::size_t k = 0; k < matches.size(); ++k) {
    const Index at = matches[k].at;
    of_landmark.topRows(at) = P_.block(at, 0, 2, at).transpose();
    of_landmark.middleRows<2>(at) = P_.block<2, 2>(at, at).selfadjointView<Eigen::Lower>();
    of_landmark.bottomRows(size_ - at - 2) = P_.block(at + 2, at, size_ - at - 2, 2);
    PHt.middleCols<2>(2 * static_cast<Index>(k)).noalias() =
        of_pose * matches[k].expected.by_pose.transpose() +
        of_landmark * matches[k].expected.by_landmark.transpose();
  }
  return PHt;
}

Eigen::MatrixXd EkfSlam::innovation_covariance(const std::vector<Match>& matches,
                                               const Eigen::MatrixXd& PHt) const {
  Eigen::MatrixXd S(PHt.cols(), PHt.cols());
  for (std::size_t k = 0; k < matches.size(); ++k) {
    const Index row = 2 * static_cast<Index>(k);
    S.middleRows<2>(row) = matches[k].expected.by_pose * PHt.topRows<3>() +
                           matches[k].expected.by_landmark * PHt.middleRows<2>(matches[k].at);
    S.block<2, 2>(row, row) += R_;
  }
  return S;
}

/// Eq. 6: reports every match, and leaves those that pass the gate.
void EkfSlam::keep_gated(std::vector<Match>& matches, Eigen::MatrixXd& PHt, Eigen::MatrixXd& S) {
  std::vector<Match> kept;
  std::vector<Index> columns;
  for (std::size_t k = 0; k < matches.size(); ++k) {
    const Match& match = matches[k];
    const double nis = match.innovation.dot(block_of(S, k).llt().solve(match.innovation));
    const bool passes = nis <= gate_;
    const auto landmark = static_cast<std::size_t>((match.at - kBody) / 2);
    report_.observations[match.observation] = {passes ? Decision::matched : Decision::rejected,
                                               passes ? static_cast<LandmarkId>(landmark) : kUnknownLandmark,
                                               match.innovation, nis};
    if (!passes) continue;
    ++sightings_[landmark];
    columns.insert(columns.end(), {2 * static_cast<Index>(k), 2 * static_cast<Index>(k) + 1});
    kept.push_back(match);
  }
  if (kept.size() == matches.size()) return;
  matches = std::move(kept);
  PHt = PHt(Eigen::all, columns).eval();
  S = S(columns, columns).eval();
}

/// Eq. 7: S = L Lᵀ, V = P Hᵀ L⁻ᵀ, P ← P − V Vᵀ, mean ← mean + V L⁻¹ ν.
void EkfSlam::update(std::vector<Match> matches) {
  if (matches.empty()) return;
  Eigen::MatrixXd PHt = cross_covariance(matches);
  Eigen::MatrixXd S = innovation_covariance(matches, PHt);
  keep_gated(matches, PHt, S);
  if (matches.empty()) return;
  Eigen::VectorXd innovation(PHt.cols());
  for (std::size_t k = 0; k < matches.size(); ++k)
    innovation.segment<2>(2 * static_cast<Index>(k)) = matches[k].innovation;
  const Eigen::LLT<Eigen::MatrixXd> factor(S);
  assert(factor.info() == Eigen::Success);
  factor.matrixL().solveInPlace(innovation);
  factor.matrixL().transpose().solveInPlace<Eigen::OnTheRight>(PHt);
  mean_.head(size_).noalias() += PHt * innovation;
  P_.topLeftCorner(size_, size_).selfadjointView<Eigen::Lower>().rankUpdate(PHt, -1.0);
}

/// Eq. 8.
void EkfSlam::add_landmark(const Observation& observation) {
  const SightedLandmark sighted = sighted_landmark(pose(), body_from_sensor_, observation);
  reserve(size_ + 2);
  const Matrix3 pose_covariance = full(P_);
  P_.block<2, 3>(size_, 0) = sighted.by_pose * pose_covariance;
  P_.block(size_, 3, 2, size_ - 3) = sighted.by_pose * P_.block(3, 0, size_ - 3, 3).transpose();
  P_.block<2, 2>(size_, size_) = sighted.by_pose * pose_covariance * sighted.by_pose.transpose() +
                                 sighted.by_reading * R_ * sighted.by_reading.transpose();
  mean_.segment<2>(size_) = sighted.in_world;
  const auto id = static_cast<std::size_t>(observation.landmark);
  if (index_of_.size() <= id) index_of_.resize(id + 1, -1);
  index_of_[id] = size_;
  ids_.push_back(observation.landmark);
  sightings_.push_back(1);
  size_ += 2;
}

void EkfSlam::reserve(Index size) {
  if (size <= P_.rows()) return;
  const Index capacity = std::max(size, 2 * P_.rows());
  mean_.conservativeResize(capacity);
  P_.conservativeResize(capacity, capacity);
}

EkfSlam::Index EkfSlam::find(LandmarkId id) const {
  const auto i = static_cast<std::size_t>(id);
  return i < index_of_.size() ? index_of_[i] : -1;
}

Pose2 EkfSlam::pose() const {
  return {mean_[0], mean_[1], mean_[2]};
}

PoseEstimate EkfSlam::estimate() const {
  return {pose(), full(P_), mean_.segment<3>(3),
          Matrix3(P_.block<3, 3>(3, 3).selfadjointView<Eigen::Lower>())};
}

MappedLandmark EkfSlam::landmark(std::size_t index) const {
  const Index at = kBody + 2 * static_cast<Index>(index);
  return {ids_[index], mean_.segment<2>(at), Matrix2(P_.block<2, 2>(at, at).selfadjointView<Eigen::Lower>()),
          sightings_[index]};
}

Eigen::MatrixXd EkfSlam::covariance() const {
  return P_.topLeftCorner(size_, size_).selfadjointView<Eigen::Lower>();
}

}  // namespace trundle
