#include "trundle/recording/csv/detail/recording_map.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <limits>
#include <map>
#include <regex>
#include <set>

#include <fmt/format.h>

#include "trundle/chassis/detail/parse_toml.hpp"
#include "trundle/io/error.hpp"
#include "trundle/recording/csv/detail/partial_reference.hpp"
#include "trundle/recording/csv/detail/toml_reader.hpp"
#include "trundle/recording/csv/units.hpp"

namespace trundle::recording {
namespace {

namespace fs = std::filesystem;

char delimiter_in(TomlReader& table) {
  const std::string text = table.text("delimiter").value_or(",");
  if (text == "whitespace" || text == " ") return ' ';
  if (text.size() != 1 || text == "\n" || text == "\"")
    table.fail("delimiter", fmt::format("delimiter is '{}'", text), "one character or \"whitespace\"");
  return text[0];
}

CsvFormat format_in(TomlReader& table) {
  CsvFormat format;
  format.delimiter = delimiter_in(table);
  format.header = table.boolean("header").value_or(true);
  const std::int64_t skipped = table.integer("skip_lines").value_or(0);
  if (skipped < 0) table.fail("skip_lines", fmt::format("skip_lines is {}", skipped), "0 or more");
  format.skip_lines = static_cast<std::size_t>(skipped);
  const std::string decimal = table.text("decimal").value_or(".");
  if (decimal != "." && decimal != ",")
    table.fail("decimal", fmt::format("decimal is '{}'", decimal), "\".\" or \",\"");
  format.decimal = decimal[0];
  if (format.decimal == format.delimiter)
    table.fail("decimal", "decimal and delimiter are the same", "a delimiter like \";\"");
  const std::string comment = table.text("comment").value_or("#");
  if (comment.size() > 1)
    table.fail("comment", fmt::format("comment is '{}'", comment), "one character, or \"\" for none");
  format.comment = comment.empty() ? '\0' : comment[0];
  return format;
}

int unit_exponent_in(TomlReader& table) {
  constexpr std::array<std::pair<std::string_view, int>, 4> kUnits = {
      {{"s", 0}, {"ms", -3}, {"us", -6}, {"ns", -9}}};
  const std::string unit = table.text("time_unit").value_or("s");
  for (const auto& [name, exponent] : kUnits)
    if (name == unit) return exponent;
  table.fail("time_unit", fmt::format("time_unit is '{}'", unit), "\"s\", \"ms\", \"us\" or \"ns\"");
}

/// Where a column comes from: "name", its number, or { column = ..., unit = ..., scale = ..., sign = ... }.
ColumnSource column_in(TomlReader& columns, const std::string& key, bool header) {
  ColumnSource source;
  source.column = key;
  source.place = columns.place_of(key);
  const toml::node* const node = columns.node(key);
  const auto take = [&](const toml::node& where, TomlReader& table, const std::string& name) {
    if (where.is_string()) {
      source.name = *where.value<std::string>();
      if (!header)
        table.fail(name, fmt::format("names the column '{}' of a file without header", source.name),
                   "the column's number, from 1");
      if (source.name.empty())
        table.fail(name, "the column's name is empty", "a name of the header, or a number");
    } else if (where.is_integer() && *where.value<std::int64_t>() >= 1) {
      source.number = static_cast<std::size_t>(*where.value<std::int64_t>());
    } else {
      table.fail(name, fmt::format("'{}' is no column", name),
                 "a column's name in quotes, its number from 1, or { column = ... }");
    }
  };
  if (!node->is_table()) {
    take(*node, columns, key);
    return source;
  }
  TomlReader table = *columns.table(key);
  const toml::node* const column = table.node("column");
  if (column == nullptr) table.fail("", "has no key 'column'", "column = \"name\" or its number");
  take(*column, table, "column");
  if (const auto unit = table.text("unit")) {
    const auto factor = factor_of(*unit, key);
    if (!factor) table.fail("unit", fmt::format("unit '{}' does not fit {}", *unit, key), units_for(key));
    source.scale *= *factor;
  }
  source.scale *= table.number("scale").value_or(1.0);
  if (source.scale == 0.0) table.fail("scale", "scale is 0", "a number other than 0");
  const double sign = table.number("sign").value_or(1.0);
  if (std::abs(sign) != 1.0) table.fail("sign", fmt::format("sign is {}", sign), "1 or -1");
  source.scale *= sign;
  table.check_keys();
  return source;
}

void take_wheel_columns(TomlReader& columns, bool header, StreamSource& source) {
  for (const std::string& key : columns.keys())
    if (wheel_column(key)) source.columns.push_back(column_in(columns, key, header));
  if (source.columns.empty())
    columns.fail("", "names no column of a wheel", "<wheel>_ticks, <wheel>_rad, <wheel>_m or <wheel>_rad_s");
  keep_preferred(source.columns);
}

void take_columns(StreamKind kind, TomlReader& columns, bool header, StreamSource& source) {
  for (ColumnSource column : columns_of(kind)) {
    if (columns.has(column.column)) {
      const CellKind cells = column.kind;
      column = column_in(columns, column.column, header);
      column.kind = cells;
    } else if (!column.optional) {
      columns.fail("", fmt::format("has no key '{}'", column.column),
                   fmt::format("{} = the file's column", column.column));
    }
    columns.node(column.column);
    source.columns.push_back(column);
  }
}

void take_time(StreamKind kind, TomlReader& table, TomlReader& columns, StreamSource& source) {
  const std::string stamp(stamp_column_of(kind));
  source.time_scale.unit_exponent = unit_exponent_in(table);
  source.time_offset_s = table.number("time_offset_s").value_or(0.0);
  source.start_s = table.number("start_s");
  source.end_s = table.number("end_s");
  if (source.start_s && source.end_s && *source.start_s >= *source.end_s)
    table.fail("end_s", fmt::format("the cut from {} s to {} s is empty", *source.start_s, *source.end_s),
               "end_s after start_s");
  const auto rate_hz = table.number_above_zero("rate_hz");
  const bool stamped = columns.node(stamp) != nullptr;
  if (stamped && rate_hz)
    table.fail("rate_hz", fmt::format("gives rate_hz besides columns.{}", stamp), "one of them");
  if (!stamped && !rate_hz)
    table.fail("columns", fmt::format("gives neither columns.{} nor rate_hz", stamp),
               "a column of stamps, or the rate of the rows");
  if (stamped) source.time = column_in(columns, stamp, source.format.header);
  source.rate_hz = rate_hz.value_or(0.0);
}

/// A column that is written beside `columns` and not under it.
void refuse_stray_columns(StreamKind kind, const TomlReader& table) {
  const std::vector<ColumnSource> known = columns_of(kind);
  for (const std::string& key : table.keys()) {
    if (key == "start_s" || key == "end_s") continue;  // the cut
    const bool is_column = key == "time_s" ||
                           std::ranges::find(known, key, &ColumnSource::column) != known.end() ||
                           (kind == StreamKind::wheels && wheel_column(key));
    if (is_column) table.fail(key, fmt::format("unknown key '{}'", key), fmt::format("'columns.{}'", key));
  }
}

bool has_star(const std::string& file) {
  return file.find('*') != std::string::npos;
}

/// What the stars of a pattern stand for in a file's name, joined by "_"; nothing: it does not match. A star
/// stands for at least one character.
std::optional<std::string> run_named(const std::string& name, const std::string& pattern) {
  std::string expression;
  for (const char c : pattern) {
    if (c == '*')
      expression += "(.+?)";
    else if (std::isalnum(static_cast<unsigned char>(c)) != 0)
      expression += c;
    else
      (expression += '[' + std::string(c == '^' ? "\\" : "")) += std::string(1, c) + ']';
  }
  std::smatch match;
  if (!std::regex_match(name, match, std::regex(expression))) return std::nullopt;
  std::string run;
  for (std::size_t star = 1; star < match.size(); ++star) {
    if (star > 1) run += '_';
    run += match[star].str();
  }
  return run;
}

/// The files that match a pattern, by their runs.
std::map<std::string, fs::path> files_by_run(TomlReader& table, const fs::path& folder,
                                             const std::string& pattern) {
  const fs::path place = (folder / pattern).parent_path();
  if (has_star(place.lexically_relative(folder).string()))
    table.fail("file", fmt::format("'{}' has a star in the name of a folder", pattern),
               "stars in the name of the file alone");
  std::map<std::string, fs::path> files;
  if (fs::is_directory(place))
    for (const auto& entry : fs::directory_iterator(place)) {
      const auto run = run_named(entry.path().filename().string(), fs::path(pattern).filename().string());
      if (!run || !entry.is_regular_file()) continue;
      if (const auto [same, is_new] = files.emplace(*run, entry.path()); !is_new)
        table.fail("file",
                   fmt::format("'{}' and '{}' are both run '{}'", same->second.filename().string(),
                               entry.path().filename().string(), *run),
                   "a pattern whose stars tell all files apart");
    }
  if (files.empty())
    table.fail("file", fmt::format("no file matches '{}'", pattern),
               "a pattern of files beside recording.toml, with * for what names the run");
  return files;
}

/// The file of a stream; nothing: a pattern of which none is of that run.
std::optional<fs::path> file_of(TomlReader& table, const fs::path& folder, const std::string& run) {
  const auto file = table.text("file");
  if (!file) table.fail("", "has no key 'file'", "the name of the CSV file");
  if (has_star(*file)) {
    const std::map<std::string, fs::path> files = files_by_run(table, folder, *file);
    const auto mine = files.find(run);
    return mine == files.end() ? std::nullopt : std::optional(mine->second);
  }
  if (!fs::is_regular_file(folder / *file))
    table.fail("file", fmt::format("the file '{}' does not exist", *file),
               "a file beside recording.toml, or an absolute path");
  return folder / *file;
}

StreamSource stream_in(StreamKind kind, TomlReader& table, const fs::path& file) {
  StreamSource source;
  source.place = table.place_of();
  refuse_stray_columns(kind, table);
  source.file = file;
  source.format = format_in(table);
  std::optional<TomlReader> columns = table.table("columns");
  if (!columns)
    table.fail("", "has no columns", "columns.<stream column> = \"name\", number or { column = ... }");
  take_time(kind, table, *columns, source);
  if (kind == StreamKind::wheels) {
    take_wheel_columns(*columns, source.format.header, source);
    source.increments = table.boolean("increments").value_or(false);
    const auto rate = std::find_if(
        source.columns.begin(), source.columns.end(),
        [](const ColumnSource& column) { return wheel_column(column.column)->unit == WheelUnit::rate; });
    if (source.increments && rate != source.columns.end())
      columns->fail(rate->column, fmt::format("{} is a rate and cannot be increments", rate->column),
                    "counts, radians or metres");
  } else {
    take_columns(kind, *columns, source.format.header, source);
  }
  columns->check_keys();
  return source;
}

/// The second at or before the earliest first stamp of all streams.
std::int64_t whole_second_before(const std::vector<std::pair<StreamKind, StreamSource>>& streams) {
  double earliest = std::numeric_limits<double>::infinity();
  for (const auto& [kind, source] : streams)
    if (const auto stamp = first_stamp(source)) earliest = std::min(earliest, *stamp);
  constexpr double kLatest_s = 9e18;  // that an integer holds
  return std::abs(earliest) < kLatest_s ? static_cast<std::int64_t>(std::floor(earliest)) : 0;
}

void take_time_origin(TomlReader& file, RecordingMap& map) {
  const toml::node* const origin = file.node("time_origin");
  if (origin == nullptr) return;
  const bool first = origin->value<std::string>() == "first";
  if (!first && !origin->is_integer())
    file.fail("time_origin", "time_origin is neither \"first\" nor a whole number",
              "\"first\", or the second that becomes 0");
  const std::int64_t origin_s = first ? whole_second_before(map.streams) : *origin->value<std::int64_t>();
  for (auto& [kind, source] : map.streams) source.time_scale.origin_s = origin_s;
}

void take_stream(StreamKind kind, TomlReader& file, const fs::path& folder, const std::string& run,
                 RecordingMap& map) {
  std::optional<TomlReader> table = file.table(std::string(table_name_of(kind)));
  if (!table) return;
  bool states_noise = false;
  if (kind == StreamKind::reference) {
    map.partial = read_partial_reference(*table);
    states_noise = read_reference_noise(*table).stated();
  }
  if (kind == StreamKind::relative_motion && table->has("tuple_file"))
    map.tuple_file = *table->text("tuple_file");
  const bool partial_only = (kind == StreamKind::reference && (!map.partial.empty() || states_noise)) ||
                            (kind == StreamKind::relative_motion && !map.tuple_file.empty());
  if (table->has("file") || !partial_only) {
    const std::optional<fs::path> stream_file = file_of(*table, folder, run);
    if (!stream_file) return;
    map.streams.emplace_back(kind, stream_in(kind, *table, *stream_file));
  }
  table->check_keys();
}

}  // namespace

std::vector<std::string> runs_of(const fs::path& path) {
  const toml::table content = parse_toml(read_file(path), path.string());
  TomlReader file(content, path.string(), "");
  std::set<std::string> runs;
  for (const StreamKind kind : kStreamKinds) {
    std::optional<TomlReader> table = file.table(std::string(table_name_of(kind)));
    const auto pattern = table ? table->text("file") : std::nullopt;
    if (!pattern || !has_star(*pattern)) continue;
    for (const auto& [run, matching] : files_by_run(*table, path.parent_path(), *pattern)) runs.insert(run);
  }
  return {runs.begin(), runs.end()};
}

RecordingMap parse_recording_map(std::string_view text, const fs::path& path, const std::string& run) {
  const toml::table content = parse_toml(text, path.string());
  TomlReader file(content, path.string(), "");
  const fs::path folder = path.parent_path();
  RecordingMap map;
  map.session = file.text("session").value_or("");
  if (const auto tuple_file = file.text("tuple_file")) map.tuple_file = *tuple_file;
  for (const StreamKind kind : kStreamKinds)
    if (kind != StreamKind::landmarks) take_stream(kind, file, folder, run, map);
  if (!map.tuple_file.empty()) {
    map.tuple_file = folder / map.tuple_file;
    if (!fs::is_regular_file(map.tuple_file))
      file.fail("tuple_file", fmt::format("the file '{}' does not exist", map.tuple_file.string()),
                "a .tuple file");
  }
  take_time_origin(file, map);
  file.check_keys();
  return map;
}

ReferenceSigmas read_reference_noise(const fs::path& folder) {
  const fs::path path = folder / "recording.toml";
  if (!fs::exists(path)) return {};
  const toml::table content = parse_toml(read_file(path), path.string());
  TomlReader file(content, path.string(), "");
  std::optional<TomlReader> reference = file.table("reference");
  return reference ? read_reference_noise(*reference) : ReferenceSigmas{};
}

}  // namespace trundle::recording
