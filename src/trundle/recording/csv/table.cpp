#include "trundle/recording/csv/detail/table.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <unordered_map>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "trundle/io/error.hpp"
#include "trundle/io/words.hpp"
#include "trundle/recording/csv/detail/misreadings.hpp"

namespace trundle::recording {
namespace {

/// Why a column is not in the file, and what to write instead.
[[noreturn]] void fail_without(const ColumnSource& source, const CsvTable& table) {
  const std::string where = source.place.empty() ? place(table.file(), table.header_line()) : source.place;
  const std::string meant = table.meant();
  if (source.name.empty())
    throw InputError(where,
                     fmt::format("column {} is beyond the {} of {}", source.number,
                                 counted(table.columns(), "column"), table.file()),
                     meant.empty() ? fmt::format("a number from 1 to {}", table.columns()) : meant);
  const bool native = source.place.empty();
  const std::string nearest = nearest_name(source.name, table.names());
  const std::string fact = fmt::format("{}has no column '{}'", native ? "" : table.file() + " ", source.name);
  if (!nearest.empty())
    throw InputError(
        where, fact,
        fmt::format("'{}' in place of '{}'", native ? source.name : nearest, native ? nearest : source.name));
  if (!meant.empty()) throw InputError(where, fact, meant);
  throw InputError(where, fact,
                   native ? fmt::format("a header with '{}'", source.name)
                          : fmt::format("one of {}", fmt::join(table.names(), ", ")));
}

/// The column's place in the file.
std::size_t index_of(const ColumnSource& source, const CsvTable& table) {
  if (!source.name.empty()) {
    if (const auto index = table.column_named(source.name)) return *index;
  } else if (source.number >= 1 && source.number <= table.columns()) {
    return source.number - 1;
  }
  fail_without(source, table);
}

bool is_missing(const ColumnSource& source, const CsvTable& table) {
  return source.optional && source.number == 0 && source.place.empty() && !table.column_named(source.name);
}

InputError no_column(const StreamSource& source, const CsvTable& table) {
  std::string names;
  for (const ColumnSource& column : source.columns) names += (names.empty() ? "" : " or ") + column.column;
  return InputError(source.place.empty() ? place(table.file(), table.header_line()) : source.place,
                    "has none of the stream's columns", names);
}

void add_to_all(std::vector<double>& values, double offset) {
  if (offset != 0.0)
    for (double& value : values) value += offset;
}

/// The columns to read from the file: each once, though several columns of the stream may come from it.
class Selection {
 public:
  explicit Selection(std::string place) : place_(std::move(place)) {}
  /// Returns the position of the column's cells among those that are read.
  std::size_t add(const CsvColumn& column) {
    const auto [found, is_new] = positions_.emplace(column.index, wanted_.size());
    if (is_new) wanted_.push_back(column);
    if (wanted_[found->second].kind != column.kind)
      throw InputError(place_, fmt::format("uses column {} for two kinds of values", column.index + 1),
                       "a column each for stamps, numbers and names");
    return found->second;
  }
  const std::vector<CsvColumn>& wanted() const { return wanted_; }

