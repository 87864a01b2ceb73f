#include "trundle/recording/recording.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <map>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "trundle/io/error.hpp"
#include "trundle/io/file.hpp"
#include "trundle/recording/csv/detail/recording_map.hpp"
#include "trundle/recording/csv/detail/streams.hpp"
#include "trundle/recording/logs/detail/layouts.hpp"
#include "trundle/recording/logs/detail/log_streams.hpp"

namespace trundle::recording {
namespace {

namespace fs = std::filesystem;

bool has_native_file(const fs::path& folder) {
  return std::any_of(kStreamKinds.begin(), kStreamKinds.end(),
                     [&](StreamKind kind) { return fs::exists(folder / file_name_of(kind)); });
}

/// The runs that the recording.toml of a folder maps by patterns; none where it has none.
std::vector<std::string> runs_in(const fs::path& folder) {
  const fs::path map = folder / "recording.toml";
  return fs::is_regular_file(map) ? runs_of(map) : std::vector<std::string>{};
}

/// Whether the path is a run that the recording.toml of the folder above maps by patterns: "log/03".
bool is_run(const fs::path& path) {
  if (fs::exists(path)) return false;
  const std::vector<std::string> runs = runs_in(path.parent_path());
  return std::ranges::find(runs, path.filename().string()) != runs.end();
}

bool is_recording(const fs::path& path) {
  if (!fs::is_directory(path)) return path.extension() == ".tuple" || logs::is_log(path);
  return has_native_file(path) || fs::exists(path / "recording.toml") || is_mrclam(path);
}

/// What a command wrote of a recording: its reference beside it is none of another.
bool holds_results(const fs::path& folder) {
  return (fs::exists(folder / "run.json") || fs::exists(folder / "slam.json")) &&
         !fs::exists(folder / "recording.toml") && !fs::exists(folder / file_name_of(StreamKind::wheels));
}

/// A log's bytes are in its file, or in those of its folder.
void note_log(const fs::path& log, Recording& recording) {
  if (!fs::is_directory(log)) return note_input(input_file(log), recording);
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(log))
    if (entry.is_regular_file() && entry.path().filename() != "recording.toml") files.push_back(entry.path());
  std::ranges::sort(files);
  for (const fs::path& file : files) note_input(input_file(file), recording);
}

/// The streams that are in logs: one pass over each.
void read_logs(const RecordingMap& map, const logs::Definitions& definitions, Recording& recording) {
  std::map<fs::path, std::vector<const std::pair<StreamKind, StreamSource>*>> by_log;
  for (const auto& stream : map.streams)
    if (is_of_log(stream.second)) by_log[stream.second.file].push_back(&stream);
  for (const auto& [log, streams] : by_log) {
    std::vector<LogStreamSource> sources;
    for (const auto* const stream : streams) sources.push_back({stream->first, &stream->second});
    std::vector<Table> tables = read_log(sources, definitions, recording.findings);
    note_log(log, recording);
    for (std::size_t i = 0; i < streams.size(); ++i)
      take_stream(streams[i]->first, streams[i]->second, std::move(tables[i]), recording);
  }
}

/// All that a recording.toml maps.
void read_streams(const RecordingMap& map, const logs::Definitions& definitions, Recording& recording) {
  recording.time_origin_s = map.time_origin_s;
  for (const auto& [kind, source] : map.streams)
    if (!is_of_log(source)) read_stream(kind, source, recording);
  read_logs(map, definitions, recording);
  if (!map.tuple_file.empty()) read_tuples(map.tuple_file, recording);
  if (!map.session.empty()) recording.session = map.session;
  recording.seen_as = map.seen_as;
  recording.partial = map.partial;
  recording.reference_noise = map.reference_noise;
}

/// The streams that a recording.toml maps; `run`: by patterns; `log`: that it is applied to, empty: those it
/// names.
RecordingMap read_mapped(const fs::path& file, const std::string& run, const fs::path& log,
                         const std::vector<std::string>& msg_path, Recording& recording) {
  const std::string text = read_file(file);
  note_input(file, text, recording);
  const LogContext context{log, logs::Definitions({msg_path.begin(), msg_path.end()})};
  RecordingMap map = parse_recording_map(text, file, run, context);
  read_streams(map, context.definitions, recording);
  return map;
}

void read_native(const fs::path& folder, const RecordingMap& map, Recording& recording) {
  for (const StreamKind kind : kStreamKinds) {
    const fs::path file = folder / file_name_of(kind);
    const auto mapped = [&](const auto& stream) { return stream.first == kind; };
    if (!fs::exists(file) || std::any_of(map.streams.begin(), map.streams.end(), mapped)) continue;
    read_stream(kind, native_source(kind, file), recording);
  }
}

/// A robot moves: what was seen of one is no sighting of a landmark.
void set_robots_aside(const std::vector<std::string>& robots, Recording& recording) {
  const auto is_landmark = [&](const Sighting& sighting) {
    return sighting.landmark.empty() || std::ranges::find(robots, sighting.landmark) == robots.end();
  };
  const auto of_robots =
      std::stable_partition(recording.sightings.begin(), recording.sightings.end(), is_landmark);
  recording.robot_sightings.assign(of_robots, recording.sightings.end());
  recording.sightings.erase(of_robots, recording.sightings.end());
  if (!recording.robot_sightings.empty())
    recording.findings.push_back(
        {Severity::note, FindingCode::sighting_of_a_robot, "sightings", recording.robot_sightings.size()});
}

/// By its name: a folder may be large.
bool is_table_or_log(const fs::path& file) {
  constexpr std::array<std::string_view, 7> kEndings = {".csv", ".CSV",    ".bag", ".mcap",
                                                        ".db3", ".wpilog", ".ulg"};
  return std::ranges::find(kEndings, file.extension().string()) != kEndings.end();
}

/// The tables of numbers and the logs in and below a folder, by their names in it: what somebody has who
/// starts.
std::vector<std::string> tables_below(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file() && is_table_or_log(entry.path()))
      names.push_back(entry.path().lexically_relative(folder).generic_string());
  std::sort(names.begin(), names.end());
  return names;
}

