#include "trundle/report/column.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "trundle/report/picture_rows.hpp"

namespace trundle::report {
namespace {

using Rows = std::vector<std::size_t>;

TEST(Column, IsBase64OfLittleEndianFloats) {
  // 0.0f, 1.0f and −2.5f after the offset: 00000000 0000803f 000020c0.
  const std::vector<double> values = {1e9, 1e9 + 1.0, 1e9 - 2.5};
  const nlohmann::ordered_json column = column_json(values);
  EXPECT_EQ(column["offset"], 1e9);
  EXPECT_EQ(column["float32"], "AAAAAAAAgD8AACDA");
}

TEST(Column, ChosenRowsAloneAndWhatIsMissingIsNan) {
  const std::vector<double> values = {std::nan(""), 7.0, 8.0};
  const Rows rows = {0, 2};
  const nlohmann::ordered_json column = column_json(values, rows);
  EXPECT_EQ(column["offset"], 8.0);
  EXPECT_EQ(column["float32"].get<std::string>().size(), 12);
  EXPECT_EQ(column_json(std::vector<double>{})["float32"], "");
}

TEST(RowsForPicture, AllWhereTheyAreFew) {
  const std::vector<double> values = {3.0, 1.0, 2.0};
  const std::array<std::span<const double>, 1> columns = {values};
  EXPECT_EQ(rows_for_picture(columns, 3), (Rows{0, 1, 2}));
}

TEST(RowsForPicture, NoPeakAndNoGapIsLost) {
  std::vector<double> a(100'000, 0.0), b(100'000, 0.0);
  a[777] = 5.0;
  a[54'321] = -5.0;
  b[99'998] = 1.0;
  b[33'333] = std::nan("");
  const std::array<std::span<const double>, 2> columns = {a, b};
  const Rows rows = rows_for_picture(columns, 1000);
  EXPECT_LT(rows.size(), 2000);
  EXPECT_TRUE(std::ranges::is_sorted(rows));
  for (const std::size_t row : {0, 777, 33'333, 54'321, 99'998, 99'999})
    EXPECT_TRUE(std::ranges::binary_search(rows, row)) << row;
}

TEST(PictureRows, ResultsOnOnePageShareWhatAScreenShows) {
  EXPECT_EQ(rows_in_picture(1), kRowsInPicture);
  for (const std::size_t results : {2U, 20U, 200U})
    EXPECT_LE(results * rows_in_picture(results), 2 * rows_in_picture(2)) << results;
  EXPECT_GE(rows_in_picture(100'000), 2U);
}

}  // namespace
}  // namespace trundle::report
