#include "trundle/slam/ekf/ekf.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace trundle {
namespace {

constexpr std::size_t kMostTogether = 64;  // sightings whose joint gate is computed beforehand
constexpr double kCellShare = 0.25;        // of the sensor's range: cells of the grid

}  // namespace

EkfSlam::EkfSlam(const LandmarkSensor& sensor, const EkfSlamOptions& options)
    : sensor_(sensor),
      R_(reading_covariance(sensor)),
      options_(options),
      joint_limits_(joint_limits(options.gate, kMostTogether)),
      state_(options.prior),
      next_nameless_(options.first_nameless),
      grid_(kCellShare * sensor.max_range_m),
      visibility_(sensor.max_range_m) {}

const StepReport& EkfSlam::step(const Motion& motion, std::span<const Observation> observations) {
  predict(motion);
  report_.observations.assign(observations.size(), {});
  report_.closed_loop = false;
  observations_ = observations;
  recognise();
  open_.clear();
  for (std::size_t i = 0; i < observations_.size(); ++i)
    if (is_valid(observations_[i]) && report_.observations[i].decision != Decision::rejected)
      open_.push_back(i);
  // What creates a landmark and is followed by another sighting of the same one takes a second round.
  while (!open_.empty()) {
    match_open();
    update_matched();
    std::erase_if(open_, [&](std::size_t i) {
      if (shown_by(i) != kNone) return false;
      add_landmark(i);
      return true;
    });
  }
  if (!nameless_.empty()) look_around();
  return report_;
}

/// Eq. 5.
void EkfSlam::predict(const Motion& motion) {
  const Pose2 before = state_.pose();
  const BySystematic by_systematic = motion.by_first(state_.systematic());
  const Pose2 after = before * motion.mean * exp(Twist2::from(by_systematic * state_.body().systematic));
  const Matrix3 R = world_from_body_axes(after);
  JointGaussian::Prediction prediction{after, Matrix3::Identity(), R * by_systematic,
                                       R * motion.covariance * R.transpose()};
  prediction.F(0, 2) = -(after.y - before.y);
  prediction.F(1, 2) = after.x - before.x;
  if (state_.systematic() > 0) {
    prediction.walk = motion.walk;
    prediction.with_walk = R * motion.with_walk;
  }
  state_.predict(prediction);
}

void EkfSlam::read_bias(const BiasReading& reading) {
  if (state_.systematic() > 0) state_.read_systematic(reading.rad_s, reading.variance);
}

/// One without a name goes; the last landmark takes its number.
void EkfSlam::remove(std::size_t landmark) {
  state_.remove(landmark);
  entries_[landmark] = entries_.back();
  entries_.pop_back();
  if (landmark < entries_.size() && entries_[landmark].has_name)
    index_of_[static_cast<std::size_t>(entries_[landmark].id)] = static_cast<std::int64_t>(landmark);
  locate_again();
}

void EkfSlam::locate_again() {
  grid_.clear();
  for (std::size_t i = 0; i < entries_.size(); ++i)
    if (!entries_[i].has_name) grid_.put(i, state_.landmark(i));
  off_grid_m_ = 0.0;
}

/// Those of `open_` whose landmark is in the map become matches.
void EkfSlam::match_open() {
  matches_.clear();
  seen_.clear();
  std::erase_if(open_, [&](std::size_t i) {
    const std::int64_t landmark = shown_by(i);
    if (landmark == kNone) return false;
    seen_.push_back(static_cast<std::size_t>(landmark));
    matches_.push_back({i, seen_.back(), Vector2::Zero()});
    return true;
  });
  state_.activate(seen_);
  H_.clear();
  for (Match& match : matches_) {
    const Index at = state_.index_of(match.landmark);
    const ExpectedReading expected =
        expected_reading(state_.pose(), sensor_.body_from_sensor, state_.active(at));
    match.innovation = innovation_of(observations_[match.observation], expected);
    H_.push_back({at, expected.by_pose, expected.by_landmark});
  }
}

/// Eq. 6: reports every match, and leaves those that pass the gate. Where most fail it and agree upon another
/// pose, it is the pose that is wrong, and all of them pass: eq. 6a.
void EkfSlam::keep_gated() {
  nis_.clear();
  at_odds_.clear();
  for (std::size_t k = 0; k < matches_.size(); ++k) {
    const Match& match = matches_[k];
    const auto row = 2 * static_cast<Index>(k);
    nis_.push_back(match.innovation.dot(Matrix2(S_.block<2, 2>(row, row)).llt().solve(match.innovation)));
    if (nis_.back() > options_.gate) at_odds_.push_back(seen_and_mapped(match));
  }
  const std::optional<Pose2> moved =
      2 * at_odds_.size() > matches_.size() ? agreed_motion(at_odds_) : std::nullopt;
  if (moved) doubt_the_pose(*moved);
  std::size_t kept = 0;
  for (std::size_t k = 0; k < matches_.size(); ++k) {
    const Match& match = matches_[k];
    const bool passes = moved || nis_[k] <= options_.gate;
    report_.observations[match.observation] = {passes ? Decision::matched : Decision::rejected,
                                               passes ? entries_[match.landmark].id : kUnknownLandmark,
                                               match.innovation, nis_[k]};
    if (!passes) continue;
    ++entries_[match.landmark].sightings;
    matches_[kept] = match;
    H_[kept++] = H_[k];
  }
  report_.closed_loop = report_.closed_loop || moved;
  if (kept == matches_.size()) return;
  matches_.resize(kept);
  H_.resize(kept);
  covary();
}

