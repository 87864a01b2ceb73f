#include "trundle/recording/line_map.hpp"

#include <algorithm>
#include <iterator>

namespace trundle::recording {

std::size_t LineMap::line_of(std::size_t row) const {
  if (row >= rows_) return 0;
  const auto after = std::upper_bound(jumps_.begin(), jumps_.end(), row,
                                      [](std::size_t r, const auto& jump) { return r < jump.first; });
  const auto& [first_row, first_line] = *std::prev(after);
  return first_line + (row - first_row);
}

LineMap LineMap::only(std::span<const std::size_t> rows) const {
  LineMap kept;
  for (const std::size_t row : rows) kept.append(line_of(row));
  return kept;
}

}  // namespace trundle::recording
