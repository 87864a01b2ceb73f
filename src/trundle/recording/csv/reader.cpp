#include "trundle/recording/csv/reader.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/recording/csv/detail/cells.hpp"

namespace trundle::recording {
namespace {

constexpr std::size_t kMostLines = 50;  // of a preamble: an error message is no reason to read all of a log

std::string_view without_byte_order_mark(std::string_view text, const std::string& file) {
  if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF"))
    throw InputError(file, "is UTF-16 text", "UTF-8 or ASCII text");
  return text.starts_with("\xEF\xBB\xBF") ? text.substr(3) : text;
}

}  // namespace

CsvTable::CsvTable(std::string_view text, std::string file, const CsvFormat& format)
    : text_(without_byte_order_mark(text, file)), file_(std::move(file)), format_(format) {
  const CellScanner scanner(format);
  while (body_ < text_.size() &&
         (body_line_ <= format.skip_lines || scanner.is_skipped(line_at(text_, body_)))) {
    body_ += line_at(text_, body_).size() + 1;
    ++body_line_;
  }
  if (body_ >= text_.size())
    throw InputError(file_, "is empty", format.header ? "a header and rows" : "rows");
  first_line_ = line_at(text_, body_);
  names_ = scanner.cells(first_line_);
  if (names_.size() > 1 && names_.back().empty()) names_.pop_back();  // a trailing delimiter
  columns_ = names_.size();
  header_line_ = body_line_;
  if (!format.header) {
    names_.clear();
    return;
  }
  body_ = std::min(text_.size(), body_ + first_line_.size() + 1);
  ++body_line_;
  for (std::size_t i = 0; i < names_.size(); ++i)
    if (!index_.emplace(names_[i], i).second)
      throw InputError(place(file_, header_line_), fmt::format("names the column '{}' twice", names_[i]),
                       has_numbers_for_names() ? meant() : "every column once");
}

bool CsvTable::has_head(std::string_view text, const std::string& file, const CsvFormat& format) {
  const CellScanner scanner(format);
  std::size_t lines = 0;  // from the header on
  std::string_view rest = without_byte_order_mark(text, file);
  for (std::size_t line = 1, end = rest.find('\n'); end != rest.npos; ++line, end = rest.find('\n')) {
    if (lines > 0 || (line > format.skip_lines && !scanner.is_skipped(rest.substr(0, end)))) ++lines;
    if (lines > kMostLines + 1) return true;
    rest.remove_prefix(end + 1);
  }
  return false;
}

bool CsvTable::has_numbers_for_names() const {
  return !names_.empty() && std::ranges::all_of(names_, [](const std::string& name) {
    const auto value = number_in(name);
    return value && !std::isnan(*value);
  });
}

std::string_view CsvTable::second_line() const {
  const auto end = static_cast<std::size_t>(first_line_.data() + first_line_.size() - text_.data());
  return end + 1 < text_.size() ? line_at(text_, end + 1) : std::string_view();
}

std::size_t CsvTable::lines_before_columns() const {
  const CellScanner scanner(format_);
  std::size_t at = body_;
  for (std::size_t line = body_line_; line < header_line_ + kMostLines && at < text_.size(); ++line) {
    const std::string_view text = line_at(text_, at);
    if (!scanner.is_skipped(text) && scanner.cells(text).size() > columns_) return line - 1;
    at += text.size() + 1;
  }
  return 0;
}

std::string CsvTable::other_delimiter(std::string_view among) const {
  if (columns_ > 1) return {};
  for (const char delimiter : among) {
    CsvFormat other = format_;
    other.delimiter = delimiter;
    const CellScanner scanner(other);
    const std::size_t cells = scanner.cells(first_line_).size();
    const std::string_view second = second_line();
    if (cells > 1 && (second.empty() || scanner.cells(second).size() == cells))
      return fmt::format("delimiter = \"{}\" in recording.toml, by which the first line has {} cells",
                         delimiter == ' '    ? "whitespace"
                         : delimiter == '\t' ? "\\t"
                                             : std::string(1, delimiter),
                         cells);
  }
  return {};
}

std::string CsvTable::meant() const {
  if (std::string delimiter = other_delimiter(";\t,|"); !delimiter.empty()) return delimiter;
  if (has_numbers_for_names())
    return "header = false in recording.toml and columns by number, as the first line holds numbers";
  if (const std::size_t lines = lines_before_columns(); lines > 0)
    return fmt::format("skip_lines = {} in recording.toml, as line {} is the first with more columns", lines,
                       lines + 1);
  return other_delimiter(" ");  // last: words have spaces, too
}

std::optional<std::size_t> CsvTable::column_named(std::string_view name) const {
  const auto found = index_.find(std::string(name));
  if (found == index_.end()) return std::nullopt;
  return found->second;
}

}  // namespace trundle::recording
