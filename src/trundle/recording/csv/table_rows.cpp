#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/recording/csv/detail/streams.hpp"
#include "trundle/recording/csv/detail/table.hpp"
#include "trundle/statistics/nth_smallest.hpp"

namespace trundle::recording {
namespace {

void keep(Table& table, std::span<const std::size_t> rows) {
  const auto only = [&](auto& column) {
    if (column.empty()) return;
    for (std::size_t i = 0; i < rows.size(); ++i)
      if (rows[i] != i) column[i] = std::move(column[rows[i]]);
    column.resize(rows.size());
  };
  table.origin.lines = table.origin.lines.only(rows);
  only(table.time_s);
  for (auto& column : table.numbers) only(column);
  for (auto& column : table.texts) only(column);
}

template <typename Keeps>
void keep_where(Table& table, const Keeps& keeps) {
  std::vector<std::size_t> rows;
  for (std::size_t row = 0; row < table.time_s.size(); ++row)
    if (keeps(row)) rows.push_back(row);
  if (rows.size() < table.time_s.size()) keep(table, rows);
}

/// Counts places and reports them as one finding.
class Tally {
 public:
  explicit Tally(const Table& table) : table_(table) {}
  void add(std::size_t row) {
    if (count_++ == 0) place_ = table_.origin.place_of(row);
  }
  void report(std::vector<Finding>& findings, FindingCode code, const Payload& payload = {}) const {
    if (count_ > 0) findings.push_back({Severity::warning, code, place_, count_, {}, payload});
  }
  std::size_t count() const { return count_; }

