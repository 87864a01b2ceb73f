#include "trundle/recording/csv/detail/stream_in.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/recording/csv/units.hpp"
#include "trundle/recording/logs/detail/log_streams.hpp"
#include "trundle/recording/logs/detail/transforms.hpp"

namespace trundle::recording {
namespace {

namespace fs = std::filesystem;

/// The field of messages that are a single value (WPILOG).
constexpr const char* kTheValue = "value";

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
  const std::string name = table.has("field") ? "field" : "column";
  source.topic = table.text("topic").value_or("");
  const toml::node* const column = table.node(name);
  if (column != nullptr)
    take(*column, table, name);
  else if (!source.topic.empty())
    source.name = kTheValue;
  else
    table.fail("", "has no key 'column'", "column = \"name\" or its number, or field = \"path\" of a log");
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

/// An angle in place of the rate.
bool takes_yaw_angle(StreamKind kind, TomlReader& columns) {
  const std::string angle(kYawAngle);
  if (kind != StreamKind::gyro || !columns.has(angle)) return false;
  if (columns.has("yaw_rate_rad_s"))
    columns.fail(angle, "gives yaw_rad besides yaw_rate_rad_s",
                 "one of them: the rate, if it is the gyro's own");
  return true;
}

void take_columns(StreamKind kind, TomlReader& columns, bool header, StreamSource& source) {
  if (takes_yaw_angle(kind, columns)) {
    columns.node(std::string(kYawAngle));
    source.columns.push_back(column_in(columns, std::string(kYawAngle), header));
    return;
  }
  for (ColumnSource column : columns_of(kind)) {
    if (columns.has(column.column)) {
      const CellKind cells = column.kind;
      column = column_in(columns, column.column, header);
      column.kind = cells;
    } else if (column.optional || (kind == StreamKind::sightings && columns.has("x_m"))) {
      column.optional = true;
    } else {
      columns.fail("", fmt::format("has no key '{}'", column.column),
                   fmt::format("{} = the file's column", column.column));
    }
    columns.node(column.column);
    source.columns.push_back(column);
  }
}

/// The unit and offset of the stamps, and what of the stream is wanted.
void take_clock_and_cut(TomlReader& table, StreamSource& source) {
  source.time_scale.unit_exponent = unit_exponent_in(table);
  source.time_offset_s = table.number("time_offset_s").value_or(0.0);
  source.start_s = table.number("start_s");
  source.end_s = table.number("end_s");
  if (source.start_s && source.end_s && *source.start_s >= *source.end_s)
    table.fail("end_s", fmt::format("the cut from {} s to {} s is empty", *source.start_s, *source.end_s),
               "end_s after start_s");
}

/// Stamps have the unit of their table and no scale of their own, and come from the stream's messages.
ColumnSource stamps_in(TomlReader& columns, const std::string& stamp, bool header) {
  ColumnSource source = column_in(columns, stamp, header);
  if (source.scale != 1.0)
    columns.fail(stamp, "has a scale or a sign, which stamps have not",
                 "time_unit of the table; of a counter of rows rate_hz");
  if (!source.topic.empty())
    columns.fail(stamp, fmt::format("is of the topic '{}'", source.topic),
                 "a field of the stream's own messages");
  return source;
}

void take_time(StreamKind kind, TomlReader& table, TomlReader& columns, StreamSource& source) {
  const std::string stamp(stamp_column_of(kind));
  take_clock_and_cut(table, source);
  const auto rate_hz = table.number_above_zero("rate_hz");
  const bool stamped = columns.node(stamp) != nullptr;
  if (stamped && rate_hz)
    table.fail("rate_hz", fmt::format("gives rate_hz besides columns.{}", stamp), "one of them");
  if (!stamped && !rate_hz)
    table.fail("columns", fmt::format("gives neither columns.{} nor rate_hz", stamp),
               "a column of stamps, or the rate of the rows");
  if (stamped) source.time = stamps_in(columns, stamp, source.format.header);
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

/// `rebuild = { wheel_separation_m = ... }`: wheels from poses.
void take_rebuilt(StreamKind kind, TomlReader& table, StreamSource& source) {
  if (kind != StreamKind::wheels || !table.has("rebuild")) return;
  TomlReader rebuild = *table.table("rebuild");
  const auto separation_m = rebuild.number_above_zero("wheel_separation_m");
  if (!separation_m)
    rebuild.fail("", "has no key 'wheel_separation_m'",
                 "the distance of the wheels that the controller computed with");
  source.rebuilt.emplace();
  source.rebuilt->separation_m = *separation_m;
  source.rebuilt->left = rebuild.text("left").value_or("left");
  source.rebuilt->right = rebuild.text("right").value_or("right");
  rebuild.check_keys();
}

StreamSource table_stream_in(StreamKind kind, TomlReader& table, const fs::path& file) {
  StreamSource source;
  source.place = table.place_of();
  refuse_stray_columns(kind, table);
  source.file = file;
  source.format = format_in(table);
  take_rebuilt(kind, table, source);
  if (source.rebuilt) kind = StreamKind::reference;
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

/// The columns of a stream, in their order, of those that the type of a topic is known to have.
void take_known_columns(StreamKind kind, TomlReader& table, std::vector<ColumnSource> known,
                        StreamSource& source) {
  const std::string type = type_of_topic(source.file, source.topic, table.place_of("topic"));
  if (const toml::node* const frames = table.node("frames"); frames != nullptr) {
    const toml::array* const pair = frames->as_array();
    if (pair == nullptr || pair->size() != 2 || !(*pair)[0].is_string() || !(*pair)[1].is_string())
      table.fail("frames", "frames is no pair", "[\"odom\", \"base_link\"]: parent and child of a transform");
    source.frames = {**(*pair)[0].as_string(), **(*pair)[1].as_string()};
    source.transforms = find_transforms(
        {source.file, source.topic, source.frames.front(), source.frames.back(), table.place_of("frames")});
    known = columns_of_type(kind, "geometry_msgs/TransformStamped");
  }
  if (known.empty()) known = columns_of_type(kind, type);
  if (known.empty())
    table.fail("", fmt::format("has no columns, and what they are in a {} is not known", type),
               "columns.<stream column> = \"path.of.a.field\"");
  if (kind == StreamKind::wheels) {
    source.columns = std::move(known);
    return;
  }
  for (ColumnSource column : columns_of(kind)) {
    const auto found = std::ranges::find(known, column.column, &ColumnSource::column);
    column.name = found == known.end() ? "" : found->name;
    source.columns.push_back(std::move(column));
  }
}

/// `body_frame = "base_link"`: the mounting of an Imu is that of the log's static transforms.
void take_mounting(StreamKind kind, TomlReader& table, StreamSource& source) {
  if (kind != StreamKind::gyro || !table.has("body_frame")) return;
  const std::string body = *table.text("body_frame");
  const std::string sensor = frame_of_topic(source.file, source.topic);
  const std::string place = table.place_of("body_frame");
  if (sensor.empty())
    throw InputError(place, fmt::format("the messages of '{}' name no frame", source.topic),
                     "messages with header.frame_id, or no body_frame");
  source.vertical = vertical_in_sensor({source.file, "/tf", body, sensor, place});
  source.vertical_evidence = fmt::format("transform from {} to {}", body, sensor);
}

void take_log_time(StreamKind kind, TomlReader& table, StreamSource& source) {
  take_clock_and_cut(table, source);
  std::optional<TomlReader> columns = table.table("columns");
  const std::string stamp(stamp_column_of(kind));
  if (columns && columns->has(stamp)) source.time = stamps_in(*columns, stamp, true);
  if (source.time && source.time->name.empty())
    columns->fail(stamp, fmt::format("{} is no field's path", stamp), "\"header.stamp\" or \"log_time\"");
}

StreamSource log_stream_in(StreamKind kind, TomlReader& table, const fs::path& file) {
  StreamSource source;
  source.place = table.place_of();
  source.file = file;
  source.topic = table.text("topic").value_or("");
  refuse_stray_columns(kind, table);
  take_log_time(kind, table, source);
  take_rebuilt(kind, table, source);
  take_mounting(kind, table, source);
  source.increments = kind == StreamKind::wheels && table.boolean("increments").value_or(false);
  if (source.rebuilt) kind = StreamKind::reference;
  std::optional<TomlReader> columns = table.table("columns");
  if (columns) columns->node(std::string(stamp_column_of(kind)));
  const bool names_columns = columns && columns->keys().size() > (source.time ? 1 : 0);
  if (!names_columns) {
    take_known_columns(kind, table, {}, source);
    return source;
  }
  if (kind == StreamKind::wheels)
    take_wheel_columns(*columns, true, source);
  else
    take_columns(kind, *columns, true, source);
  std::set<std::string> topics;  // each is looked for once
  for (ColumnSource& column : source.columns) {
    if (column.number != 0)
      columns->fail(column.column, fmt::format("{} is a number", column.column), "a field's path");
    if (column.place.empty()) column.name.clear();  // it is not there
    const std::string& topic = column.topic.empty() ? source.topic : column.topic;
    if (!column.name.empty() && topic.empty())
      columns->fail(column.column, fmt::format("{} is of no topic", column.column),
                    "topic = \"/name\" in the table");
    if (!column.name.empty() && topics.insert(topic).second) (void)type_of_topic(file, topic, column.place);
  }
  columns->check_keys();
  return source;
}

}  // namespace

bool is_of_log(TomlReader& table) {
  if (table.has("topic")) return true;
  std::optional<TomlReader> columns = table.has("columns") ? table.table("columns") : std::nullopt;
  if (!columns) return false;
  return std::ranges::any_of(columns->keys(), [&](const std::string& key) {
    const toml::node* const column = columns->node(key);
    return column->is_table() && column->as_table()->contains("topic");
  });
}

StreamSource stream_in(StreamKind kind, TomlReader& table, const fs::path& file) {
  if (is_of_log(table)) return log_stream_in(kind, table, file);
  if (logs::is_log(file))
    table.fail("file", fmt::format("'{}' is a log, and no topic is named", file.filename().string()),
               "topic = \"/name\": trundle info lists those of a log");
  return table_stream_in(kind, table, file);
}

}  // namespace trundle::recording