InputError no_recording_in(const fs::path& path) {
  constexpr std::size_t kMostNames = 5;  // more would make a list of the message
  if (!fs::is_directory(path)) {
    const bool is_empty = fs::is_regular_file(path) && fs::is_empty(path);
    return {path.string(), is_empty ? "is empty" : "is neither a folder nor a log of a known format",
            "the folder of a recording, or a log: ROS 1 bag, rosbag2, MCAP, WPILOG, DataFlash or ULog"};
  }
  const std::vector<std::string> names = tables_below(path);
  if (names.empty())
    return {path.string(), "holds no recording",
            "a folder with wheels.csv or another stream, or recording.toml"};
  const std::size_t shown = std::min(names.size(), kMostNames);
  const std::string more = names.size() > shown ? fmt::format(" and {} more", names.size() - shown) : "";
  return {path.string(),
          fmt::format("holds no recording: {}{} {} there, but no recording.toml",
                      fmt::join(names.begin(), names.begin() + static_cast<std::ptrdiff_t>(shown), ", "),
                      more, names.size() == 1 ? "is" : "are"),
          fmt::format("{}, which says what their columns are: docs/getting-started.md shows one, "
                      "docs/recording.md has all its keys",
                      (path / names.front()).replace_filename("recording.toml").string())};
}

/// What says which streams a log has: given, in its folder, or beside it.
fs::path map_of_log(const fs::path& log, const std::string& given) {
  if (!given.empty()) {
    if (!fs::is_regular_file(given))
      throw InputError(given, "is no file", "a recording.toml that maps a log");
    return given;
  }
  if (const auto found = map_beside_log(log)) return *found;
  throw InputError(log.string(),
                   "is a log, and no recording.toml beside it says which topics are its streams",
                   "one there, or --recording FILE: trundle init drafts it, docs/logs.md shows one");
}

/// Of a folder that holds one, or several of one layout.
std::vector<fs::path> recordings_in(const fs::path& folder) {
  std::vector<fs::path> found;
  for (const std::string& run : runs_in(folder)) found.push_back(folder / run);
  return found.empty() ? std::vector{folder} : found;
}

/// The only run that the recording.toml of a folder maps by patterns; empty: it has none.
std::string the_run_in(const fs::path& folder) {
  const std::vector<std::string> runs = runs_in(folder);
  if (runs.size() > 1)
    throw InputError(folder.string(),
                     fmt::format("holds {} recordings, {} to {}", runs.size(), runs.front(), runs.back()),
                     fmt::format("one of them, {}", (folder / runs.front()).string()));
  return runs.empty() ? std::string() : runs.front();
}

