#include <array>
#include <cmath>
#include <ctime>
#include <memory>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "trundle/io/error.hpp"
#include "trundle/recording/csv/reader.hpp"

#include "recording/folder.hpp"

namespace trundle::recording {
namespace {

using testing::ElementsAre;

CsvRows read_all(std::string_view text, const CsvFormat& format = {}) {
  const CsvTable table(text, "log.csv", format);
  std::vector<CsvColumn> wanted;
  for (std::size_t i = 0; i < table.columns(); ++i) wanted.push_back({i});
  return table.read(wanted);
}

TEST(Csv, reads_columns_and_their_names) {
  const CsvTable table("a,b\n1,2\n3,4\n", "log.csv", {});
  EXPECT_THAT(table.names(), ElementsAre("a", "b"));
  const CsvColumn second{1};
  EXPECT_THAT(table.read({&second, 1}).numbers[0], ElementsAre(2, 4));
}

/// Wherever a piece ends: within a cell, a quote, a line's end, the header's preamble.
TEST(Csv, rows_are_the_same_from_a_file_that_is_read_in_pieces) {
  const std::string text =
      "\xEF\xBB\xBF# made today\r\na,b\n1,2\r\n\n# between\n\"3\",-4.25e-3\n,6\n17,18\n9,1";
  const CsvFormat format;
  const CsvTable whole(text, "log.csv", format);
  const std::array wanted = {CsvColumn{0}, CsvColumn{1}};
  const CsvRows expected = whole.read(wanted);
  const std::size_t head = text.find("1,2");
  for (std::size_t length = 1; length < text.size() - head; ++length) {
    std::size_t at = head;
    const CsvTable table(std::string_view(text).substr(0, head), "log.csv", format);
    const CsvRows rows = table.read(wanted, {[&] {
                                               const auto piece = std::string_view(text).substr(at, length);
                                               at += piece.size();
                                               return piece;
                                             },
                                             text.size() - head});
    ASSERT_EQ(rows.count(), expected.count()) << length;
    for (std::size_t column = 0; column < 2; ++column)
      EXPECT_THAT(rows.numbers[column],
                  testing::Pointwise(testing::NanSensitiveDoubleEq(), expected.numbers[column]))
          << length;
    for (std::size_t row = 0; row < rows.count(); ++row)
      EXPECT_EQ(rows.lines.line_of(row), expected.lines.line_of(row)) << length;
  }
}

TEST(Csv, a_head_ends_beyond_the_lines_from_which_a_message_is_made) {
  std::string text = "# preamble\na,b\n";
  EXPECT_FALSE(CsvTable::has_head(text, "log.csv", {}));
  for (int row = 0; row < 60; ++row) text += "1,2\n";
  EXPECT_TRUE(CsvTable::has_head(text, "log.csv", {}));
  EXPECT_FALSE(CsvTable::has_head(text, "log.csv", {.skip_lines = 50}));
  EXPECT_FALSE(CsvTable::has_head(std::string(100, '\n') + "a,b\n", "log.csv", {}));
}

/// A preamble that is longer than a piece of the file.
TEST(Csv, a_file_is_read_to_its_header_whatever_comes_before_it) {
  const test::Folder folder;
  std::string text;
  for (int line = 0; line < 20'000; ++line) text += "# a comment of the logger, line after line\n";
  text += "time_s,yaw_rate_rad_s\n";
  for (int row = 0; row < 50'000; ++row) text += fmt::format("{:.2f},{}\n", 0.01 * row, row);
  folder.write("gyro.csv", text);
  const Recording recording = read_recording(folder.path());
  ASSERT_EQ(recording.gyro.time_s.size(), 50'000);
  EXPECT_EQ(recording.gyro.yaw_rate_rad_s.back(), 49'999);
  EXPECT_EQ(recording.gyro.origin.lines.line_of(49'999), 70'001);
  EXPECT_EQ(recording.inputs.at(0).sha256, io::sha256_of(text));
}

TEST(Csv, tolerates_byte_order_mark_carriage_returns_comments_blanks_and_quotes) {
  const CsvRows rows = read_all(
      "\xEF\xBB\xBF# made today\r\n\r\n \"a\" , b\r\n1,2\r\n# between\r\n\r\n \"3\" , 4 \r\n5,6\r\n");
  EXPECT_THAT(rows.numbers[0], ElementsAre(1, 3, 5));
  EXPECT_THAT(rows.numbers[1], ElementsAre(2, 4, 6));
  EXPECT_EQ(rows.lines.line_of(0), 4);
  EXPECT_EQ(rows.lines.line_of(1), 7);
  EXPECT_EQ(rows.lines.line_of(2), 8);
  EXPECT_EQ(rows.lines.line_of(3), 0);
}

TEST(Csv, a_doubled_quote_within_quotes_is_one) {
  const CsvTable table("name,\"a \"\"b\"\"\"\n\"say \"\"x, y\"\"\",1\n\"\"\"\",2\n\"\",3\n", "log.csv", {});
  EXPECT_THAT(table.names(), ElementsAre("name", "a \"b\""));
  const std::vector<CsvColumn> both = {{0, CellKind::text, {}}, {1}};
  const CsvRows rows = table.read(both);
  EXPECT_THAT(rows.texts[0], ElementsAre("say \"x, y\"", "\"", ""));
  EXPECT_THAT(rows.numbers[1], ElementsAre(1, 2, 3));
}

TEST(Csv, skips_text_in_columns_that_nobody_wants) {
  const CsvTable table("a,note,b\n1,hello,2\n3,\"x, y\",4\n5,,6\n", "log.csv", {});
  const std::vector<CsvColumn> wanted = {{0}, {2}};
  const CsvRows rows = table.read(wanted);
  EXPECT_THAT(rows.numbers[0], ElementsAre(1, 3, 5));
  EXPECT_THAT(rows.numbers[1], ElementsAre(2, 4, 6));
}

TEST(Csv, comments_and_blank_lines_are_no_data_where_the_first_column_is_not_wanted) {
  const CsvTable table("note,t,x\n# at,1,2\na,3,4\n # at,5,6\n  \n ,7,8\n", "log.csv", {});
  const std::vector<CsvColumn> wanted = {{1}, {2}};
  const CsvRows rows = table.read(wanted);
  EXPECT_THAT(rows.numbers[0], ElementsAre(3, 7));
  EXPECT_EQ(rows.lines.line_of(1), 6);
}

TEST(Csv, a_hundred_thousand_columns_take_no_time_worth_mention) {
  constexpr int kColumns = 100'000;
  std::string names, cells;
  for (int i = 0; i < kColumns; ++i) {
    names += fmt::format("{}c{}", i > 0 ? "," : "", i);
    cells += i > 0 ? ",1" : "1";
  }
  const std::string text = names + "\n" + cells + "\n";
  const std::clock_t begin = std::clock();
  const CsvTable table(text, "log.csv", {});
  ASSERT_EQ(table.columns(), kColumns);
  for (int i = 0; i < kColumns; ++i) ASSERT_TRUE(table.column_named(fmt::format("c{}", i)));
  const CsvColumn last{kColumns - 1};
  EXPECT_THAT(table.read({&last, 1}).numbers[0], ElementsAre(1));
  // Searched one after the other, as they once were, names take half a minute.
  EXPECT_LT(std::clock() - begin, 10 * CLOCKS_PER_SEC);
}

TEST(Csv, reads_texts) {
  const CsvTable table("t,name\n1,tree\n2,\n3,\"a b\"\n", "log.csv", {});
  const std::vector<CsvColumn> wanted = {{1, CellKind::text}, {0}};
  const CsvRows rows = table.read(wanted);
  EXPECT_THAT(rows.texts[0], ElementsAre("tree", "", "a b"));
  EXPECT_THAT(rows.numbers[1], ElementsAre(1, 2, 3));
}

TEST(Csv, separates_by_runs_of_spaces_and_tabs) {
  const CsvRows rows = read_all("  1 \t 2\n3   4  \n", {.delimiter = ' ', .header = false});
  EXPECT_THAT(rows.numbers[0], ElementsAre(1, 3));
  EXPECT_THAT(rows.numbers[1], ElementsAre(2, 4));
}

TEST(Csv, separates_by_tabs_and_semicolons) {
  EXPECT_THAT(read_all("a\tb\n1\t2\n", {.delimiter = '\t'}).numbers[1], ElementsAre(2));
  EXPECT_THAT(read_all("a;b\n1;2\n", {.delimiter = ';'}).numbers[1], ElementsAre(2));
}

TEST(Csv, takes_empty_cells_and_words_for_nothing_as_not_measured) {
  const CsvRows rows = read_all("a,b\n,1\nNaN,1\nnull,1\nNA,1\ninf,1\n-inf,1\nnone,\n");
  ASSERT_EQ(rows.count(), 7);
  for (const double value : rows.numbers[0]) EXPECT_TRUE(std::isnan(value));
  EXPECT_TRUE(std::isnan(rows.numbers[1][6]));
}

TEST(Csv, a_trailing_delimiter_is_no_cell) {
  EXPECT_THAT(read_all("a,b,\n1,2,\n3,4\n").numbers[1], ElementsAre(2, 4));
}

/// Nor is a line of one empty cell a line of none: that had no last column to end at.
TEST(Csv, one_empty_cell_is_a_column) {
  const CsvTable table("\"\"\n1\n", "log.csv", {.header = false});
  ASSERT_EQ(table.columns(), 1U);
  (void)table.read({});
  const std::array wanted = {CsvColumn{0}};
  const CsvRows rows = table.read(wanted);
  ASSERT_EQ(rows.count(), 2U);
  EXPECT_TRUE(std::isnan(rows.numbers[0][0]));
  EXPECT_EQ(rows.numbers[0][1], 1.0);
}

TEST(Csv, a_last_line_that_breaks_off_is_left_out_and_told) {
  for (const char* end : {"3", "3,", "3,-", "3,1e"}) {
    const CsvRows rows = read_all(std::string("a,b,c\n1,2,3\n") + end);
    EXPECT_EQ(rows.count(), 1) << end;
    EXPECT_EQ(rows.truncated_line, 3U) << end;
  }
  const CsvRows whole = read_all("a,b\n1,2\n3,4");
  EXPECT_EQ(whole.count(), 2);
  EXPECT_FALSE(whole.truncated_line);
}

TEST(Csv, reads_nothing_beyond_the_text) {
  // Exactly as long as the text: a sanitizer sees every byte too far.
  for (const std::string text :
       {"a,b\n1,2\n3,4", "a,b\n1,2\n3,4\n", "a\n1234567", "a\n-", "a\n1.5", "a\n.", "a\n1.\r"}) {
    const std::unique_ptr<char[]> exact(new char[text.size()]);
    std::copy(text.begin(), text.end(), exact.get());
    EXPECT_LE(read_all({exact.get(), text.size()}).count(), 2) << text;
  }
}

TEST(Csv, more_rows_than_a_block_keep_their_order) {
  std::string text = "a,b\n";
  for (int i = 0; i < 5000; ++i) text += std::to_string(i) + "," + std::to_string(-i) + "\n";
  const CsvRows rows = read_all(text);
  ASSERT_EQ(rows.count(), 5000);
  for (int i = 0; i < 5000; ++i) {
    ASSERT_EQ(rows.numbers[0][static_cast<std::size_t>(i)], i);
    ASSERT_EQ(rows.numbers[1][static_cast<std::size_t>(i)], -i);
  }
}

TEST(LineMap, keeps_the_lines_of_the_rows_that_remain) {
  LineMap lines;
  for (const std::size_t line : {2U, 3U, 7U, 8U, 9U}) lines.append(line);
  const std::vector<std::size_t> rows = {0, 2, 4};
  const LineMap kept = lines.only(rows);
  EXPECT_EQ(kept.rows(), 3);
  EXPECT_EQ(kept.line_of(0), 2);
  EXPECT_EQ(kept.line_of(1), 7);
  EXPECT_EQ(kept.line_of(2), 9);
}

}  // namespace
}  // namespace trundle::recording