 private:
  const Table& table_;
  std::size_t count_ = 0;
  std::string place_;
};

void drop_rows_without_stamp(Table& table, std::vector<Finding>& findings) {
  Tally found(table);
  for (std::size_t row = 0; row < table.time_s.size(); ++row)
    if (!std::isfinite(table.time_s[row])) found.add(row);
  found.report(findings, FindingCode::row_without_stamp);
  if (found.count() > 0) keep_where(table, [&](std::size_t row) { return std::isfinite(table.time_s[row]); });
}

/// Rows of a longest strictly increasing sequence of stamps: the fewest rows are dropped, so one stamp far in
/// the future costs one row and not all that follow. Of equal stamps the first is kept.
std::vector<std::size_t> longest_increasing(std::span<const double> time_s) {
  std::vector<std::size_t> last;  // last[n]: row that ends the best sequence of n + 1 rows
  std::vector<std::size_t> before(time_s.size());
  for (std::size_t row = 0; row < time_s.size(); ++row) {
    const auto at = std::lower_bound(last.begin(), last.end(), time_s[row],
                                     [&](std::size_t r, double t) { return time_s[r] < t; });
    if (at != last.end() && time_s[*at] == time_s[row]) continue;
    before[row] = at == last.begin() ? row : *std::prev(at);
    if (at == last.end()) {
      last.push_back(row);
    } else {
      *at = row;
    }
  }
  std::vector<std::size_t> rows(last.size());
  std::size_t row = last.empty() ? 0 : last.back();
  for (std::size_t n = rows.size(); n-- > 0; row = before[row]) rows[n] = row;
  return rows;
}

void count_disorder(const Table& table, std::vector<Finding>& findings, const RowRules& rules) {
  Tally repeated(table);
  Tally back(table);
  for (std::size_t row = 1; row < table.time_s.size(); ++row) {
    if (table.time_s[row] == table.time_s[row - 1] && !rules.repeated_stamps) repeated.add(row);
    if (table.time_s[row] < table.time_s[row - 1]) back.add(row);
  }
  repeated.report(findings, FindingCode::duplicate);
  const bool is_no_clock = 10 * back.count() > table.time_s.size();
  back.report(findings, FindingCode::back_step,
              payload::Disorder{.is_sorted = rules.repeated_stamps, .is_no_clock = is_no_clock});
}

void bring_into_order(Table& table, const RowRules& rules, std::vector<Finding>& findings) {
  const auto disordered = [&](double a, double b) { return rules.repeated_stamps ? b < a : b <= a; };
  if (std::adjacent_find(table.time_s.begin(), table.time_s.end(), disordered) == table.time_s.end()) return;
  count_disorder(table, findings, rules);
  if (!rules.repeated_stamps) return keep(table, longest_increasing(table.time_s));
  std::vector<std::size_t> rows(table.time_s.size());
  std::iota(rows.begin(), rows.end(), 0);
  std::stable_sort(rows.begin(), rows.end(),
                   [&](std::size_t a, std::size_t b) { return table.time_s[a] < table.time_s[b]; });
  Table sorted = table;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    sorted.time_s[i] = table.time_s[rows[i]];
    for (std::size_t c = 0; c < table.numbers.size(); ++c)
      if (!table.numbers[c].empty()) sorted.numbers[c][i] = table.numbers[c][rows[i]];
    for (std::size_t c = 0; c < table.texts.size(); ++c)
      if (!table.texts[c].empty()) sorted.texts[c][i] = table.texts[c][rows[i]];
  }
  sorted.origin.lines = table.origin.lines.only(rows);
  table = std::move(sorted);
}

/// Whether a column need not be there, and is not.
bool is_absent(const ColumnSource& source, const std::vector<double>& column) {
  return source.optional && std::ranges::all_of(column, [](double value) { return std::isnan(value); });
}

void report_empty_cells(const Table& table, const StreamSource& source, std::vector<Finding>& findings) {
  Tally found(table);
  std::vector<const std::vector<double>*> columns;
  for (std::size_t i = 0; i < table.numbers.size(); ++i)
    if (!table.numbers[i].empty() && !is_absent(source.columns[i], table.numbers[i]))
      columns.push_back(&table.numbers[i]);
  for (std::size_t row = 0; row < table.time_s.size(); ++row)
    for (const auto* const column : columns)
      if (std::isnan((*column)[row])) found.add(row);
  found.report(findings, FindingCode::cell_without_number);
}

void report_gaps(const Table& table, std::vector<Finding>& findings) {
  const double longest = longest_step(table.time_s);
  Tally found(table);
  double greatest = 0.0;
  for (std::size_t row = 1; row < table.time_s.size(); ++row) {
    const double step = table.time_s[row] - table.time_s[row - 1];
    greatest = std::max(greatest, step);
    if (step > longest) found.add(row);
  }
  found.report(findings, FindingCode::gap, payload::Excess{.farthest = greatest, .limit = longest});
}

void cut(Table& table, const StreamSource& source) {
  if (!source.start_s && !source.end_s) return;
  constexpr double kEver = std::numeric_limits<double>::infinity();
  keep_where(table, [&](std::size_t row) {
    return table.time_s[row] >= source.start_s.value_or(-kEver) &&
           table.time_s[row] <= source.end_s.value_or(kEver);
  });
}

/// Sums up counts since the row before; those of rows that are dropped later are kept in the sum. Angles of
/// steered wheels are no counts.
void accumulate(Table& table, const StreamSource& source) {
  for (std::size_t i = 0; i < table.numbers.size(); ++i) {
    const auto wheel = wheel_column(source.columns[i].column);
    if (wheel && wheel->is_steering) continue;
    double sum = 0.0;
    for (double& value : table.numbers[i]) {
      if (!std::isnan(value)) sum += value;
      value = sum;
    }
  }
}

}  // namespace

std::string StreamOrigin::place_of(std::size_t row) const {
  const std::size_t line = lines.line_of(row);
  if (line > 0) return place(file, line);
  return file.empty() ? fmt::format("row {}", row + 1) : file;
}

double median_step(std::span<const double> time_s) {
  if (time_s.size() < 2) return 0.0;
  const std::size_t steps = time_s.size() - 1;
  return nth_smallest(steps, (steps - 1) / 2, [&](std::size_t i) { return time_s[i + 1] - time_s[i]; });
}

double longest_step(std::span<const double> time_s) {
  constexpr double kShortestGap = 0.5;  // [s]: less is what a busy computer delays a row by
  return std::max(kShortestGap, 5.0 * median_step(time_s));
}

void clean(Table& table, const StreamSource& source, const RowRules& rules, std::vector<Finding>& findings) {
  if (!rules.empty_cells) report_empty_cells(table, source, findings);
  if (source.increments) accumulate(table, source);
  drop_rows_without_stamp(table, findings);
  cut(table, source);
  bring_into_order(table, rules, findings);
  if (rules.gaps) report_gaps(table, findings);
}

}  // namespace trundle::recording