/// None where there is none. A folder that several ways lead to, by symbolic links, is looked into once, by
/// the one without where there is one.
std::vector<fs::path> found_below(const fs::path& folder) {
  std::vector<fs::path> found;
  std::set<fs::path> seen;
  std::deque<fs::path> folders = {folder}, links;
  while (!folders.empty() || !links.empty()) {
    std::deque<fs::path>& next = folders.empty() ? links : folders;
    const fs::path here = next.front();
    next.pop_front();
    if (!seen.insert(fs::canonical(here)).second || holds_results(here)) continue;
    if (is_recording(here)) {
      std::ranges::copy(recordings_in(here), std::back_inserter(found));
      continue;
    }
    for (const auto& entry : fs::directory_iterator(here))
      if (entry.is_directory()) (entry.is_symlink() ? links : folders).push_back(entry.path());
    std::ranges::sort(links);
  }
  std::sort(found.begin(), found.end());
  return found;
}

bool any_finite(const std::vector<double>& values) {
  return std::ranges::any_of(values, [](double v) { return std::isfinite(v); });
}

}  // namespace

bool ReferenceStream::has_positions() const {
  return any_finite(x_m);
}

bool ReferenceStream::has_headings() const {
  return any_finite(heading_rad);
}

bool PartialReference::empty() const {
  return !closed && !closed_heading && !distance_m && !turns && !end_x_m && !end_y_m && !end_heading_rad;
}

bool is_empty(const Recording& recording) {
  return recording.wheels.time_s.empty() && recording.gyro.time_s.empty() &&
         recording.velocity.time_s.empty() && recording.commands.time_s.empty() &&
         recording.accel.time_s.empty() && recording.sightings.empty() && recording.landmarks.empty() &&
         !recording.has_reference();
}

bool Recording::has_reference() const {
  return !reference.time_s.empty() || !relative_motions.empty() || !partial.empty();
}

Recording read_recording(const fs::path& path, const ReadOptions& options) {
  const bool one_of_many = is_run(path);
  const fs::path place = one_of_many ? path.parent_path() : path;
  if (!fs::exists(place)) throw InputError(path.string(), "does not exist", "the folder of a recording");
  if (!is_recording(place)) throw no_recording_in(path);
  if (options.robot_number != 0 && !is_mrclam(place))
    throw InputError(path.string(),
                     fmt::format("does not hold several robots, of which {} is one", options.robot_number),
                     "no number of a robot");
  const fs::path whole = one_of_many ? fs::canonical(place) / path.filename() : fs::canonical(path);
  Recording recording;
  recording.name = fs::is_regular_file(whole) ? whole.stem().string() : whole.filename().string();
  recording.session = whole.parent_path().filename().string();
  if (logs::is_log(place)) {
    const RecordingMap map =
        read_mapped(map_of_log(place, options.map), "", place, options.msg_path, recording);
    set_robots_aside(map.robots, recording);
  } else if (!options.map.empty()) {
    throw InputError(path.string(), "is no log that a recording.toml could be given for",
                     "a log, or a folder with its own recording.toml");
  } else if (!fs::is_directory(place)) {
    read_tuples(path, recording);
  } else if (is_mrclam(place)) {
    read_mrclam(path, options.robot_number, recording);
  } else {
    const RecordingMap map = fs::exists(place / "recording.toml")
                                 ? read_mapped(place / "recording.toml",
                                               one_of_many ? path.filename().string() : the_run_in(place), {},
                                               options.msg_path, recording)
                                 : RecordingMap{};
    read_native(place, map, recording);
    set_robots_aside(map.robots, recording);
  }
  if (is_empty(recording))
    throw InputError(path.string(), "holds no samples", "at least one stream with rows");
  return recording;
}

Recording read_mapped_by(std::string_view text, const fs::path& file,
                         const std::vector<fs::path>& message_folders) {
  const LogContext context{{}, logs::Definitions(message_folders)};
  Recording recording;
  read_streams(parse_recording_map(text, file, {}, context), context.definitions, recording);
  return recording;
}

std::optional<fs::path> map_beside_log(const fs::path& log) {
  const fs::path inside = log / "recording.toml";
  if (fs::is_directory(log) && fs::exists(inside)) return inside;
  const fs::path beside = fs::absolute(log).lexically_normal().parent_path() / "recording.toml";
  return fs::exists(beside) ? std::optional(beside) : std::nullopt;
}

std::vector<fs::path> recordings_below(const fs::path& folder) {
  if (is_run(folder)) return {folder};
  if (!fs::exists(folder)) throw InputError(folder.string(), "does not exist", "the folder of a recording");
  if (is_recording(folder)) return recordings_in(folder);
  if (!fs::is_directory(folder)) throw no_recording_in(folder);
  std::vector<fs::path> found = found_below(folder);
  if (found.empty()) throw no_recording_in(folder);
  return found;
}

}  // namespace trundle::recording
