#include <iterator>

#include <fmt/compile.h>

#include "trundle/recording/csv/detail/partial_reference.hpp"
#include "trundle/recording/csv/detail/streams.hpp"
#include "trundle/recording/landmark_file.hpp"
#include "trundle/recording/recording.hpp"

namespace trundle::recording {
namespace {

/// Shortest text that reads back as the same double; nothing where not measured.
void append(std::string& text, double value) {
  if (value == value) fmt::format_to(std::back_inserter(text), FMT_COMPILE("{}"), value);
}

struct Column {
  std::string name;
  const std::vector<double>* value;
};

void write_columns(const std::filesystem::path& file, const std::vector<Column>& columns) {
  const std::size_t rows = columns.front().value->size();
  if (rows == 0) return;
  std::string text;
  for (const Column& column : columns) text += (text.empty() ? "" : ",") + column.name;
  text += '\n';
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::size_t i = 0; i < columns.size(); ++i) {
      if (i > 0) text += ',';
      append(text, (*columns[i].value)[row]);
    }
    text += '\n';
  }
  write_file(file, text);
}

void write_rows(const std::filesystem::path& file, const std::string& header, const std::string& rows) {
  if (!rows.empty()) write_file(file, header + "\n" + rows);
}

/// As a TOML string.
std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    result += c;
  }
  return result + '"';
}

void write_map(const Recording& recording, const std::filesystem::path& file) {
  std::string text;
  if (!recording.session.empty()) text += "session = " + quoted(recording.session) + "\n";
  if (!recording.seen_as.empty()) text += "seen_as = " + quoted(recording.seen_as) + "\n";
  if (!recording.partial.empty()) text += "[reference]\n" + to_toml(recording.partial);
  if (!text.empty()) write_file(file, text);
}

}  // namespace

void write_recording(const Recording& recording, const std::filesystem::path& folder) {
  const auto file = [&](StreamKind kind) { return folder / file_name_of(kind); };
  std::vector<Column> wheels = {{"time_s", &recording.wheels.time_s}};
  for (const WheelSeries& series : recording.wheels.series)
    wheels.push_back({column_name(series), &series.value});
  for (const WheelSeries& series : recording.wheels.steering)
    wheels.push_back({steering_column_name(series), &series.value});
  write_columns(file(StreamKind::wheels), wheels);
  write_columns(file(StreamKind::gyro),
                {{"time_s", &recording.gyro.time_s}, {"yaw_rate_rad_s", &recording.gyro.yaw_rate_rad_s}});
  for (const StreamKind kind : {StreamKind::velocity, StreamKind::commands}) {
    const VelocityStream& stream = kind == StreamKind::velocity ? recording.velocity : recording.commands;
    write_columns(file(kind), {{"time_s", &stream.time_s},
                               {"forward_m_s", &stream.forward_m_s},
                               {"yaw_rate_rad_s", &stream.yaw_rate_rad_s}});
  }
  const AccelStream& accel = recording.accel;
  write_columns(file(StreamKind::accel),
                {{"time_s", &accel.time_s}, {"x_m_s2", &accel.x_m_s2}, {"y_m_s2", &accel.y_m_s2}});
  const ReferenceStream& reference = recording.reference;
  write_columns(file(StreamKind::reference), {{"time_s", &reference.time_s},
                                              {"x_m", &reference.x_m},
                                              {"y_m", &reference.y_m},
                                              {"heading_rad", &reference.heading_rad}});
  std::string rows;
  for (const Sighting& s : recording.sightings)
    rows += fmt::format("{},{},{},{}\n", s.time_s, text_cell(s.landmark), s.range_m, s.bearing_rad);
  write_rows(file(StreamKind::sightings), "time_s,landmark,range_m,bearing_rad", rows);
  rows.clear();
  for (const Landmark& l : recording.landmarks)
    rows += fmt::format("{},{},{}\n", text_cell(l.name), l.position.x(), l.position.y());
  write_rows(file(StreamKind::landmarks), "landmark,x_m,y_m", rows);
  rows.clear();
  for (const auto& [start_s, end_s, motion] : recording.relative_motions)
    rows += fmt::format("{},{},{},{},{}\n", start_s, end_s, motion.x, motion.y, motion.heading);
  write_rows(file(StreamKind::relative_motion), "start_s,end_s,dx_m,dy_m,dheading_rad", rows);
  write_map(recording, folder / "recording.toml");
}

}  // namespace trundle::recording
