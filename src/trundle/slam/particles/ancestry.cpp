#include "trundle/slam/particles/ancestry.hpp"

#include <algorithm>
#include <cassert>
#include <numeric>

namespace trundle {

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

void Ancestry::resample(std::span<const Index> parents) {
  assert(parents.size() == particles_ && std::ranges::is_sorted(parents));
  Index child = 0;
  for (Index parent = 0; parent <= particles_; ++parent) {
    while (child < particles_ && parents[child] < parent) ++child;
    first_child_[parent] = child;
  }
  for (auto at = generations_.rbegin(); at != generations_.rend(); ++at) {
    if (at->second.runs.size() == 1) break;  // one common ancestor, and so in all older epochs
    descend(at->second, at->first == now_);
  }
  ++now_;
}

/// The runs of a map after one more generation.
void Ancestry::descend(Generation& generation, bool is_youngest) const {
  const auto end = static_cast<Index>(particles_);
  std::vector<Run>& runs = generation.runs;
  if (is_youngest) {
    for (Index parent = 0; parent < end; ++parent)
      if (first_child_[parent] < first_child_[parent + 1]) runs.push_back({first_child_[parent], parent});
    return;
  }
  std::size_t kept = 0;
  for (std::size_t k = 0; k < runs.size(); ++k) {
    const Index first = first_child_[runs[k].first];
    const Index next = first_child_[k + 1 < runs.size() ? runs[k + 1].first : end];
    if (first < next) runs[kept++] = {first, runs[k].ancestor};
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

double Ancestry::kinship(Epoch epoch) const {
  if (epoch == now_ || particles_ < 2) return 0.0;
  const auto families = runs(epoch);
  double pairs = 0.0;
  for (std::size_t k = 0; k < families.size(); ++k) {
    const std::size_t end = k + 1 < families.size() ? families[k + 1].first : particles_;
    const auto members = static_cast<double>(end - families[k].first);
    pairs += members * (members - 1.0);
  }
  const auto count = static_cast<double>(particles_);
  return pairs / (count * (count - 1.0));
}

void Ancestry::write_ancestors(Epoch epoch, std::span<Index> ancestors) const {
  if (epoch == now_)
    return std::iota(ancestors.begin(), ancestors.begin() + static_cast<std::ptrdiff_t>(particles_),
                     Index{0});
  const auto of_epoch = runs(epoch);
  for (std::size_t k = 0; k < of_epoch.size(); ++k) {
    const std::size_t end = k + 1 < of_epoch.size() ? of_epoch[k + 1].first : particles_;
    for (std::size_t i = of_epoch[k].first; i < end; ++i) ancestors[i] = of_epoch[k].ancestor;
  }
}

}  // namespace trundle
