#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "trundle/recording/csv/reader.hpp"

namespace trundle::recording {

/// The line that starts at `offset`, without its end '\n'.
inline std::string_view line_at(std::string_view text, std::size_t offset) {
  const std::string_view rest = text.substr(offset);
  return rest.substr(0, rest.find('\n'));
}

/// Finds cells in whatever form they are written: the tolerant reading of lines.
class CellScanner {
 public:
  explicit CellScanner(const CsvFormat& format) : format_(format) {}

  /// Blank lines and comments.
  bool is_skipped(std::string_view line) const;
  /// Takes one cell off the front of the line; `line` becomes what follows its delimiter, or nothing (data()
  /// is null) after the last cell.
  std::string_view take(std::string_view& line) const;
  /// All cells of the line.
  std::vector<std::string> cells(std::string_view line) const;

 private:
  CsvFormat format_;
};

/// A cell's text: a quote within quotes is doubled.
std::string text_in(std::string_view cell);
/// A cell's number: NaN when it is empty, nan, null, na, n/a, none or infinite; nothing when it is other
/// text.
std::optional<double> number_in(std::string_view cell);
/// The same for a stamp.
std::optional<double> stamp_in(std::string_view cell, const TimeScale& scale);
/// nanoseconds − origin, the difference taken in integers and rounded once [s].
double seconds_of(std::int64_t nanoseconds, std::int64_t origin_s);

}  // namespace trundle::recording
