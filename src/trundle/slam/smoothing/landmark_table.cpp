#include "trundle/slam/smoothing/landmark_table.hpp"

#include <algorithm>
#include <iterator>

#include "trundle/slam/smoothing/nth.hpp"

namespace trundle::slam {

void LandmarkTable::add_identified(LandmarkId id) {
  entries_.push_back({.is_identified = true});
  if (const int other = with_id(id); other >= 0) entries_[nth(other)].id = next_unidentified_++;
  next_unidentified_ = std::max(next_unidentified_, id + 1);
  entries_.back().id = id;
  identified_[id] = static_cast<int>(entries_.size()) - 1;
}

void LandmarkTable::add_unidentified(const Vector2& place, const Vector2& viewpoint) {
  entries_.push_back({.id = next_unidentified_++});
  entries_.back().existence.last_viewpoint = viewpoint;
  grid_.put(entries_.size() - 1, place);
}

void LandmarkTable::merge(int kept, int gone, const FactorGraph& graph) {
  Entry& stays = entries_[nth(kept)];
  const Entry& goes = entries_[nth(gone)];
  if (goes.existence.log_odds > stays.existence.log_odds) stays.existence = goes.existence;
  merged_into_[goes.id] = stays.id;
  const int of_kept = graph.landmark_variable(kept);
  const auto with_gone = seen_with_.find(graph.landmark_variable(gone));
  if (with_gone == seen_with_.end()) return;
  for (const int other : std::vector(with_gone->second)) {
    note_together(of_kept, other);
    note_together(other, of_kept);
  }
}

void LandmarkTable::remove(int landmark, int variable) {
  if (const auto found = seen_with_.find(variable); found != seen_with_.end()) {
    for (const int other : found->second) std::erase(seen_with_[other], variable);
    seen_with_.erase(found);
  }
  grid_.remove(nth(landmark));
  const int last = static_cast<int>(entries_.size()) - 1;
  if (landmark != last) {
    entries_[nth(landmark)] = entries_.back();
    if (is_identified(landmark)) identified_[id_of(landmark)] = landmark;
    if (grid_.contains(nth(last))) {
      grid_.put(nth(landmark), grid_.place(nth(last)));
      grid_.remove(nth(last));
    }
  }
  entries_.pop_back();
}

LandmarkId LandmarkTable::id_of(int landmark) const {
  return entries_[nth(landmark)].id;
}

bool LandmarkTable::is_identified(int landmark) const {
  return entries_[nth(landmark)].is_identified;
}

bool LandmarkTable::is_confirmed(int landmark) const {
  return is_identified(landmark) || entries_[nth(landmark)].existence.is_confirmed(visibility_);
}

Existence& LandmarkTable::existence(int landmark) {
  return entries_[nth(landmark)].existence;
}

int LandmarkTable::with_id(LandmarkId id) const {
  const auto found = std::ranges::find(entries_, id, &Entry::id);
  return found == entries_.end() ? -1 : static_cast<int>(found - entries_.begin());
}

int LandmarkTable::identified(LandmarkId id) const {
  const auto found = identified_.find(id);
  return found == identified_.end() ? -1 : found->second;
}

LandmarkId LandmarkTable::merged(LandmarkId id) const {
  for (auto found = merged_into_.find(id); found != merged_into_.end(); found = merged_into_.find(id))
    id = found->second;
  return id;
}

void LandmarkTable::note_moved(int landmark, const Vector2& place) {
  if (!grid_.contains(nth(landmark))) return;
  off_grid_m_ = std::max(off_grid_m_, (place - grid_.place(nth(landmark))).norm());
}

void LandmarkTable::refresh_grid(const FactorGraph& graph) {
  grid_.clear();
  for (int i = 0; i < graph.landmarks(); ++i)
    if (!is_identified(i)) grid_.put(nth(i), graph.landmark_at(i));
  off_grid_m_ = 0.0;
}

void LandmarkTable::note_together(int variable, int other) {
  std::vector<int>& with = seen_with_[variable];
  const auto place = std::ranges::lower_bound(with, other);
  if (place == with.end() || *place != other) with.insert(place, other);
}

void LandmarkTable::note_seen_together(int first_poses, const FactorGraph& graph) {
  std::vector<std::vector<int>> seen(nth(first_poses));
  for (const SightingLink& link : graph.problem().sightings)
    if (link.pose < first_poses) seen[nth(link.pose)].push_back(link.landmark);
  for (const std::vector<int>& at_once : seen)
    for (const int a : at_once)
      for (const int b : at_once)
        if (a != b && !(is_identified(a) && is_identified(b)))
          note_together(graph.landmark_variable(a), graph.landmark_variable(b));
}

bool LandmarkTable::are_seen_together(int a, int b, const FactorGraph& graph) const {
  const auto before = seen_with_.find(graph.landmark_variable(a));
  if (before != seen_with_.end() && std::ranges::binary_search(before->second, graph.landmark_variable(b)))
    return true;
  std::vector<int> both;
  std::ranges::set_intersection(graph.poses_that_see(a), graph.poses_that_see(b), std::back_inserter(both));
  return !both.empty();
}

}  // namespace trundle::slam