/// As if it had never been known better than by the motion that takes it to where it belongs.
void EkfSlam::doubt_the_pose(const Pose2& motion) {
  const Pose2 pose = state_.pose();
  const Pose2 there = motion * pose;
  const Vector3 off(there.x - pose.x, there.y - pose.y, wrap_angle(motion.heading));
  state_.predict(
      {pose, Matrix3::Identity(), BySystematic::Zero(3, state_.systematic()), off * off.transpose()});
  covary();
}

SeenAndMapped EkfSlam::seen_and_mapped(const Match& match) const {
  const SightedLandmark sighted =
      sighted_landmark(state_.pose(), sensor_.body_from_sensor, observations_[match.observation]);
  return {sighted.in_world, state_.landmark(match.landmark), sighted.spread(R_)};
}

void EkfSlam::covary() {
  state_.cross_covariance(H_, PHt_);
  state_.projected_covariance(H_, PHt_, S_);
  for (Index row = 0; row < 2 * static_cast<Index>(H_.size()); row += 2) S_.block<2, 2>(row, row) += R_;
}

void EkfSlam::update_matched() {
  if (matches_.empty()) return;
  covary();
  keep_gated();
  if (matches_.empty()) return;
  const auto size = 2 * static_cast<Index>(matches_.size());
  if (innovation_.size() < size) innovation_.resize(2 * size);
  for (std::size_t k = 0; k < matches_.size(); ++k)
    innovation_.segment<2>(2 * static_cast<Index>(k)) = matches_[k].innovation;
  state_.update(H_, PHt_, S_, innovation_);
  for (const Match& match : matches_)
    if (grid_.contains(match.landmark)) {
      const Vector2 place = state_.landmark(match.landmark);
      off_grid_m_ = std::max(off_grid_m_, (place - grid_.place(match.landmark)).norm());
    }
}

void EkfSlam::add_landmark(std::size_t i) {
  const SightedLandmark sighted = sighted_landmark(state_.pose(), sensor_.body_from_sensor, observations_[i]);
  state_.append(sighted.in_world, sighted.by_pose, sighted.spread(R_));
  const std::size_t landmark = entries_.size();
  const bool has_name = observations_[i].landmark >= 0;
  entries_.push_back({kUnknownLandmark, 1, has_name, {0.0, state_.pose().translation()}});
  if (has_name) {
    call(landmark, observations_[i].landmark);
  } else {
    entries_[landmark].id = next_nameless_++;
    grid_.put(landmark, sighted.in_world);
    taken_for_[i] = static_cast<std::int64_t>(landmark);
  }
  report_.observations[i].decision = Decision::created;
  report_.observations[i].landmark = entries_[landmark].id;
}

/// One without a name that has this number gets another.
void EkfSlam::call(std::size_t landmark, LandmarkId name) {
  const auto nameless = std::ranges::find(entries_, name, &Entry::id);
  if (nameless != entries_.end()) nameless->id = next_nameless_++;
  next_nameless_ = std::max(next_nameless_, name + 1);
  entries_[landmark].id = name;
  const auto i = static_cast<std::size_t>(name);
  if (index_of_.size() <= i) index_of_.resize(i + 1, kNone);
  index_of_[i] = static_cast<std::int64_t>(landmark);
}

std::int64_t EkfSlam::find(LandmarkId name) const {
  const auto i = static_cast<std::size_t>(name);
  return i < index_of_.size() ? index_of_[i] : kNone;
}

std::int64_t EkfSlam::shown_by(std::size_t observation) const {
  const LandmarkId name = observations_[observation].landmark;
  return name >= 0 ? find(name) : taken_for_[observation];
}

Eigen::MatrixXd EkfSlam::map_covariance(std::span<const std::size_t> landmarks) const {
  std::vector<Index> rows;
  for (const std::size_t landmark : landmarks) {
    const Index row = JointGaussian::kPose + state_.systematic() + 2 * static_cast<Index>(landmark);
    rows.insert(rows.end(), {row, row + 1});
  }
  return covariance()(rows, rows);
}

MappedLandmark EkfSlam::landmark(std::size_t index) const {
  return {entries_[index].id, state_.landmark(index), state_.landmark_covariance(index),
          entries_[index].sightings};
}

}  // namespace trundle
