#include "trundle/slam/smoothing/solver/elimination.hpp"

#include <algorithm>

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>

#include "trundle/slam/nth.hpp"

namespace trundle::slam {
namespace {

// What a front costs however small it is, in multiplications: two to three allocations and the scattering of
// its rows, about 1 µs at 4 multiplications a ns. Decides how fronts are joined, never a result.
constexpr double kFrontCost = 4000.0;

/// The blocks in the order in which they are eliminated.
std::vector<int> elimination_order(const BlockPattern& pattern) {
  const int count = static_cast<int>(pattern.sizes.size());
  const int ordered = count - pattern.last;
  std::vector<Eigen::Triplet<double>> entries;
  for (const auto& [i, j] : pattern.couplings)
    if (std::max(i, j) < ordered) {
      entries.emplace_back(i, j, 1.0);
      entries.emplace_back(j, i, 1.0);
    }
  for (int i = 0; i < ordered; ++i) entries.emplace_back(i, i, 1.0);
  Eigen::SparseMatrix<double> graph(ordered, ordered);
  graph.setFromTriplets(entries.begin(), entries.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> permutation;
  if (ordered > 0) Eigen::AMDOrdering<int>()(graph, permutation);
  std::vector<int> order(permutation.indices().begin(), permutation.indices().end());
  for (int i = ordered; i < count; ++i) order.push_back(i);
  return order;
}

/// The elimination, block by block: in which order, and what each is coupled with when its turn comes.
struct Elimination {
  std::vector<int> order;                 ///< blocks
  std::vector<std::vector<int>> coupled;  ///< for each place in the order the later places, ascending
};

Elimination eliminate(const BlockPattern& pattern) {
  Elimination result{elimination_order(pattern), {}};
  const std::size_t count = result.order.size();
  std::vector<int> place(count);
  for (std::size_t k = 0; k < count; ++k) place[nth(result.order[k])] = static_cast<int>(k);
  result.coupled.resize(count);
  for (const auto& [i, j] : pattern.couplings) {
    const auto [first, second] = std::minmax(place[nth(i)], place[nth(j)]);
    if (first != second) result.coupled[nth(first)].push_back(second);
  }
  for (auto& coupled : result.coupled) {
    std::ranges::sort(coupled);
    coupled.erase(std::unique(coupled.begin(), coupled.end()), coupled.end());
    if (coupled.empty()) continue;
    // Eliminating a block couples all that it is coupled with; the next of them passes it on.
    auto& next = result.coupled[nth(coupled.front())];
    next.insert(next.end(), coupled.begin() + 1, coupled.end());
  }
  return result;
}

/// Multiplications of a front.
double cost(double columns, double size) {
  return columns * size * size + kFrontCost;
}

/// Fronts of one block each, amalgamated where that costs less.
class Amalgamation {
 public:
  Amalgamation(const BlockPattern& pattern, Elimination elimination)
      : sizes_(pattern.sizes), elimination_(std::move(elimination)) {
    const std::size_t count = elimination_.order.size();
    fronts_.resize(count);
    children_.resize(count);
  }

  std::vector<Front> fronts() {
    for (std::size_t k = 0; k < fronts_.size(); ++k) {
      begin(k);
      amalgamate_children(k);
      const auto& coupled = elimination_.coupled[k];
      if (!coupled.empty()) children_[nth(coupled.front())].push_back(k);
    }
    return collected();
  }

 private:
  int size_at(int place) const { return sizes_[nth(elimination_.order[nth(place)])]; }

  void begin(std::size_t k) {
    Front& front = fronts_[k];
    front.blocks = {static_cast<int>(k)};
    front.column_blocks = 1;
    front.columns = front.size = size_at(static_cast<int>(k));
    for (const int place : elimination_.coupled[k]) front.size += size_at(place);
  }

  /// Of the children those that are better eliminated together with it.
  void amalgamate_children(std::size_t k) {
    Front& front = fronts_[k];
    std::vector<std::size_t> apart;
    for (std::size_t i = 0; i < children_[k].size(); ++i) {
      const std::size_t c = children_[k][i];
      const Front& child = fronts_[c];
      const double joint = cost(front.columns + child.columns, front.size + child.columns);
      if (joint > cost(front.columns, front.size) + cost(child.columns, child.size)) {
        apart.push_back(c);
        continue;
      }
      front.blocks.insert(front.blocks.end(), child.blocks.begin(), child.blocks.end());
      front.column_blocks += child.column_blocks;
      front.columns += child.columns;
      front.size += child.columns;
      children_[k].insert(children_[k].end(), children_[c].begin(), children_[c].end());
      fronts_[c] = {};
    }
    children_[k] = std::move(apart);
  }

  /// Those that are left, numbered, with their rows.
  std::vector<Front> collected() {
    std::vector<Front> result;
    std::vector<int> number(fronts_.size(), -1);  // of the front whose columns a place belongs to
    for (std::size_t k = 0; k < fronts_.size(); ++k) {
      if (fronts_[k].blocks.empty()) continue;
      for (const int place : fronts_[k].blocks) number[nth(place)] = static_cast<int>(result.size());
      Front front = std::move(fronts_[k]);
      const auto& coupled = elimination_.coupled[k];
      front.blocks.insert(front.blocks.end(), coupled.begin(), coupled.end());
      result.push_back(std::move(front));
    }
    for (Front& front : result) {
      int offset = 0;
      for (const int place : front.blocks) {
        front.offset.push_back(offset);
        offset += size_at(place);
      }
      if (front.rows() > 0) front.parent = number[nth(front.blocks[nth(front.column_blocks)])];
    }
    for (Front& front : result) link(result, front);
    for (Front& front : result)
      for (int& block : front.blocks) block = elimination_.order[nth(block)];
    return result;
  }

  void link(const std::vector<Front>& fronts, Front& front) {
    if (front.parent < 0) return;
    const Front& parent = fronts[nth(front.parent)];
    offset_in_parent_.resize(fronts_.size());
    for (std::size_t i = 0; i < parent.blocks.size(); ++i)
      offset_in_parent_[nth(parent.blocks[i])] = parent.offset[i];
    for (std::size_t i = nth(front.column_blocks); i < front.blocks.size(); ++i)
      for (int row = 0; row < size_at(front.blocks[i]); ++row)
        front.in_parent.push_back(offset_in_parent_[nth(front.blocks[i])] + row);
  }

  const std::vector<int>& sizes_;
  Elimination elimination_;
  std::vector<Front> fronts_;  ///< by the place of the last of their columns; empty: joined to another
  std::vector<std::vector<std::size_t>> children_;
  std::vector<int> offset_in_parent_;
};

}  // namespace

std::vector<Front> elimination_fronts(const BlockPattern& pattern) {
  return Amalgamation(pattern, eliminate(pattern)).fronts();
}

}  // namespace trundle::slam
