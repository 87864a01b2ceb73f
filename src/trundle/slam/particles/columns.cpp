#include "trundle/slam/particles/columns.hpp"

namespace trundle {

/// In place, without a copy of the column: a child above its parent is written from the top down, one below
/// from the bottom up, and neither then overwrites a parent who is still to be read.
void TripleColumns::permute(std::span<const std::uint32_t> parents) {
  for (Column<double>& column : columns_) {
    for (std::size_t i = 0; i < parents.size(); ++i)
      if (parents[i] > i) column[i] = column[parents[i]];
    for (std::size_t i = parents.size(); i-- > 0;)
      if (parents[i] < i) column[i] = column[parents[i]];
  }
}

}  // namespace trundle
