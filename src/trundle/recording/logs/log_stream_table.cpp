// LogStream: the table that its rows make, and what is said of its stamps and axes.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/recording/csv/detail/cells.hpp"
#include "trundle/recording/csv/detail/quaternion.hpp"
#include "trundle/recording/logs/detail/log_stream.hpp"

namespace trundle::recording {

Table LogStream::finish(std::vector<Finding>& findings) {
  if (pending_) push_held();
  if (stamps_.empty()) refuse_empty();
  Table table;
  const std::string name = place_name();
  table.origin.file = name;
  table.origin.lines = std::move(ordinals_);
  table.origin.time_offset_s = source_.time_offset_s;
  report_stamps(findings, name);
  for (const std::int64_t stamp : stamps_)
    table.time_s.push_back(seconds_of(stamp, source_.time_scale.origin_s) + source_.time_offset_s);
  for (std::size_t i = 0; i < source_.columns.size(); ++i) take_column(i, table, findings, name);
  return table;
}

void LogStream::take_column(std::size_t i, Table& table, std::vector<Finding>& findings,
                            const std::string& name) {
  const ColumnSource& column = source_.columns[i];
  std::size_t value = first_value_[i];
  if (column.name.empty()) {
    table.numbers.emplace_back(stamps_.size(), kNotMeasured);
    table.texts.emplace_back(column.kind == CellKind::text ? stamps_.size() : 0);
    return;
  }
  double factor = column.scale;
  if (column.name.ends_with(kYaw)) take_yaw(value);
  if (column.name.ends_with(kUp) && source_.vertical) {
    take_vertical(value, *source_.vertical);
    report_axis(table, findings);
  } else if (column.name.ends_with(kUp) && up_) {
    const UpAxis::Answer up = up_->answer();
    value += up.axis;
    factor *= up.sign;
    report_axis(up, findings, name);
  }
  table.numbers.push_back(std::move(numbers_[value]));
  table.texts.push_back(std::move(texts_[value]));
  if (factor != 1.0)
    for (double& number : table.numbers.back()) number *= factor;
  require_plausible(table.numbers.back(), column, table.origin);
}

void LogStream::take_yaw(std::size_t first) {
  for (std::size_t row = 0; row < numbers_[first].size(); ++row) {
    const Quaternion q{numbers_[first][row], numbers_[first + 1][row], numbers_[first + 2][row],
                       numbers_[first + 3][row]};
    numbers_[first][row] = q.length2() > 0.0 ? yaw_of(q) : kNotMeasured;
  }
}

void LogStream::take_vertical(std::size_t first, const std::array<double, 3>& vertical) {
  for (std::size_t row = 0; row < numbers_[first].size(); ++row)
    numbers_[first][row] = vertical[0] * numbers_[first][row] + vertical[1] * numbers_[first + 1][row] +
                           vertical[2] * numbers_[first + 2][row];
}

void LogStream::report_axis(const Table& table, std::vector<Finding>& findings) const {
  const auto& [x, y, z] = *source_.vertical;
  findings.push_back({Severity::note,
                      FindingCode::gyro_axis,
                      table.origin.file,
                      1,
                      {fmt::format("({:.3g}, {:.3g}, {:.3g})", x, y, z)},
                      payload::Names{{source_.vertical_evidence}}});
}

void LogStream::report_axis(const UpAxis::Answer& up, std::vector<Finding>& findings,
                            const std::string& name) {
  const std::string axis = fmt::format("{}{}", up.sign < 0.0 ? '-' : '+', "xyz"[up.axis]);
  if (up.evidence.empty())
    findings.push_back({Severity::note, FindingCode::gyro_axis, name, 1, {axis}, {}});
  else
    findings.push_back(
        {Severity::note, FindingCode::gyro_axis, name, 1, {axis}, payload::Names{{up.evidence}}});
}

void LogStream::report_stamps(std::vector<Finding>& findings, const std::string& name) {
  if (!is_header_stamp_) return;
  if (std::ranges::all_of(stamps_, [](std::int64_t stamp) { return stamp == 0; })) {
    stamps_ = log_times_;
    findings.push_back({Severity::note, FindingCode::log_stamps, name, stamps_.size(), {}, {}});
    return;
  }
  findings.push_back(finding_of_stamps(stamps_, log_times_, name));
}

void LogStream::refuse_empty() const {
  if (messages_ == 0)
    throw InputError(source_.place, fmt::format("{} has no message", place_name()), "a topic with messages");
  throw InputError(
      source_.place,
      fmt::format("none of the {} messages of {} has the fields of the stream", messages_, place_name()),
      "paths that lead to what is in them");
}

}  // namespace trundle::recording
