#include "trundle/slam/smoothing/incremental/seen_together.hpp"

#include <algorithm>
#include <iterator>

#include "trundle/slam/nth.hpp"

namespace trundle::slam {

void SeenTogether::add_first(int poses, const FactorGraph& graph, const LandmarkTable& table) {
  std::vector<std::vector<int>> seen(nth(poses));
  for (const SightingLink& link : graph.problem().sightings)
    if (link.pose < poses) seen[nth(link.pose)].push_back(link.landmark);
  for (const std::vector<int>& at_once : seen)
    for (const int a : at_once)
      for (const int b : at_once)
        if (a != b && !(table.is_identified(a) && table.is_identified(b)))
          add(graph.landmark_variable(a), graph.landmark_variable(b));
}

void SeenTogether::merge(int kept, int gone) {
  const auto with_gone = with_.find(gone);
  if (with_gone == with_.end()) return;
  for (const int other : std::vector(with_gone->second)) {
    add(kept, other);
    add(other, kept);
  }
}

void SeenTogether::remove(int variable) {
  const auto found = with_.find(variable);
  if (found == with_.end()) return;
  for (const int other : found->second) std::erase(with_[other], variable);
  with_.erase(found);
}

bool SeenTogether::has(int a, int b, const FactorGraph& graph) const {
  const auto before = with_.find(graph.landmark_variable(a));
  if (before != with_.end() && std::ranges::binary_search(before->second, graph.landmark_variable(b)))
    return true;
  std::vector<int> both;
  std::ranges::set_intersection(graph.poses_that_see(a), graph.poses_that_see(b), std::back_inserter(both));
  return !both.empty();
}

void SeenTogether::add(int variable, int other) {
  std::vector<int>& with = with_[variable];
  const auto place = std::ranges::lower_bound(with, other);
  if (place == with.end() || *place != other) with.insert(place, other);
}

}  // namespace trundle::slam
