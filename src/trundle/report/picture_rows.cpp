#include "trundle/report/picture_rows.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace trundle::report {
namespace {

constexpr std::size_t kRowsOfAPage = 16'000;  // four for each column of pixels of a large screen
constexpr std::size_t kFewestRows = 32;       // below that a way is no longer recognised

/// Rows [begin, end) of a column: smallest, largest, one without a value.
void append_extremes(std::span<const double> column, std::size_t begin, std::size_t end,
                     std::vector<std::size_t>& rows) {
  std::size_t low = end, high = end, none = end;
  for (std::size_t i = begin; i < end; ++i) {
    if (std::isnan(column[i])) {
      none = i;
      continue;
    }
    if (low == end || column[i] < column[low]) low = i;
    if (high == end || column[i] > column[high]) high = i;
  }
  for (const std::size_t row : {low, high, none})
    if (row != end) rows.push_back(row);
}

void sort_unique(std::vector<std::size_t>& rows) {
  std::ranges::sort(rows);
  rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
}

}  // namespace

std::size_t rows_in_picture(std::size_t results) {
  return results <= 1 ? kRowsInPicture : std::max(kRowsOfAPage / results, kFewestRows);
}

std::vector<std::size_t> rows_for_picture(std::span<const std::span<const double>> columns,
                                          std::size_t most) {
  const std::size_t count = columns.empty() ? 0 : columns.front().size();
  std::vector<std::size_t> rows;
  if (count <= most) {
    rows.resize(count);
    std::iota(rows.begin(), rows.end(), std::size_t{0});
    return rows;
  }
  const std::size_t buckets = std::max<std::size_t>(1, most / (2 * columns.size()));
  rows = {0, count - 1};
  for (std::size_t bucket = 0; bucket < buckets; ++bucket)
    for (const std::span<const double> column : columns)
      append_extremes(column, count * bucket / buckets, count * (bucket + 1) / buckets, rows);
  sort_unique(rows);
  return rows;
}

}  // namespace trundle::report
