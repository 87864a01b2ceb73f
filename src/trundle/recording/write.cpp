#include <algorithm>
#include <iterator>
#include <set>

#include <fmt/compile.h>
#include <fmt/format.h>

#include "trundle/io/interruption.hpp"
#include "trundle/io/staging.hpp"
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

/// The files of a recording, of which no text is ever all in memory; none of what has no rows.
class Files {
 public:
  explicit Files(std::filesystem::path folder) : folder_(std::move(folder)) {}

  /// `append_row(text, row)` appends a row without the end of its line.
  template <class AppendRow>
  void add(StreamKind kind, std::string header, std::size_t rows, const AppendRow& append_row) {
    if (rows == 0) return;
    files_.push_back({folder_ / file_name_of(kind), {}, [=](const TakeText& take) {
                        constexpr std::size_t kPiece = 1 << 16;  // bytes
                        std::string text = header + "\n";
                        for (std::size_t row = 0; row < rows; ++row) {
                          append_row(text, row);
                          text += '\n';
                          if (text.size() < kPiece) continue;
                          check_interruption();
                          take(text);
                          text.clear();
                        }
                        take(text);
                      }});
  }

  void add_columns(StreamKind kind, const std::vector<Column>& columns) {
    std::string header;
    for (const Column& column : columns) header += (header.empty() ? "" : ",") + column.name;
    add(kind, header, columns.front().value->size(), [columns](std::string& text, std::size_t row) {
      for (std::size_t i = 0; i < columns.size(); ++i) {
        if (i > 0) text += ',';
        append(text, (*columns[i].value)[row]);
      }
    });
  }

  /// All or none, with a text besides, if it is not empty.
  void write_with(const std::string& name, std::string_view text) && {
    if (!text.empty()) files_.push_back({folder_ / name, text});
    write_set(std::move(files_));
  }

 private:
  std::filesystem::path folder_;
  std::vector<FileContent> files_;
};

/// As a TOML string.
std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    result += c;
  }
  return result + '"';
}

/// What no stream says: recording.toml.
std::string map_of(const Recording& recording) {
  std::string text;
  if (!recording.session.empty()) text += "session = " + quoted(recording.session) + "\n";
  if (recording.time_origin_s != 0) text += fmt::format("time_origin = {}\n", recording.time_origin_s);
  if (!recording.seen_as.empty()) text += "seen_as = " + quoted(recording.seen_as) + "\n";
  std::set<std::string> robots;
  for (const Sighting& sighting : recording.robot_sightings) robots.insert(quoted(sighting.landmark));
  if (!robots.empty()) text += fmt::format("robots = [{}]\n", fmt::join(robots, ", "));
  const std::string reference = to_toml(recording.reference_noise) + to_toml(recording.partial);
  if (!reference.empty()) text += "[reference]\n" + reference;
  return text;
}

/// Of landmarks and of robots, in order of time.
std::vector<const Sighting*> all_sightings(const Recording& recording) {
  std::vector<const Sighting*> all;
  for (const auto* const sightings : {&recording.sightings, &recording.robot_sightings})
    for (const Sighting& sighting : *sightings) all.push_back(&sighting);
  std::ranges::stable_sort(all, {}, &Sighting::time_s);
  return all;
}

}  // namespace

void write_recording(const Recording& recording, const std::filesystem::path& folder) {
  Files files(folder);
  std::vector<Column> wheels = {{"time_s", &recording.wheels.time_s}};
  for (const WheelSeries& series : recording.wheels.series)
    wheels.push_back({column_name(series), &series.value});
  for (const WheelSeries& series : recording.wheels.steering)
    wheels.push_back({steering_column_name(series), &series.value});
  files.add_columns(StreamKind::wheels, wheels);
  files.add_columns(StreamKind::gyro,
                    {{"time_s", &recording.gyro.time_s}, {"yaw_rate_rad_s", &recording.gyro.yaw_rate_rad_s}});
  for (const StreamKind kind : {StreamKind::velocity, StreamKind::commands}) {
    const VelocityStream& stream = kind == StreamKind::velocity ? recording.velocity : recording.commands;
    files.add_columns(kind, {{"time_s", &stream.time_s},
                             {"forward_m_s", &stream.forward_m_s},
                             {"yaw_rate_rad_s", &stream.yaw_rate_rad_s}});
  }
  const AccelStream& accel = recording.accel;
  files.add_columns(StreamKind::accel,
                    {{"time_s", &accel.time_s}, {"x_m_s2", &accel.x_m_s2}, {"y_m_s2", &accel.y_m_s2}});
  const ReferenceStream& reference = recording.reference;
  files.add_columns(StreamKind::reference, {{"time_s", &reference.time_s},
                                            {"x_m", &reference.x_m},
                                            {"y_m", &reference.y_m},
                                            {"heading_rad", &reference.heading_rad}});
  const auto add_rows = [&files](StreamKind kind, const char* header, const auto& rows, auto append_row) {
    files.add(kind, header, rows.size(), [&rows, append_row](std::string& text, std::size_t row) {
      append_row(std::back_inserter(text), rows[row]);
    });
  };
  const std::vector<const Sighting*> sightings = all_sightings(recording);
  add_rows(StreamKind::sightings, "time_s,landmark,range_m,bearing_rad", sightings,
           [](auto text, const Sighting* s) {
             fmt::format_to(text, "{},{},{},{}", s->time_s, text_cell(s->landmark), s->range_m,
                            s->bearing_rad);
           });
  add_rows(StreamKind::landmarks, "landmark,x_m,y_m", recording.landmarks, [](auto text, const Landmark& l) {
    fmt::format_to(text, "{},{},{}", text_cell(l.name), l.position.x(), l.position.y());
  });
  add_rows(StreamKind::relative_motion, "start_s,end_s,dx_m,dy_m,dheading_rad", recording.relative_motions,
           [](auto text, const RelativeMotion& m) {
             fmt::format_to(text, "{},{},{},{},{}", m.start_s, m.end_s, m.motion.x, m.motion.y,
                            m.motion.heading);
           });
  std::move(files).write_with("recording.toml", map_of(recording));
}

}  // namespace trundle::recording
