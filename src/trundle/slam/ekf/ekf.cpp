#include "trundle/slam/ekf/ekf.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "trundle/geometry/gaussian.hpp"

namespace trundle::slam {

EkfSlam::EkfSlam(const LandmarkSensor& sensor, const EkfSlamOptions& options)
    : sensor_(sensor),
      R_(reading_covariance(sensor)),
      options_(options),
      joint_(options.prior),
      table_(sensor.max_range_m, options.first_unidentified),
      unidentified_(sensor, options.gate) {}

const StepReport& EkfSlam::step(const Motion& motion, std::span<const Observation> observations) {
  report_.observations.assign(observations.size(), {});
  observations_ = observations;
  predict(motion);
  associate();
  // What creates a landmark and is followed by another sighting of the same one takes a second round.
  while (!open_.empty()) {
    if (match()) {
      gate();
      update();
    }
    augment();
  }
  update_existence();
  return report_;
}

// Eq. 5.
void EkfSlam::predict(const Motion& motion) {
  const Pose2 before = joint_.pose();
  const BySystematic by_systematic = motion.by_first(joint_.systematic());
  const Pose2 after = before * motion.mean * exp(Twist2::from(by_systematic * joint_.body().systematic));
  const Matrix3 R = world_from_body_axes(after);
  JointGaussian::Prediction prediction{after, Matrix3::Identity(), R * by_systematic,
                                       R * motion.covariance * R.transpose()};
  prediction.F(0, 2) = -(after.y - before.y);
  prediction.F(1, 2) = after.x - before.x;
  if (joint_.systematic() > 0) {
    prediction.walk = motion.walk;
    prediction.with_walk = R * motion.with_walk;
  }
  joint_.predict(prediction);
}

/// Observations with an id show the landmark of that id; those without one of the unidentified landmarks, a
/// new one, or neither, and those are rejected.
void EkfSlam::associate() {
  associate_unidentified();
  open_.clear();
  for (std::size_t i = 0; i < observations_.size(); ++i)
    if (is_valid(observations_[i]) && report_.observations[i].decision != Decision::rejected)
      open_.push_back(i);
}

/// Those of `open_` whose landmark is in the map, linearised: eq. 2, 3. False where there are none.
bool EkfSlam::match() {
  stacked_.matches.clear();
  in_view_.clear();
  std::erase_if(open_, [&](std::size_t i) {
    const int landmark = landmark_of(i);
    if (landmark == LandmarkTable::kNone) return false;
    in_view_.push_back(static_cast<std::size_t>(landmark));
    stacked_.matches.push_back({i, in_view_.back(), Vector2::Zero()});
    return true;
  });
  joint_.activate(in_view_);
  stacked_.H.clear();
  for (EkfMatches::Match& match : stacked_.matches) {
    const Index at = joint_.index_of(match.landmark);
    const ExpectedReading expected =
        expected_reading(joint_.pose(), sensor_.body_from_sensor, joint_.active(at));
    match.innovation = innovation_of(observations_[match.observation], expected);
    stacked_.H.push_back({at, expected.by_pose, expected.by_landmark});
  }
  return !stacked_.matches.empty();
}

/// S = H P Hᵀ + R.
void EkfSlam::set_innovation_covariance() {
  auto& [matches, H, PHt, S, innovation] = stacked_;
  joint_.cross_covariance(H, PHt);
  joint_.projected_covariance(H, PHt, S);
  for (Index row = 0; row < 2 * static_cast<Index>(H.size()); row += 2) S.block<2, 2>(row, row) += R_;
}

/// Eq. 6: reports every match, and leaves those that pass the gate.
void EkfSlam::gate() {
  auto& [matches, H, PHt, S, innovation] = stacked_;
  set_innovation_covariance();
  for (std::size_t k = 0; k < matches.size(); ++k) {
    const auto row = 2 * static_cast<Index>(k);
    const Vector2& nu = matches[k].innovation;
    const double nis = squared_mahalanobis(nu, S.block<2, 2>(row, row));
    report_.observations[matches[k].observation] = {
        nis <= options_.gate ? Decision::matched : Decision::rejected, kUnknownLandmark, nu, nis};
  }
  std::size_t kept = 0;
  for (std::size_t k = 0; k < matches.size(); ++k) {
    ObservationReport& report = report_.observations[matches[k].observation];
    if (report.decision == Decision::rejected) continue;
    const auto landmark = static_cast<int>(matches[k].landmark);
    report.landmark = table_.id_of(landmark);
    table_.add_sightings(landmark, 1);
    matches[kept] = matches[k];
    H[kept++] = H[k];
  }
  if (kept == matches.size()) return;
  matches.resize(kept);
  H.resize(kept);
  set_innovation_covariance();
}

/// Eq. 7.
void EkfSlam::update() {
  auto& [matches, H, PHt, S, innovation] = stacked_;
  if (matches.empty()) return;
  const auto size = 2 * static_cast<Index>(matches.size());
  if (innovation.size() < size) innovation.resize(2 * size);
  for (std::size_t k = 0; k < matches.size(); ++k)
    innovation.segment<2>(2 * static_cast<Index>(k)) = matches[k].innovation;
  joint_.update(H, PHt, S, innovation);
  for (const EkfMatches::Match& match : matches)
    table_.note_moved(static_cast<int>(match.landmark), joint_.landmark(match.landmark));
}

/// Eq. 8: a new landmark for each of `open_` that shows none of the map.
void EkfSlam::augment() {
  std::erase_if(open_, [&](std::size_t i) {
    if (landmark_of(i) != LandmarkTable::kNone) return false;
    const int landmark = add_landmark(observations_[i]);
    if (observations_[i].landmark < 0) unidentified_.show(i, static_cast<std::size_t>(landmark));
    report_.observations[i].decision = Decision::created;
    report_.observations[i].landmark = table_.id_of(landmark);
    return true;
  });
}

/// Its number.
int EkfSlam::add_landmark(const Observation& observation) {
  const Pose2 pose = joint_.pose();
  const SightedLandmark sighted = sighted_landmark(pose, sensor_.body_from_sensor, observation);
  joint_.append(sighted.in_world, sighted.by_pose, sighted.spread(R_));
  if (observation.landmark >= 0)
    table_.add_identified(observation.landmark);
  else
    table_.add_unidentified(sighted.in_world, pose.translation());
  const int landmark = static_cast<int>(table_.size()) - 1;
  table_.add_sightings(landmark, 1);
  return landmark;
}

void EkfSlam::read_bias(const BiasReading& reading) {
  if (joint_.systematic() > 0) joint_.read_systematic(reading.rad_s, reading.variance);
}

int EkfSlam::landmark_of(std::size_t observation) const {
  const LandmarkId id = observations_[observation].landmark;
  return id >= 0 ? table_.identified(id) : static_cast<int>(unidentified_.shown_by(observation));
}

Eigen::MatrixXd EkfSlam::map_covariance(std::span<const std::size_t> landmarks) const {
  std::vector<Index> rows;
  for (const std::size_t landmark : landmarks) {
    const Index row = JointGaussian::kPose + joint_.systematic() + 2 * static_cast<Index>(landmark);
    rows.insert(rows.end(), {row, row + 1});
  }
  return covariance()(rows, rows);
}

MappedLandmark EkfSlam::landmark(std::size_t index) const {
  const auto landmark = static_cast<int>(index);
  return {table_.id_of(landmark), joint_.landmark(index), joint_.landmark_covariance(index),
          table_.sightings(landmark)};
}

}  // namespace trundle::slam
