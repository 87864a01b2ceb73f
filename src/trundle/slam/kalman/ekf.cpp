#include "trundle/slam/kalman/ekf.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace trundle {
namespace {

constexpr std::size_t kMostTogether = 64;   // sightings whose joint gate is computed beforehand
constexpr std::size_t kMostCandidates = 8;  // landmarks that one observation may show
constexpr double kCellShare = 0.25;         // of the sensor's range: cells of the grid
constexpr double kOffGridShare = 0.05;      // of the sensor's range: then all landmarks are put there again

Matrix3 world_from_body_axes(const Pose2& pose) {
  Matrix3 R = Matrix3::Identity();
  R.topLeftCorner<2, 2>() = rotation(pose.heading);
  return R;
}

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
  const Systematic s = state_.body().systematic;
  const Pose2 after = before * motion.mean * exp(Twist2::from(motion.by_systematic * s));
  const Matrix3 R = world_from_body_axes(after);
  JointGaussian::Prediction prediction{after, Matrix3::Identity(), R * motion.by_systematic,
                                       R * motion.covariance * R.transpose()};
  prediction.F(0, 2) = -(after.y - before.y);
  prediction.F(1, 2) = after.x - before.x;
  state_.predict(prediction);
}

/// Those without names are taken for a landmark of the map that has none, or for a new one. What is neither
/// is rejected. Eq. 21, 22.
void EkfSlam::recognise() {
  nameless_.clear();
  taken_for_.assign(observations_.size(), kNone);
  for (std::size_t i = 0; i < observations_.size(); ++i)
    if (observations_[i].landmark < 0 && is_valid(observations_[i])) nameless_.push_back(i);
  if (nameless_.empty()) return;
  find_candidates();
  pair_up();
  const double least = std::log(R_.determinant()) + 2.0 * std::log(2.0 * kPi);
  const double none = 2.0 * std::log(2.0 * kPi * sensor_.max_range_m);
  const JointExplanation explanation =
      most_probable_explanations(readings_, {.none = none, .least = least, .limit = joint_limits_}).front();
  doubt_the_left_over(explanation, none);
  decide(explanation);
}

/// Landmarks near where each observation points, made active.
void EkfSlam::find_candidates() {
  if (off_grid_m_ > kOffGridShare * sensor_.max_range_m) locate_again();
  candidates_.resize(nameless_.size());
  seen_.clear();
  const Matrix3 of_pose = state_.body().covariance;
  for (std::size_t k = 0; k < nameless_.size(); ++k) {
    const SightedLandmark sighted =
        sighted_landmark(state_.pose(), sensor_.body_from_sensor, observations_[nameless_[k]]);
    const Matrix2 spread = sighted.by_pose * of_pose * sighted.by_pose.transpose() +
                           sighted.by_reading * R_ * sighted.by_reading.transpose();
    const double sigma = std::sqrt(spread.trace());
    const double radius =
        std::sqrt(options_.unknown.near * options_.unknown.gate) * 2.0 * sigma + 2.0 * off_grid_m_;
    grid_.near(sighted.in_world, radius, kMostCandidates, candidates_[k]);
    seen_.insert(seen_.end(), candidates_[k].begin(), candidates_[k].end());
  }
  std::ranges::sort(seen_);
  seen_.erase(std::unique(seen_.begin(), seen_.end()), seen_.end());
  state_.activate(seen_);
}

/// The pairings that pass the gate alone, and the covariance of all their innovations together.
void EkfSlam::pair_up() {
  readings_.observations = nameless_.size();
  readings_.pairings.clear();
  H_.clear();
  matches_.clear();
  nearest_.assign(nameless_.size(), {});
  for (std::size_t k = 0; k < nameless_.size(); ++k)
    for (const std::size_t landmark : candidates_[k]) pair(k, landmark);
  covary();
  const auto rows = 2 * static_cast<Index>(matches_.size());
  readings_.S = S_.topLeftCorner(rows, rows);
  readings_.innovation.resize(rows);
  for (std::size_t p = 0; p < matches_.size(); ++p)
    readings_.innovation.segment<2>(2 * static_cast<Index>(p)) = matches_[p].innovation;
}

/// Within the gate it may be that landmark; near it and yet not within the gate it is more often that than a
/// new one.
void EkfSlam::pair(std::size_t nameless, std::size_t landmark) {
  const std::size_t i = nameless_[nameless];
  const Index at = state_.index_of(landmark);
  const ExpectedReading expected =
      expected_reading(state_.pose(), sensor_.body_from_sensor, state_.active(at));
  const JointGaussian::Rows rows{at, expected.by_pose, expected.by_landmark};
  const Vector2 innovation = innovation_of(observations_[i], expected);
  const Matrix2 S = state_.projected_covariance(rows) + R_;
  const double nis = innovation.dot(S.inverse() * innovation);
  Nearest& nearest = nearest_[nameless];
  if (nis < nearest.nis) nearest = {innovation, nis, nearest.is_doubtful};
  if (nis > options_.unknown.gate) {
    nearest.is_doubtful = nearest.is_doubtful || nis <= options_.unknown.near * options_.unknown.gate;
    return;
  }
  readings_.pairings.push_back({nameless, landmark});
  matches_.push_back({i, landmark, innovation});
  H_.push_back(rows);
}

