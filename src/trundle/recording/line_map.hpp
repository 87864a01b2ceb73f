#pragma once

#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "trundle/namespaces.hpp"

namespace trundle::recording {

/// Rows to line numbers of the file. Rows follow each other except after comments, blank lines and dropped
/// rows.
class LineMap {
 public:
  void append(std::size_t line) {
    if (rows_ == 0 || line != next_) jumps_.emplace_back(rows_, line);
    next_ = line + 1;
    ++rows_;
  }
  /// 1-based; 0 when the row is not known.
  std::size_t line_of(std::size_t row) const;
  std::size_t rows() const { return rows_; }
  /// Of the kept rows alone.
  LineMap only(std::span<const std::size_t> rows) const;

 private:
  std::vector<std::pair<std::size_t, std::size_t>> jumps_;  // from this row on, counted from this line
  std::size_t rows_ = 0;
  std::size_t next_ = 0;
};

}  // namespace trundle::recording
