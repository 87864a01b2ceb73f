#include "trundle/slam/fastslam/ancestry.hpp"

#include <algorithm>
#include <cassert>
#include <numeric>

namespace trundle::slam {

Ancestry::Ancestry(std::size_t particles) : particles_(particles), first_child_(particles + 1) {}

void Ancestry::hold(Epoch epoch) {
  assert(epoch == now_ || generations_.contains(epoch));
  ++generations_[epoch].holders;
}

void Ancestry::release(Epoch epoch) {
  const auto at = generations_.find(epoch);
  assert(at != generations_.end());
  if (--at->second.holders == 0) generations_.erase(at);
}

void Ancestry::resample(std::span<const Index> first_child) {
  assert(first_child.size() == particles_ + 1 && std::ranges::is_sorted(first_child));
  std::ranges::copy(first_child, first_child_.begin());
  for (auto at = generations_.rbegin(); at != generations_.rend(); ++at) {
    if (at->second.runs.size() == 1) break;  // one common ancestor, and so in all older epochs
    descend(at->second, at->first == now_);
  }
  ++now_;
}

/// The runs of a map after one more generation. Who lives on is a matter of chance, so no branch asks it: a
/// run that has died out is written over by the next.
void Ancestry::descend(Generation& generation, bool is_youngest) const {
  const auto end = static_cast<Index>(particles_);
  std::vector<Run>& runs = generation.runs;
  if (is_youngest) {
    runs.resize(particles_);
    for (Index particle = 0; particle < end; ++particle) runs[particle] = {particle, particle};
  }
  std::size_t kept = 0;
  Index first = runs.empty() ? end : first_child_[runs.front().first];
  for (std::size_t k = 0; k < runs.size(); ++k) {
    const Index next = first_child_[k + 1 < runs.size() ? runs[k + 1].first : end];
    runs[kept] = {first, runs[k].ancestor};
    kept += static_cast<std::size_t>(first < next);
    first = next;
  }
  runs.resize(kept);
}

std::span<const Ancestry::Run> Ancestry::runs(Epoch epoch) const {
  return generations_.at(epoch).runs;
}

Ancestry::Index Ancestry::ancestor(Epoch epoch, Index particle) const {
  if (epoch == now_) return particle;
  const auto of_epoch = runs(epoch);
  return std::prev(std::ranges::upper_bound(of_epoch, particle, {}, &Run::first))->ancestor;
}

std::size_t Ancestry::survivors(Epoch epoch) const {
  return epoch == now_ ? particles_ : runs(epoch).size();
}

void Ancestry::write_ancestors(Epoch epoch, std::span<Index> ancestors) const {
  if (epoch == now_)
    return std::iota(ancestors.begin(), ancestors.begin() + static_cast<std::ptrdiff_t>(particles_),
                     Index{0});
  // Both ascend, so the greatest ancestor of a run's beginning so far is everyone's own: no loop over each
  // run, whose length is a matter of chance.
  const auto everyone = ancestors.first(particles_);
  std::ranges::fill(everyone, Index{0});
  for (const Run& run : runs(epoch)) everyone[run.first] = run.ancestor;
  Index greatest = 0;
  for (Index& ancestor : everyone) ancestor = greatest = std::max(greatest, ancestor);
}

}  // namespace trundle::slam
