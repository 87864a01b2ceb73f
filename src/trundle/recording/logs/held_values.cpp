#include "trundle/recording/logs/detail/held_values.hpp"

#include <algorithm>
#include <utility>

namespace trundle::recording {
namespace {

/// The stamps to be, each with the row that it is or repeats.
std::vector<std::pair<double, std::size_t>> filled(const std::vector<double>& time_s) {
  constexpr double kLongest_s =
      0.1;  // between rows of a rest: shorter than any gap, and as often as a rest needs
  // A robot that rests is not logged for a day: what lasts longer is a clock that jumped, and stays a gap.
  constexpr double kLongestInAll_s = 86'400.0;
  const double usual_s = median_step(time_s);
  const double step_s = std::max(usual_s, kLongest_s);
  double left_s = kLongestInAll_s;
  std::vector<std::pair<double, std::size_t>> rows;
  for (std::size_t row = 0; row < time_s.size(); ++row) {
    const double rest_s = row > 0 ? time_s[row] - time_s[row - 1] : 0.0;
    if (rest_s > 2.0 * usual_s && rest_s < left_s) {
      left_s -= rest_s;
      const double last_s = time_s[row] - usual_s;  // the cycle before the change
      for (double k = 1.0; time_s[row - 1] + k * step_s < last_s; ++k)
        rows.emplace_back(time_s[row - 1] + k * step_s, row - 1);
      rows.emplace_back(last_s, row - 1);
    }
    rows.emplace_back(time_s[row], row);
  }
  return rows;
}

}  // namespace

void hold_between_changes(StreamKind kind, const StreamSource& source, Table& rows,
                          std::vector<Finding>& findings) {
  const bool is_of_events = kind == StreamKind::sightings || kind == StreamKind::relative_motion;
  if (is_of_events || source.increments || !std::ranges::is_sorted(rows.time_s)) return;
  const auto wanted = filled(rows.time_s);
  Table held;
  held.origin = {rows.origin.file, {}, rows.origin.time_offset_s};
  for (const auto& [time_s, row] : wanted) {
    held.time_s.push_back(time_s);
    held.origin.lines.append(rows.origin.lines.line_of(row));
  }
  for (std::size_t i = 0; i < rows.numbers.size(); ++i) {
    std::vector<double>& column = held.numbers.emplace_back();
    for (const auto& [time_s, row] : wanted) column.push_back(rows.numbers[i][row]);
  }
  held.texts.resize(rows.texts.size());
  if (wanted.size() > rows.time_s.size())
    findings.push_back({Severity::note,
                        FindingCode::held_values,
                        rows.origin.file,
                        wanted.size() - rows.time_s.size(),
                        {},
                        {}});
  rows = std::move(held);
}

}  // namespace trundle::recording
