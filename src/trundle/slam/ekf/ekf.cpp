#include "trundle/slam/ekf/ekf.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace trundle::slam {

EkfSlam::EkfSlam(const LandmarkSensor& sensor, const EkfSlamOptions& options)
    : sensor_(sensor),
      R_(reading_covariance(sensor)),
      options_(options),
      belief_(options.prior, options.first_unidentified, sensor.max_range_m, options.unknown.existence),
      unidentified_(sensor, options.unknown, options.gate) {}

const StepReport& EkfSlam::step(const Motion& motion, std::span<const Observation> observations) {
  report_.observations.assign(observations.size(), {});
  observations_ = observations;
  predict(motion, belief_);
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
    const std::int64_t landmark = landmark_of(i);
    if (landmark == EkfBelief::kNone) return false;
    in_view_.push_back(static_cast<std::size_t>(landmark));
    stacked_.matches.push_back({i, in_view_.back(), Vector2::Zero()});
    return true;
  });
  belief_.joint.activate(in_view_);
  stacked_.H.clear();
  for (EkfMatches::Match& match : stacked_.matches) {
    const Index at = belief_.joint.index_of(match.landmark);
    const ExpectedReading expected =
        expected_reading(belief_.joint.pose(), sensor_.body_from_sensor, belief_.joint.active(at));
    match.innovation = innovation_of(observations_[match.observation], expected);
    stacked_.H.push_back({at, expected.by_pose, expected.by_landmark});
  }
  return !stacked_.matches.empty();
}

/// S = H P Hᵀ + R.
void EkfSlam::set_innovation_covariance() {
  auto& [matches, H, PHt, S, innovation] = stacked_;
  belief_.joint.cross_covariance(H, PHt);
  belief_.joint.projected_covariance(H, PHt, S);
  for (Index row = 0; row < 2 * static_cast<Index>(H.size()); row += 2) S.block<2, 2>(row, row) += R_;
}

/// Eq. 6: reports every match, and leaves those that pass the gate.
void EkfSlam::gate() {
  auto& [matches, H, PHt, S, innovation] = stacked_;
  set_innovation_covariance();
  for (std::size_t k = 0; k < matches.size(); ++k) {
    const auto row = 2 * static_cast<Index>(k);
    const Vector2& nu = matches[k].innovation;
    const double nis = nu.dot(Matrix2(S.block<2, 2>(row, row)).llt().solve(nu));
    report_.observations[matches[k].observation] = {
        nis <= options_.gate ? Decision::matched : Decision::rejected, kUnknownLandmark, nu, nis};
  }
  std::size_t kept = 0;
  for (std::size_t k = 0; k < matches.size(); ++k) {
    ObservationReport& report = report_.observations[matches[k].observation];
    if (report.decision == Decision::rejected) continue;
    EkfBelief::Landmark& landmark = belief_.landmarks[matches[k].landmark];
    report.landmark = landmark.id;
    ++landmark.sightings;
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
  belief_.joint.update(H, PHt, S, innovation);
  for (const EkfMatches::Match& match : matches) note_moved(match.landmark, belief_);
}

/// Eq. 8: a new landmark for each of `open_` that shows none of the map.
void EkfSlam::augment() {
  std::erase_if(open_, [&](std::size_t i) {
    if (landmark_of(i) != EkfBelief::kNone) return false;
    const std::size_t landmark = trundle::slam::augment(observations_[i], sensor_, belief_);
    if (observations_[i].landmark < 0) unidentified_.show(i, landmark);
    report_.observations[i].decision = Decision::created;
    report_.observations[i].landmark = belief_.landmarks[landmark].id;
    return true;
  });
}

void EkfSlam::read_bias(const BiasReading& reading) {
  trundle::slam::read_bias(reading, belief_);
}

std::int64_t EkfSlam::landmark_of(std::size_t observation) const {
  const LandmarkId id = observations_[observation].landmark;
  return id >= 0 ? belief_.find(id) : unidentified_.shown_by(observation);
}

Eigen::MatrixXd EkfSlam::map_covariance(std::span<const std::size_t> landmarks) const {
  std::vector<Index> rows;
  for (const std::size_t landmark : landmarks) {
    const Index row = JointGaussian::kPose + belief_.joint.systematic() + 2 * static_cast<Index>(landmark);
    rows.insert(rows.end(), {row, row + 1});
  }
  return covariance()(rows, rows);
}

MappedLandmark EkfSlam::landmark(std::size_t index) const {
  const EkfBelief::Landmark& landmark = belief_.landmarks[index];
  return {landmark.id, belief_.joint.landmark(index), belief_.joint.landmark_covariance(index),
          landmark.sightings};
}

}  // namespace trundle::slam
