#include "trundle/recording/csv/detail/streams.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <unordered_map>
#include <utility>

#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/io/file.hpp"
#include "trundle/recording/csv/detail/store_stream.hpp"
#include "trundle/recording/detail/steering.hpp"

namespace trundle::recording {
namespace {

/// Of what does not come at a rate of its own, like commands and surveyed points.
constexpr double kSlowestEvents_s = 1e4;

struct Suffix {
  std::string_view text;
  WheelUnit unit;
};
/// In order of precedence.
constexpr std::array<Suffix, 4> kSuffixes = {{{"_ticks", WheelUnit::ticks},
                                              {"_rad", WheelUnit::radians},
                                              {"_m", WheelUnit::metres},
                                              {"_rad_s", WheelUnit::rate}}};

std::vector<ColumnSource> wheel_columns_in(const std::filesystem::path& file) {
  const CsvFile text(file, {});
  const CsvTable table(text.head(), file.string(), {});
  std::vector<ColumnSource> columns;
  for (const std::string& name : table.names())
    if (wheel_column(name)) columns.push_back({name, name});
  if (columns.empty())
    throw InputError(place(table.file(), table.header_line()), "has no column of a wheel",
                     table.meant().empty()
                         ? "<wheel>_ticks, <wheel>_m or <wheel>_rad_s, named after the robot's wheels"
                         : table.meant());
  keep_preferred(columns);
  return columns;
}

RowRules rules_of(StreamKind kind, const StreamSource& source) {
  RowRules rules;
  const bool may_share_stamps = kind == StreamKind::sightings || kind == StreamKind::relative_motion;
  rules.repeated_stamps = may_share_stamps;
  rules.gaps = !may_share_stamps;
  rules.empty_cells = kind == StreamKind::reference || source.rebuilt;
  if (may_share_stamps || kind == StreamKind::reference || kind == StreamKind::commands)
    rules.slowest_s = kSlowestEvents_s;
  return rules;
}

void read_landmarks(const StreamSource& source, Recording& recording) {
  const std::string text = read_file(source.file);
  note_input(source.file, text, recording);
  const CsvTable csv(text, source.file.string(), source.format);
  std::vector<CsvColumn> wanted;
  for (const ColumnSource& column : source.columns) {
    const auto index = csv.column_named(column.name);
    if (!index)
      throw InputError(place(csv.file(), csv.header_line()), fmt::format("has no column '{}'", column.name),
                       "landmark,x_m,y_m");
    wanted.push_back({*index, column.kind, {}});
  }
  const CsvRows rows = csv.read(wanted);
  for (std::size_t row = 0; row < rows.count(); ++row)
    recording.landmarks.push_back({rows.texts[0][row], {rows.numbers[1][row], rows.numbers[2][row]}});
}

}  // namespace

void note_input(const std::filesystem::path& file, std::string_view text, Recording& recording) {
  note_input({file.string(), sha256_of(text)}, recording);
}

void note_input(const InputFile& input, Recording& recording) {
  const auto same = [&](const InputFile& other) {
    return other.path == input.path && other.sha256 == input.sha256;
  };
  if (std::ranges::none_of(recording.inputs, same)) recording.inputs.push_back(input);
}

std::string_view table_name_of(StreamKind kind) {
  constexpr std::array<std::string_view, 9> kNames = {"wheels",   "gyro",      "commands",  "accel",
                                                      "velocity", "sightings", "reference", "relative_motion",
                                                      "landmarks"};
  return kNames[static_cast<std::size_t>(kind)];
}

std::string_view file_name_of(StreamKind kind) {
  constexpr std::array<std::string_view, 9> kNames = {"wheels.csv",    "gyro.csv",     "commands.csv",
                                                      "accel.csv",     "velocity.csv", "sightings.csv",
                                                      "reference.csv", "relative.csv", "landmarks.csv"};
  return kNames[static_cast<std::size_t>(kind)];
}

std::vector<ColumnSource> columns_of(StreamKind kind) {
  const auto required = [](const char* name) { return ColumnSource{name, name}; };
  const auto optional = [](const char* name) {
    return ColumnSource{.column = name, .name = name, .optional = true};
  };
  const ColumnSource name{.column = "landmark",
                          .name = "landmark",
                          .kind = CellKind::text,
                          .optional = kind == StreamKind::sightings};
  switch (kind) {
    case StreamKind::wheels:
      return {};
    case StreamKind::gyro:
      return {required("yaw_rate_rad_s")};
    case StreamKind::commands:
    case StreamKind::velocity:
      return {required("forward_m_s"), required("yaw_rate_rad_s")};
    case StreamKind::accel:
      return {optional("x_m_s2"), optional("y_m_s2")};
    case StreamKind::sightings:
      return {name, required("range_m"), required("bearing_rad"), optional("x_m"), optional("y_m")};
    case StreamKind::reference:
      return {optional("x_m"), optional("y_m"),          optional("heading_rad"),
              optional("qx"),  optional("qy"),           optional("qz"),
              optional("qw"),  optional("latitude_deg"), optional("longitude_deg")};
    case StreamKind::relative_motion:
      return {{.column = "end_s", .name = "end_s", .kind = CellKind::time},
              required("dx_m"),
              required("dy_m"),
              required("dheading_rad")};
    case StreamKind::landmarks:
      return {name, required("x_m"), required("y_m")};
  }
  return {};
}

std::string_view stamp_column_of(StreamKind kind) {
  return kind == StreamKind::relative_motion ? "start_s" : "time_s";
}

std::optional<WheelColumn> wheel_column(std::string_view name) {
  for (const Suffix& suffix : kSuffixes) {
    if (name.size() <= suffix.text.size() || !name.ends_with(suffix.text)) continue;
    const std::string_view wheel = name.substr(0, name.size() - suffix.text.size());
    const bool is_angle = suffix.unit == WheelUnit::ticks || suffix.unit == WheelUnit::radians;
    if (is_angle && wheel.size() > kSteeringEnding.size() && wheel.ends_with(kSteeringEnding))
      return WheelColumn{std::string(wheel.substr(0, wheel.size() - kSteeringEnding.size())), suffix.unit,
                         true};
    return WheelColumn{std::string(wheel), suffix.unit};
  }
  return std::nullopt;
}

void keep_preferred(std::vector<ColumnSource>& columns) {
  std::unordered_map<std::string, WheelUnit> preferred;  // of each wheel, and of its steering
  const auto key = [](const WheelColumn& column) {
    return column.wheel + std::string(column.is_steering ? kSteeringEnding : "");
  };
  for (const ColumnSource& column : columns) {
    const WheelColumn mine = *wheel_column(column.column);
    WheelUnit& unit = preferred.try_emplace(key(mine), mine.unit).first->second;
    unit = std::min(unit, mine.unit);
  }
  std::erase_if(columns, [&](const ColumnSource& column) {
    const WheelColumn mine = *wheel_column(column.column);
    return preferred.at(key(mine)) < mine.unit;
  });
}

std::string column_name(const WheelSeries& series) {
  return series.wheel + std::string(kSuffixes[static_cast<std::size_t>(series.unit)].text);
}

std::string steering_column_name(const WheelSeries& series) {
  return column_name({series.wheel + std::string(kSteeringEnding), series.unit, {}});
}

StreamSource native_source(StreamKind kind, const std::filesystem::path& file) {
  StreamSource source;
  source.file = file;
  const std::string stamp(stamp_column_of(kind));
  source.time = ColumnSource{stamp, stamp};
  source.columns = kind == StreamKind::wheels ? wheel_columns_in(file) : columns_of(kind);
  return source;
}

void read_stream(StreamKind kind, const StreamSource& source, Recording& recording) {
  if (kind == StreamKind::landmarks) return read_landmarks(source, recording);
  CsvFile file(source.file, source.format);
  Table table = read_table(source, file, rules_of(kind, source), recording.findings);
  note_input(file.input(), recording);
  store_stream(kind, source, std::move(table), recording);
}

void take_stream(StreamKind kind, const StreamSource& source, Table rows, Recording& recording) {
  store_stream(kind, source,
               finish_table(std::move(rows), source, rules_of(kind, source), recording.findings), recording);
}

}  // namespace trundle::recording