/// What would be a landmark that nobody else shows, if only it went together with the rest, is no new one:
/// together even honest sightings fail now and then, and the worst of them would found a phantom that takes
/// the next ones. One of a landmark that another observation shows is new: both are there.
void EkfSlam::doubt_the_left_over(const JointExplanation& explanation, double none) {
  std::vector<std::size_t> shown;
  for (const int pairing : explanation.pairing)
    if (pairing >= 0) shown.push_back(readings_.pairings[static_cast<std::size_t>(pairing)].landmark);
  for (std::size_t p = 0; p < readings_.pairings.size(); ++p) {
    if (std::ranges::find(shown, readings_.pairings[p].landmark) != shown.end()) continue;
    const auto row = 2 * static_cast<Index>(p);
    const Matrix2 S = readings_.S.block<2, 2>(row, row);
    const Vector2 innovation = readings_.innovation.segment<2>(row);
    const double cost =
        innovation.dot(S.inverse() * innovation) + std::log(S.determinant()) + 2.0 * std::log(2.0 * kPi);
    if (cost < none) nearest_[readings_.pairings[p].observation].is_doubtful = true;
  }
}

void EkfSlam::decide(const JointExplanation& explanation) {
  for (std::size_t k = 0; k < nameless_.size(); ++k) {
    const std::size_t i = nameless_[k];
    const int pairing = explanation.pairing[k];
    if (pairing >= 0)
      taken_for_[i] =
          static_cast<std::int64_t>(readings_.pairings[static_cast<std::size_t>(pairing)].landmark);
    else if (nearest_[k].is_doubtful)
      report_.observations[i] = {Decision::rejected, kUnknownLandmark, nearest_[k].innovation,
                                 nearest_[k].nis};
  }
}

/// Landmarks without names that ought to be seen become less likely where they are not.
void EkfSlam::look_around() {
  const bool has_matched = std::ranges::any_of(
      report_.observations, [](const ObservationReport& o) { return o.decision == Decision::matched; });
  const Pose2 pose = state_.pose();
  std::vector<bool> is_seen(entries_.size(), false);
  for (const std::size_t i : nameless_) {
    if (report_.observations[i].decision == Decision::rejected) continue;
    is_seen[static_cast<std::size_t>(taken_for_[i])] = true;
    visibility_.saw(observations_[i].range_m, observations_[i].bearing_rad);
  }
  if (!has_matched) return;
  std::vector<std::size_t> around;
  const Pose2 sensor = pose * sensor_.body_from_sensor;
  grid_.near(sensor.translation(), visibility_.reach_m(), entries_.size(), around);
  std::vector<std::size_t> gone;
  for (const std::size_t landmark : around) {
    const ExpectedReading expected = expected_reading(pose, sensor_.body_from_sensor, grid_.place(landmark));
    const bool may_have_been_seen =
        std::ranges::find(readings_.pairings, landmark, &Pairing::landmark) != readings_.pairings.end();
    const Existence::Look look{pose.translation(), expected.range_m, expected.bearing_rad, is_seen[landmark],
                               may_have_been_seen};
    if (!entries_[landmark].existence.look(look, visibility_)) gone.push_back(landmark);
  }
  std::ranges::sort(gone, std::greater<>());
  for (const std::size_t landmark : gone) remove(landmark);
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

/// Eq. 6: reports every match, and leaves those that pass the gate.
void EkfSlam::keep_gated() {
  std::size_t kept = 0;
  for (std::size_t k = 0; k < matches_.size(); ++k) {
    const Match& match = matches_[k];
    const auto row = 2 * static_cast<Index>(k);
    const double nis = match.innovation.dot(Matrix2(S_.block<2, 2>(row, row)).llt().solve(match.innovation));
    const bool passes = nis <= options_.gate;
    report_.observations[match.observation] = {passes ? Decision::matched : Decision::rejected,
                                               passes ? entries_[match.landmark].id : kUnknownLandmark,
                                               match.innovation, nis};
    if (!passes) continue;
    ++entries_[match.landmark].sightings;
    matches_[kept] = match;
    H_[kept++] = H_[k];
  }
  if (kept == matches_.size()) return;
  matches_.resize(kept);
  H_.resize(kept);
  covary();
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
  state_.append(sighted.in_world, sighted.by_pose, sighted.by_reading * R_ * sighted.by_reading.transpose());
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

MappedLandmark EkfSlam::landmark(std::size_t index) const {
  return {entries_[index].id, state_.landmark(index), state_.landmark_covariance(index),
          entries_[index].sightings};
}

}  // namespace trundle
