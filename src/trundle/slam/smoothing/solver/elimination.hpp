#pragma once

#include <span>
#include <utility>
#include <vector>

#include "trundle/namespaces.hpp"

namespace trundle::slam {

/// Some blocks of a symmetric matrix that are eliminated together, as one dense matrix: their columns, and
/// the rows of later blocks that are coupled with them, if only through what was eliminated before.
struct Front {
  std::vector<int> blocks;  ///< those of the columns first, then those of further rows
  std::vector<int> offset;  ///< where each begins in the front
  int column_blocks = 0;
  int columns = 0;             ///< scalars
  int size = 0;                ///< scalars, columns among them
  int parent = -1;             ///< the front that its rows go on to; −1: none
  std::vector<int> in_parent;  ///< for each of its scalar rows below the columns, where it is in the parent

  [[nodiscard]] int rows() const { return size - columns; }
};

/// Blocks of a symmetric matrix and which pairs of them are coupled.
struct BlockPattern {
  std::vector<int> sizes;  ///< rows of each block
  std::vector<std::pair<int, int>> couplings;
  int last =
      0;  ///< so many of the last blocks are eliminated last: those that nearly all others are coupled with
};

/// An order of elimination that creates few new couplings (approximate minimum degree), cut into fronts;
/// children before parents. docs/theory/smoother.md, section 'Elimination'.
[[nodiscard]] std::vector<Front> elimination_fronts(const BlockPattern& pattern);

}  // namespace trundle::slam
