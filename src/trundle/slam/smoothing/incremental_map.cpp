// IncrementalSmoother: its landmarks, and what sightings show.
#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/LU>

#include "trundle/slam/smoothing/incremental_smoother.hpp"
#include "trundle/slam/smoothing/nth.hpp"

namespace trundle::slam {
namespace {

using Eigen::Index;

}  // namespace

/// Which landmarks the sightings without an id show: the most probable explanation of all of them together.
void IncrementalSmoother::associate(std::span<const Observation> observations) {
  unidentified_.begin(observations);
  if (unidentified_.observations().empty()) return;
  if (map_.off_grid_m > kOffGridShare * problem_.sensors.front().max_range_m) refresh_grid();
  const auto near = unidentified_.candidates(estimate(), map_.grid, map_.off_grid_m);
  std::vector<Match> matches;
  for (std::size_t k = 0; k < near.size(); ++k)
    for (const std::size_t landmark : near[k])
      matches.push_back({unidentified_.observations()[k], static_cast<int>(landmark)});
  const Innovations all = innovations(matches, observations);
  std::vector<Index> rows;  // of pairings
  Index row = 0;
  for (std::size_t k = 0; k < near.size(); ++k)
    for (const std::size_t landmark : near[k]) {
      if (unidentified_.consider(k, landmark, all.innovation.segment<2>(row), all.S.block<2, 2>(row, row)))
        rows.insert(rows.end(), {row, row + 1});
      row += 2;
    }
  unidentified_.decide(all.innovation(rows), all.S(rows, rows), report_);
}

/// −1: none of the map.
int IncrementalSmoother::landmark_of(std::size_t i, const Observation& observation) const {
  if (observation.landmark < 0) return static_cast<int>(unidentified_.shown_by(i));
  const auto found = map_.number_of.find(observation.landmark);
  return found == map_.number_of.end() ? -1 : found->second;
}

/// Observation i of the step, from the last keyframe.
void IncrementalSmoother::add_sighting(std::size_t i, const Observation& observation) {
  int landmark = landmark_of(i, observation);
  if (landmark < 0) landmark = add_landmark(observation);
  if (observation.landmark < 0) unidentified_.show(i, nth(landmark));
  const std::size_t sighting = problem_.sightings.size();
  const int pose = problem_.poses - 1;
  Landmark& seen = map_.landmarks[nth(landmark)];
  report_.observations[i].landmark = seen.id;
  term_of_.push_back(add_part({Part::Kind::sighting, sighting}, {{pose_variables_.back(), seen.variable}}));
  problem_.sightings.push_back({pose, landmark, observation});
  seen.seen_from = pose;
  seen.sightings.push_back(sighting);
  if (sees_.back() < 0) sees_.back() = landmark;
  if (std::ranges::find(in_view_, seen.variable) == in_view_.end()) in_view_.push_back(seen.variable);
}

/// Its number: where the sighting shows it.
int IncrementalSmoother::add_landmark(const Observation& observation) {
  const int landmark = problem_.landmarks++;
  const Pose2& pose = at_.poses.back();
  map_.landmarks.push_back({.variable = add_unknown({Unknown::Kind::landmark, landmark},
                                                    Vector2::Constant(kMatters * linear_.way_m))});
  at_.landmarks.push_back(
      sighted_landmark(pose, problem_.sensors.front().body_from_sensor, observation).in_world);
  Landmark& added = map_.landmarks.back();
  added.is_identified = observation.landmark >= 0;
  if (added.is_identified) {
    give_id(landmark, observation.landmark);
  } else {
    added.id = map_.next_unidentified++;
    added.existence.last_viewpoint = pose_now().translation();
    map_.grid.put(nth(landmark), landmark_at(landmark));
  }
  return landmark;
}

/// An unidentified landmark that has this id gets another.
void IncrementalSmoother::give_id(int landmark, LandmarkId id) {
  const auto other = std::ranges::find(map_.landmarks, id, &Landmark::id);
  if (other != map_.landmarks.end()) other->id = map_.next_unidentified++;
  map_.next_unidentified = std::max(map_.next_unidentified, id + 1);
  map_.landmarks[nth(landmark)].id = id;
  map_.number_of[id] = landmark;
}

/// The last sighting takes its number.
void IncrementalSmoother::remove_sighting(std::size_t sighting) {
  const SightingLink gone = problem_.sightings[sighting];
  tree_.remove_term(term_of_[sighting]);
  std::erase(map_.landmarks[nth(gone.landmark)].sightings, sighting);
  if (sees_[nth(gone.pose)] == gone.landmark) sees_[nth(gone.pose)] = -1;
  const std::size_t last = problem_.sightings.size() - 1;
  if (sighting != last) {
    problem_.sightings[sighting] = problem_.sightings[last];
    term_of_[sighting] = term_of_[last];
    parts_[nth(term_of_[sighting])].index = sighting;
    std::ranges::replace(map_.landmarks[nth(problem_.sightings[sighting].landmark)].sightings, last,
                         sighting);
  }
  problem_.sightings.pop_back();
  term_of_.pop_back();
}

/// An unidentified one, with what was taken for it as far as that is in the window; the last landmark takes
/// its number.
void IncrementalSmoother::remove_landmark(int landmark) {
  while (!map_.landmarks[nth(landmark)].sightings.empty())
    remove_sighting(map_.landmarks[nth(landmark)].sightings.back());
  const int variable = map_.landmarks[nth(landmark)].variable;
  remove_from_past(variable);
  tree_.remove_variable(variable);
  unknown_of_[nth(variable)] = {Unknown::Kind::removed, 0};
  std::erase(in_view_, variable);
  map_.grid.remove(nth(landmark));
  const int last = --problem_.landmarks;
  if (landmark != last) {
    map_.landmarks[nth(landmark)] = std::move(map_.landmarks.back());
    at_.landmarks[nth(landmark)] = at_.landmarks.back();
    const Landmark& moved = map_.landmarks[nth(landmark)];
    unknown_of_[nth(moved.variable)].index = landmark;
    if (moved.is_identified) map_.number_of[moved.id] = landmark;
    for (const std::size_t sighting : moved.sightings) {
      SightingLink& link = problem_.sightings[sighting];
      link.landmark = landmark;
      if (sees_[nth(link.pose)] == last) sees_[nth(link.pose)] = landmark;
    }
    if (map_.grid.contains(nth(last))) {
      map_.grid.put(nth(landmark), map_.grid.place(nth(last)));
      map_.grid.remove(nth(last));
    }
  }
  map_.landmarks.pop_back();
  at_.landmarks.pop_back();
}

/// What was taken for the one that goes shows the other.
void IncrementalSmoother::merge(int kept, int gone) {
  Landmark& stays = map_.landmarks[nth(kept)];
  Landmark& goes = map_.landmarks[nth(gone)];
  for (const std::size_t sighting : goes.sightings) {
    SightingLink& link = problem_.sightings[sighting];
    tree_.remove_term(term_of_[sighting]);
    term_of_[sighting] =
        add_part({Part::Kind::sighting, sighting}, {{pose_variables_[nth(link.pose)], stays.variable}});
    link.landmark = kept;
    if (sees_[nth(link.pose)] == gone) sees_[nth(link.pose)] = kept;
  }
  stays.sightings.insert(stays.sightings.end(), goes.sightings.begin(), goes.sightings.end());
  stays.seen_from = std::max(stays.seen_from, goes.seen_from);
  if (goes.existence.log_odds > stays.existence.log_odds) stays.existence = goes.existence;
  goes.sightings.clear();
  stays.marginalised += goes.marginalised;
  merge_past(stays.variable, goes.variable);
  if (std::ranges::find(in_view_, stays.variable) == in_view_.end())
    std::ranges::replace(in_view_, goes.variable, stays.variable);
  map_.merged_into[goes.id] = stays.id;
  for (ObservationReport& report : report_.observations)
    if (report.landmark == goes.id) report.landmark = stays.id;
  remove_landmark(gone);
}

LandmarkId IncrementalSmoother::merged(LandmarkId id) const {
  for (auto found = map_.merged_into.find(id); found != map_.merged_into.end();
       found = map_.merged_into.find(id))
    id = found->second;
  return id;
}

/// Takes back what the last sightings make improbable: that two landmarks are two, or that one is there.
void IncrementalSmoother::revise_map() {
  if (unidentified_.observations().empty()) return;
  const std::vector<std::size_t> gone = unidentified_.update_existence(
      pose_now(), report_, map_.grid, map_.visibility,
      [this](std::size_t landmark) -> Existence& { return map_.landmarks[landmark].existence; });
  for (const std::size_t landmark : gone) remove_landmark(static_cast<int>(landmark));
  if (!gone.empty()) settle();
  while (merge_duplicates()) settle();
}

/// Landmarks in view that most probably are others of the map, all of them together, by the differences of
/// their places: docs/theory/online-smoother.md, eq. 25. As surely as a landmark is confirmed. False: there
/// are none.
bool IncrementalSmoother::merge_duplicates() {
  std::vector<Duplicate> pairs;
  JointReadings readings;
  std::vector<EliminationTree::Derivative> differences;
  std::vector<std::size_t> near;
  for (const int variable : in_view_) {
    const int a = unknown_of_[nth(variable)].index;
    const std::array<EliminationTree::Derivative, 1> itself{{{variable, 0, Matrix2::Identity()}}};
    const double sigma_m = std::sqrt(tree_.projected_covariance(itself, 2).trace());
    map_.grid.near(landmark_at(a), kDuplicateSigmas * sigma_m + map_.off_grid_m, kMostShown, near);
    for (const std::size_t n : near) {
      const int b = static_cast<int>(n);
      if (a == b || are_seen_together(a, b)) continue;
      const auto column = 2 * static_cast<Index>(pairs.size());
      differences.push_back({variable, column, Matrix2::Identity()});
      differences.push_back({map_.landmarks[n].variable, column, -Matrix2::Identity()});
      readings.pairings.push_back({readings.observations, n});
      pairs.push_back({a, b});
    }
    ++readings.observations;
  }
  if (pairs.empty()) return false;
  readings.S = tree_.projected_covariance(differences, 2 * static_cast<Index>(pairs.size()));
  readings.innovation.resize(2 * static_cast<Index>(pairs.size()));
  for (std::size_t p = 0; p < pairs.size(); ++p)
    readings.innovation.segment<2>(2 * static_cast<Index>(p)) =
        landmark_at(pairs[p].a) - landmark_at(pairs[p].b);
  const std::vector<double> limits = joint_limits(options_.gate, readings.observations);
  const std::vector<JointExplanation> explanations =
      most_probable_explanations(readings, {.none = cost_of_any_place(problem_.sensors.front().max_range_m),
                                            .limit = limits,
                                            .most = 2,
                                            .within = 2.0 * options_.unknown.existence.confirmed});
  if (explanations.size() > 1) return false;
  return merge(explanations.front(), pairs);
}

/// Those that are explained by one another. False: none is.
bool IncrementalSmoother::merge(const JointExplanation& explanation, std::span<const Duplicate> pairs) {
  std::vector<std::pair<LandmarkId, LandmarkId>> ids;  // numbers change with each that goes
  for (const int p : explanation.pairing)
    if (p >= 0)
      ids.emplace_back(map_.landmarks[nth(pairs[nth(p)].a)].id, map_.landmarks[nth(pairs[nth(p)].b)].id);
  const auto number = [&](LandmarkId id) {
    return static_cast<int>(std::ranges::find(map_.landmarks, id, &Landmark::id) - map_.landmarks.begin());
  };
  for (const auto& [first, second] : ids) {
    const int a = number(first), b = number(second);
    const bool keeps_a = map_.landmarks[nth(a)].is_identified || first < second;
    merge(keeps_a ? a : b, keeps_a ? b : a);
  }
  return !ids.empty();
}

/// Then they are two.
bool IncrementalSmoother::are_seen_together(int a, int b) const {
  const auto past = past_.seen_with.find(map_.landmarks[nth(a)].variable);
  if (past != past_.seen_with.end() &&
      std::ranges::binary_search(past->second, map_.landmarks[nth(b)].variable))
    return true;
  const auto seen_from = [&](int landmark) {
    std::vector<int> poses;
    for (const std::size_t sighting : map_.landmarks[nth(landmark)].sightings)
      poses.push_back(problem_.sightings[sighting].pose);
    std::ranges::sort(poses);
    return poses;
  };
  std::vector<int> both;
  std::ranges::set_intersection(seen_from(a), seen_from(b), std::back_inserter(both));
  return !both.empty();
}

void IncrementalSmoother::note_moved(std::span<const int> solved) {
  for (const int variable : solved) {
    const Unknown& unknown = unknown_of_[nth(variable)];
    if (unknown.kind != Unknown::Kind::landmark || !map_.grid.contains(nth(unknown.index))) continue;
    const double moved_m = (landmark_at(unknown.index) - map_.grid.place(nth(unknown.index))).norm();
    map_.off_grid_m = std::max(map_.off_grid_m, moved_m);
  }
}

void IncrementalSmoother::refresh_grid() {
  map_.grid.clear();
  for (int i = 0; i < problem_.landmarks; ++i)
    if (!map_.landmarks[nth(i)].is_identified) map_.grid.put(nth(i), landmark_at(i));
  map_.off_grid_m = 0.0;
}

}  // namespace trundle::slam
