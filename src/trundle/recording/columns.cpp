#include "trundle/recording/columns.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <iterator>
#include <optional>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "trundle/io/error.hpp"
#include "trundle/io/sha256.hpp"
#include "trundle/recording/csv/detail/streams.hpp"

namespace trundle::recording {
namespace {

using NamedColumn = std::pair<std::string, std::vector<double>>;

StreamKind kind_named(std::string_view stream) {
  std::vector<std::string> names;
  for (const StreamKind kind : kStreamKinds) {
    std::string name(file_name_of(kind));
    name.resize(name.rfind('.'));
    if (name == stream) return kind;
    names.push_back(std::move(name));
  }
  throw InputError(stream, "is no stream of a recording", fmt::format("one of {}", fmt::join(names, ", ")));
}

/// The columns of the stream, of which each says what becomes of it.
std::vector<ColumnSource> sources_of(StreamKind kind, const StreamColumns& stream) {
  if (kind != StreamKind::wheels) return columns_of(kind);
  std::vector<ColumnSource> columns;
  for (const auto& [name, values] : stream.numbers)
    if (wheel_column(name)) columns.push_back({name, name});
  if (columns.empty())
    throw InputError(stream.stream, "has no column of a wheel",
                     "<wheel>_ticks, <wheel>_m or <wheel>_rad_s, named after the robot's wheels");
  keep_preferred(columns);
  return columns;
}

void require_same_length(const StreamColumns& stream, std::size_t rows) {
  const auto require = [&](const std::string& name, std::size_t length) {
    if (length != rows)
      throw InputError(stream.stream, fmt::format("column '{}' has {} rows", name, length),
                       fmt::format("{}, as the first has", rows));
  };
  for (const auto& [name, values] : stream.numbers) require(name, values.size());
  if (!stream.landmarks.empty()) require("landmark", stream.landmarks.size());
}

std::optional<std::vector<double>> taken(StreamColumns& stream, const std::string& name) {
  const auto found = std::ranges::find(stream.numbers, name, &NamedColumn::first);
  if (found == stream.numbers.end()) return std::nullopt;
  std::vector<double> values = std::move(found->second);
  for (double& value : values)
    if (!std::isfinite(value)) value = kNotMeasured;
  stream.numbers.erase(found);
  return values;
}

[[noreturn]] void refuse_missing(const StreamColumns& stream, const std::string& name) {
  std::vector<std::string> names;
  for (const auto& [column, values] : stream.numbers) names.push_back(column);
  std::ranges::copy(stream.left_out, std::back_inserter(names));
  const std::string nearest = nearest_name(name, names);
  throw InputError(stream.stream, fmt::format("has no column '{}'", name),
                   nearest.empty() ? fmt::format("it among {}", fmt::join(names, ", "))
                                   : fmt::format("'{}' in place of '{}'", name, nearest));
}

/// The bytes of the columns under their names, for the provenance.
InputFile input_of(const StreamColumns& stream) {
  Sha256 sha;
  for (const auto& [name, values] : stream.numbers) {
    sha.add(name);
    std::string bytes(values.size() * sizeof(double), '\0');
    std::memcpy(bytes.data(), values.data(), bytes.size());
    sha.add(bytes);
  }
  for (const std::string& landmark : stream.landmarks) sha.add(landmark + '\n');
  return {stream.stream, sha.hex()};
}

Table table_of(StreamColumns stream, const std::vector<ColumnSource>& sources, const std::string& stamp) {
  Table table;
  table.origin.file = stream.stream;
  auto time_s = taken(stream, stamp);
  if (!time_s) refuse_missing(stream, stamp);
  table.time_s = *std::move(time_s);
  const std::size_t rows = table.time_s.size();
  for (std::size_t row = 1; row <= rows; ++row) table.origin.lines.append(row);
  for (const ColumnSource& source : sources) {
    const bool is_text = source.kind == CellKind::text;
    if (is_text && !source.optional && stream.landmarks.empty()) refuse_missing(stream, source.column);
    table.texts.push_back(is_text ? stream.landmarks : std::vector<std::string>{});
    if (is_text) table.texts.back().resize(rows);
    auto values = is_text ? std::nullopt : taken(stream, source.column);
    if (!is_text && !values && !source.optional) refuse_missing(stream, source.column);
    table.numbers.push_back(values ? *std::move(values) : std::vector<double>(rows, kNotMeasured));
    require_plausible(table.numbers.back(), source, table.origin);
  }
  return table;
}

void take_landmarks(StreamColumns stream, Recording& recording) {
  const auto x = taken(stream, "x_m"), y = taken(stream, "y_m");
  if (!x) refuse_missing(stream, "x_m");
  if (!y) refuse_missing(stream, "y_m");
  if (stream.landmarks.size() != x->size()) refuse_missing(stream, "landmark");
  for (std::size_t row = 0; row < x->size(); ++row)
    recording.landmarks.push_back({stream.landmarks[row], {(*x)[row], (*y)[row]}});
}

}  // namespace

bool has_column(std::string_view stream, std::string_view column) {
  const StreamKind kind = kind_named(stream);
  if (kind != StreamKind::landmarks && column == stamp_column_of(kind)) return true;
  if (kind == StreamKind::wheels) return wheel_column(column).has_value();
  const std::vector<ColumnSource> columns = columns_of(kind);
  return std::ranges::find(columns, column, &ColumnSource::column) != columns.end();
}

std::vector<std::pair<std::string, const std::vector<double>*>> columns_of(const WheelStream& wheels) {
  std::vector<std::pair<std::string, const std::vector<double>*>> columns;
  for (const WheelSeries& series : wheels.series) columns.emplace_back(column_name(series), &series.value);
  for (const WheelSeries& series : wheels.steering)
    columns.emplace_back(steering_column_name(series), &series.value);
  return columns;
}

Recording recording_of(const std::string& name, std::vector<StreamColumns> streams) {
  Recording recording;
  recording.name = name;
  for (StreamColumns& columns : streams) {
    const StreamKind kind = kind_named(columns.stream);
    if (columns.numbers.empty()) refuse_missing(columns, std::string(stamp_column_of(kind)));
    require_same_length(columns, columns.numbers.front().second.size());
    note_input(input_of(columns), recording);
    if (kind == StreamKind::landmarks) {
      take_landmarks(std::move(columns), recording);
      continue;
    }
    StreamSource source;
    source.file = columns.stream;
    source.columns = sources_of(kind, columns);
    const std::string stamp(stamp_column_of(kind));
    source.time = ColumnSource{stamp, stamp};
    Table table = table_of(std::move(columns), source.columns, stamp);
    take_stream(kind, source, std::move(table), recording);
  }
  if (is_empty(recording)) throw InputError(name, "holds no samples", "at least one stream with rows");
  return recording;
}

}  // namespace trundle::recording