 private:
  std::string place_;
  std::vector<CsvColumn> wanted_;
  std::unordered_map<std::size_t, std::size_t> positions_;  // of each of the file's columns among them
};

std::string number_within(double largest) {
  return largest == kLargestCount ? "a number between -2^64 and 2^64" : "a number between -1e9 and 1e9";
}

std::vector<double> stamps_of(const StreamSource& source, std::size_t rows) {
  std::vector<double> time_s(rows);
  for (std::size_t row = 0; row < rows; ++row) time_s[row] = static_cast<double>(row) / source.rate_hz;
  return time_s;
}

/// A first row of numbers that was taken for a header: nothing else shows where columns go by number.
void report_header(const StreamSource& source, const CsvTable& csv, std::vector<Finding>& findings) {
  const auto by_name = [](const ColumnSource& column) { return !column.name.empty(); };
  if (!csv.has_numbers_for_names() || std::any_of(source.columns.begin(), source.columns.end(), by_name) ||
      (source.time && by_name(*source.time)))
    return;
  findings.push_back({.code = FindingCode::header, .place = place(csv.file(), csv.header_line())});
}

/// All rows as they are, in the stream's columns and units.
Table read_rows(const StreamSource& source, CsvFile& file, std::vector<Finding>& findings) {
  const CsvTable csv(file.head(), source.file.string(), source.format);
  Selection selection(source.place.empty() ? csv.file() : source.place);
  std::vector<std::optional<std::size_t>> positions;
  for (const ColumnSource& column : source.columns) {
    if (is_missing(column, csv)) {
      positions.emplace_back();
    } else {
      positions.emplace_back(selection.add({index_of(column, csv), column.kind, source.time_scale}));
    }
  }
  std::optional<std::size_t> time;
  if (source.time) time = selection.add({index_of(*source.time, csv), CellKind::time, source.time_scale});
  if (!source.columns.empty() && selection.wanted().size() == (time ? 1 : 0)) throw no_column(source, csv);

  report_header(source, csv, findings);
  CsvRows rows = csv.read(selection.wanted(), file.rest());
  std::vector<int> uses(selection.wanted().size());  // of each column that was read, still to come
  for (const auto& position : positions)
    if (position) ++uses[*position];
  if (time) ++uses[*time];
  if (rows.truncated_line)
    findings.push_back({.code = FindingCode::cut_off, .place = place(csv.file(), *rows.truncated_line)});
  Table table;
  const std::size_t count = rows.count();
  table.origin = {csv.file(), std::move(rows.lines), source.time_offset_s};
  const auto taken = [&](auto& column, bool last) { return last ? std::move(column) : column; };
  if (time)
    table.time_s = taken(rows.numbers[*time], --uses[*time] == 0);
  else
    table.time_s = stamps_of(source, count);
  add_to_all(table.time_s, source.time_offset_s);
  for (std::size_t i = 0; i < source.columns.size(); ++i) {
    const ColumnSource& column = source.columns[i];
    if (positions[i]) {
      const bool last = --uses[*positions[i]] == 0;
      table.numbers.push_back(taken(rows.numbers[*positions[i]], last));
      table.texts.push_back(taken(rows.texts[*positions[i]], last));
    } else {
      table.numbers.emplace_back(count, kNotMeasured);
      table.texts.emplace_back(column.kind == CellKind::text ? count : 0);
    }
    if (column.scale != 1.0)
      for (double& value : table.numbers.back()) value *= column.scale;
    require_plausible(table.numbers.back(), column, table.origin);
    if (column.kind == CellKind::time) add_to_all(table.numbers.back(), source.time_offset_s);
  }
  return table;
}

}  // namespace

/// Variances are squares and have no limit.
void require_plausible(const std::vector<double>& values, const ColumnSource& column,
                       const StreamOrigin& origin) {
  if (column.kind != CellKind::number || column.column.starts_with("var_")) return;
  const double largest = column.column.ends_with("_ticks") ? kLargestCount : kLargestReading;
  const auto beyond = std::ranges::find_if(values, [=](double value) { return std::abs(value) > largest; });
  if (beyond == values.end()) return;
  throw InputError(origin.place_of(static_cast<std::size_t>(beyond - values.begin())),
                   fmt::format("{} is {}", column.column, *beyond), number_within(largest));
}

bool is_of_log(const StreamSource& source) {
  return !source.topic.empty() || std::ranges::any_of(source.columns, [](const ColumnSource& column) {
    return !column.topic.empty();
  });
}

Table finish_table(Table rows, const StreamSource& source, const RowRules& rules,
                   std::vector<Finding>& findings) {
  clean(rows, source, rules, findings);
  check_stamps(rows, source, rules, findings);
  return rows;
}

Table read_table(const StreamSource& source, CsvFile& file, const RowRules& rules,
                 std::vector<Finding>& findings) {
  return finish_table(read_rows(source, file, findings), source, rules, findings);
}

std::optional<double> first_stamp(const StreamSource& source) {
  if (!source.time) return std::nullopt;
  // Bytes: hundreds of rows, also after a preamble; a log of gigabytes stays on the disk.
  constexpr std::size_t kHead = 65536;
  std::string head(kHead, '\0');
  std::ifstream file(source.file, std::ios::binary);
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(file.gcount()));
  head.resize(head.rfind('\n') + 1);
  const CsvTable csv(head, source.file.string(), source.format);
  const CsvColumn stamp{index_of(*source.time, csv), CellKind::time, {source.time_scale.unit_exponent, 0}};
  const CsvRows rows = csv.read({&stamp, 1});
  const auto found =
      std::find_if(rows.numbers[0].begin(), rows.numbers[0].end(), [](double t) { return std::isfinite(t); });
  if (found == rows.numbers[0].end()) return std::nullopt;
  return *found;
}

}  // namespace trundle::recording
