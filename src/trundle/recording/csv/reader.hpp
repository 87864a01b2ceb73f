#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "trundle/io/pieces.hpp"
#include "trundle/recording/line_map.hpp"

namespace trundle::recording {

/// In the unit of its column: beyond it nothing was measured, and sums of squares leave a double.
inline constexpr double kLargestReading = 1e9;
/// Counters run on for ever, but none has more than 64 bits.
inline constexpr double kLargestCount = 0x1p64;

struct CsvFormat {
  char delimiter = ',';        ///< ' ': any run of spaces and tabs
  char comment = '#';          ///< lines that start with it are skipped; '\0': none are
  bool header = true;          ///< the first line names the columns
  std::size_t skip_lines = 0;  ///< before that, whatever they say
  char decimal = '.';          ///< point of decimal numbers; ',' in some countries
};

/// A stamp becomes cell · 10^unit_exponent − origin_s seconds, the difference taken before rounding to
/// double.
struct TimeScale {
  int unit_exponent = 0;  ///< 0: s, −3: ms, −6: µs, −9: ns
  std::int64_t origin_s = 0;
};

enum class CellKind { number, time, text };

/// One column to read.
struct CsvColumn {
  std::size_t index = 0;  ///< 0-based
  CellKind kind = CellKind::number;
  TimeScale time = {};
};

/// The rows of a table; one entry in `numbers` or `texts` for each wanted column, in their order.
struct CsvRows {
  std::vector<std::vector<double>> numbers;  ///< NaN for empty cells, nan, null, na and inf
  std::vector<std::vector<std::string>> texts;
  LineMap lines;
  std::optional<std::size_t>
      truncated_line;  ///< the last line, when it breaks off before its last wanted cell

  std::size_t count() const { return lines.rows(); }
};

/// What follows the text that a table was made of.
struct CsvRest {
  NextText next;
  std::size_t size = 0;  ///< about, so that columns are not copied while they grow [bytes]
};

/// A table, all of it or its head: where its header and rows are. A byte-order mark, comment lines, blank
/// lines, CRLF, spaces around cells and quotes are tolerated. The text must outlive it.
class CsvTable {
 public:
  /// `file` names the place in errors. Throws InputError when the text is empty or not UTF-8, or names
  /// repeat.
  CsvTable(std::string_view text, std::string file, const CsvFormat& format);
  /// Whether the text goes so far that a table can be made of it, whatever follows.
  static bool has_head(std::string_view text, const std::string& file, const CsvFormat& format);

  const std::string& file() const { return file_; }
  const std::vector<std::string>& names() const { return names_; }
  std::size_t columns() const { return columns_; }
  std::size_t header_line() const { return header_line_; }
  std::optional<std::size_t> column_named(std::string_view name) const;
  /// The header is nothing but numbers: it may be the first row of a file without one.
  bool has_numbers_for_names() const;
  /// What recording.toml may have to say, so that the file is read as it is meant; empty: nothing comes to
  /// mind. For the expectation of an error.
  std::string meant() const;

  /// Throws InputError with file and line at a row with more or fewer cells than the header (the first row
  /// where there is none), and at text where a number should be. Numbers are the same bits as strtod's.
  /// `rest`: asked to its end.
  CsvRows read(std::span<const CsvColumn> wanted, const CsvRest& rest = {}) const;

 private:
  /// Lines of text about the file, before those with columns; 0: there seem to be none.
  std::size_t lines_before_columns() const;
  /// One that makes cells of the first line and as many of the second, and what to write; empty: none does.
  std::string other_delimiter(std::string_view among) const;
  /// What follows the first line.
  std::string_view second_line() const;

  std::string_view text_;
  std::string file_;
  CsvFormat format_;
  std::string_view first_line_;
  std::vector<std::string> names_;
  std::unordered_map<std::string, std::size_t> index_;  ///< of each name
  std::size_t columns_ = 0;
  std::size_t header_line_ = 0;
  std::size_t body_ = 0;       // offset of the first row
  std::size_t body_line_ = 1;  // its line
};

}  // namespace trundle::recording
