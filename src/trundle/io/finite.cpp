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

struct Column {
  std::string name;
  bool is_text = false;
  bool is_variance = false;
};

/// As fmt and the standard library print numbers.
bool is_finite_number(std::string_view text) {
  if (text.starts_with('-')) text.remove_prefix(1);
  return !text.starts_with("nan") && !text.starts_with("inf");
}

[[noreturn]] void refuse(const std::filesystem::path& file, std::size_t line, std::string_view what,
                         std::string_view value) {
  throw CannotAnswer(
      fmt::format("{}: '{}' would be {} in line {}, which is no result; a reading, a noise or a start is out "
                  "of all proportion",
                  file.string(), what, value, line));
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

std::vector<Column> columns_of(std::string_view header) {
  std::vector<Column> columns;
  while (!header.empty()) {
    const std::string_view name = take_cell(header);
    columns.push_back({.name = std::string(name),
                       .is_text = std::ranges::find(kTextColumns, name) != kTextColumns.end(),
                       .is_variance = name == "var_xx" || name == "var_yy" || name == "var_hh"});
  }
  return columns;
}

void require_finite_rows(const std::filesystem::path& path, std::string_view content) {
  std::vector<Column> columns;
  std::size_t number = 0;
  while (!content.empty()) {
    std::string_view line = take_line(content);
    ++number;
    if (line.starts_with('#')) continue;
    if (columns.empty()) {
      columns = columns_of(line);
      continue;
    }
    for (const Column& column : columns) {
      const std::string_view cell = take_cell(line);
      if (column.is_text) continue;
      if (!is_finite_number(cell) || (column.is_variance && cell.starts_with('-') && cell != "-0"))
        refuse(path, number, column.name, cell);
    }
  }
}

/// Of lines "key = value", and of lines of numbers in lists.
void require_finite_values(const std::filesystem::path& path, std::string_view content) {
  std::size_t number = 0;
  while (!content.empty()) {
    const std::string_view line = take_line(content);
    ++number;
    if (line.starts_with('#')) continue;
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
        refuse(path, number, equals == line.npos ? "a number" : line.substr(0, line.find_first_of(" =")),
               value);
    }
  }
}

}  // namespace

void require_finite(const std::filesystem::path& path, std::string_view content) {
  const std::string kind = path.extension().string();
  if (kind == ".csv") require_finite_rows(path, content);
  if (kind == ".tum" || kind == ".toml") require_finite_values(path, content);
}

}  // namespace trundle::io
