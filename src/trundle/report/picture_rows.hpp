#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "trundle/namespaces.hpp"

namespace trundle::report {

/// A picture keeps at most about so many rows of a table: many more than a screen has columns of pixels.
inline constexpr std::size_t kRowsInPicture = 40'000;

/// How many rows a picture keeps on a page of so many results. One alone is looked at closely; several share
/// what one screen can show: the least and the greatest value of two columns in each of 4000 columns of
/// pixels.
[[nodiscard]] std::size_t rows_in_picture(std::size_t results);

/// The rows that a picture of these columns needs, in order: all where there are at most `most`. Else the
/// rows are cut into equal buckets, and of each bucket those with the smallest and the largest value of every
/// column are kept (and one without a value, where there is one, for the gap), besides the first and the last
/// row of all: no peak is lost. The columns are equally long.
std::vector<std::size_t> rows_for_picture(std::span<const std::span<const double>> columns,
                                          std::size_t most = kRowsInPicture);

}  // namespace trundle::report
