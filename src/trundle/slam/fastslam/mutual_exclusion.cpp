#include "trundle/slam/fastslam/mutual_exclusion.hpp"

#include <algorithm>

namespace trundle::slam {
namespace {

bool share_a_candidate(const Hypotheses& a, const Hypotheses& b) {
  return std::ranges::any_of(a.candidates, [&](const Candidate& one) {
    return std::ranges::find(b.candidates, one.landmark, &Candidate::landmark) != b.candidates.end();
  });
}

/// Within the gate of a landmark that another sighting shows it is not ambiguous: both are there.
bool is_ambiguous(const Hypotheses& sighting, std::size_t particle) {
  for (std::size_t c = 0; c < sighting.candidates.size(); ++c)
    if (sighting.costs_of(c)[particle] == kNear) return true;
  return false;
}

}  // namespace

void MutualExclusion::apply(std::span<Hypotheses* const> sightings, std::size_t particles) {
  group_by_candidates(sightings);
  for (std::size_t number = 0; number < sightings.size(); ++number) {
    group_.clear();
    for (std::size_t k = 0; k < sightings.size(); ++k)
      if (group_of_[k] == number) group_.push_back(sightings[k]);
    if (group_.size() < 2 || !find_conflicts(particles)) continue;
    set_up_costs();
    for (std::size_t i = 0; i < particles; ++i)
      if (conflict_[i] != 0) decide_together(i);
  }
}

/// Sightings that may show the same landmark come into one group.
void MutualExclusion::group_by_candidates(std::span<Hypotheses* const> sightings) {
  group_of_.clear();
  for (std::size_t k = 0; k < sightings.size(); ++k) {
    group_of_.push_back(k);
    for (std::size_t j = 0; j < k; ++j)
      if (group_of_[j] != group_of_[k] && share_a_candidate(*sightings[j], *sightings[k]))
        std::ranges::replace(group_of_, std::size_t{group_of_[j]}, group_of_[k]);
  }
}

/// In the group: particles that have taken two sightings for the same landmark. False: none.
bool MutualExclusion::find_conflicts(std::size_t particles) {
  conflict_.assign(particles, 0);
  for (std::size_t k = 1; k < group_.size(); ++k)
    for (std::size_t j = 0; j < k; ++j) {
      const std::int32_t* const one = group_[j]->choices.data();
      const std::int32_t* const other = group_[k]->choices.data();
      for (std::size_t i = 0; i < particles; ++i)
        conflict_[i] |=
            static_cast<std::int32_t>(one[i] == other[i]) & static_cast<std::int32_t>(one[i] >= 0);
    }
  return std::ranges::find(conflict_, 1) != conflict_.end();
}

// Eq. 21: a column for each landmark, and one for each sighting that stands for 'none of them'.
void MutualExclusion::set_up_costs() {
  landmarks_.clear();
  entries_.clear();
  for (std::size_t row = 0; row < group_.size(); ++row)
    for (std::size_t c = 0; c < group_[row]->candidates.size(); ++c) {
      const LandmarkId landmark = group_[row]->candidates[c].landmark;
      const auto column = std::ranges::find(landmarks_, landmark) - landmarks_.begin();
      if (column == std::ssize(landmarks_)) landmarks_.push_back(landmark);
      entries_.push_back({static_cast<Eigen::Index>(row), column, group_[row]->costs_of(c)});
    }
  const auto rows = std::ssize(group_);
  cost_.setConstant(rows, std::ssize(landmarks_) + rows, kFar);
  cost_.rightCols(rows).diagonal().setConstant(cost_of_new_);
}

void MutualExclusion::decide_together(std::size_t particle) {
  for (const Entry& entry : entries_) cost_(entry.row, entry.column) = entry.costs[particle];
  const std::vector<Eigen::Index>& chosen = assignment_.solve(cost_);
  for (std::size_t row = 0; row < group_.size(); ++row) {
    Hypotheses& sighting = *group_[row];
    if (chosen[row] < std::ssize(landmarks_))
      sighting.choices[particle] =
          static_cast<std::int32_t>(landmarks_[static_cast<std::size_t>(chosen[row])]);
    else
      sighting.choices[particle] = is_ambiguous(sighting, particle) ? kAmbiguousLandmark : kNewLandmark;
  }
}

}  // namespace trundle::slam
