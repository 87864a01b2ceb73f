#include "trundle/io/finite.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "trundle/io/error.hpp"

namespace trundle::io {
namespace {

/// Columns of names and words. All others hold numbers, or nothing.
constexpr std::array kTextColumns = {"landmark", "wheel", "kind", "axis", "decision", "phase"};

/// As fmt and the standard library print numbers.
bool is_finite_number(std::string_view text) {
  if (text.starts_with('-')) text.remove_prefix(1);
  return !text.starts_with("nan") && !text.starts_with("inf");
}

std::string_view take_line(std::string_view& text) {
  const std::string_view line = text.substr(0, text.find('\n'));
  text.remove_prefix(std::min(text.size(), line.size() + 1));
  return line;
}

/// Where a cell ends that a line begins with; text in quotes may hold commas, and quotes twice.
std::size_t end_of_cell(std::string_view line) {
  std::size_t end = 0;
  while (end < line.size() && line[end] == '"')
    if (const std::size_t quote = line.find('"', end + 1); quote == line.npos)
      return line.size();
    else
      end = quote + 1;
  return std::min(line.find(',', end), line.size());
}

/// Takes it off the line.
std::string_view take_cell(std::string_view& line) {
  const std::string_view cell = line.substr(0, end_of_cell(line));
  line.remove_prefix(std::min(line.size(), cell.size() + 1));
  return cell;
}

}  // namespace

FiniteNumbers::FiniteNumbers(const std::filesystem::path& path)
    : path_(path), kind_(path.extension().string()) {}

void FiniteNumbers::require_in(std::string_view lines) {
  while (!lines.empty()) {
    const std::string_view line = take_line(lines);
    ++line_;
    if (line.starts_with('#')) continue;
    if (kind_ == ".csv") require_row(line);
    if (kind_ == ".tum" || kind_ == ".toml") require_values(line);
  }
}

void FiniteNumbers::refuse(std::string_view what, std::string_view value) const {
  throw CannotAnswer(
      fmt::format("{}: '{}' would be {} in line {}, which is no result; a reading, a noise or a start is out "
                  "of all proportion",
                  path_.string(), what, value, line_));
}

void FiniteNumbers::read_header(std::string_view line) {
  while (!line.empty()) {
    const std::string_view name = take_cell(line);
    columns_.push_back({.name = std::string(name),
                        .is_text = std::ranges::find(kTextColumns, name) != kTextColumns.end(),
                        .is_variance = name == "var_xx" || name == "var_yy" || name == "var_hh"});
  }
}

void FiniteNumbers::require_row(std::string_view line) {
  if (columns_.empty()) return read_header(line);
  for (const Column& column : columns_) {
    const std::string_view cell = take_cell(line);
    if (column.is_text) continue;
    if (!is_finite_number(cell) || (column.is_variance && cell.starts_with('-') && cell != "-0"))
      refuse(column.name, cell);
  }
}

/// Of lines "key = value", and of lines of numbers in lists.
void FiniteNumbers::require_values(std::string_view line) const {
  const std::size_t equals = line.find('=');
  std::string_view values = line;
  if (equals != line.npos) values.remove_prefix(equals + 1);
  values = values.substr(0, values.find_first_of("\"'#"));  // text holds no numbers
  while (!values.empty()) {
    const std::size_t start = std::min(values.find_first_not_of(" [,]\t"), values.size());
    values.remove_prefix(start);
    const std::string_view value = values.substr(0, values.find_first_of(" ,]"));
    values.remove_prefix(value.size());
    if (!is_finite_number(value))
      refuse(equals == line.npos ? "a number" : line.substr(0, line.find_first_of(" =")), value);
  }
}

void require_finite(const std::filesystem::path& path, std::string_view content) {
  FiniteNumbers(path).require_in(content);
}

}  // namespace trundle::io
