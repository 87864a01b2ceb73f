#include "trundle/recording/csv/detail/recording_map.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <limits>
#include <map>
#include <regex>
#include <set>
#include <string_view>

#include <fmt/format.h>

#include "trundle/chassis/detail/parse_toml.hpp"
#include "trundle/io/error.hpp"
#include "trundle/recording/csv/detail/partial_reference.hpp"
#include "trundle/recording/csv/detail/stream_in.hpp"
#include "trundle/recording/csv/detail/toml_reader.hpp"
#include "trundle/recording/logs/detail/log_streams.hpp"

namespace trundle::recording {
namespace {

namespace fs = std::filesystem;

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
    else if (std::string_view(R"(\[]^)").find(c) != std::string_view::npos)  // they mean something in a class
      (expression += '\\') += c;
    else
      ((expression += '[') += c) += ']';
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
      if (!run || (!entry.is_regular_file() && !logs::is_log(entry.path()))) continue;
      if (const auto [same, is_new] = files.emplace(*run, entry.path()); !is_new)
        table.fail("file",
                   fmt::format("'{}' and '{}' are both run '{}'", same->second.filename().string(),
                               entry.path().filename().string(), *run),
                   "a pattern whose stars distinguish all files");
    }
  if (files.empty())
    table.fail("file", fmt::format("no file matches '{}'", pattern),
               "a pattern of files beside recording.toml, with * for what names the run");
  return files;
}

/// The file of a stream; nothing: a pattern of which none is of that run. `log`: the one that all tables of
/// topics are read from, whatever `file` they name; empty: none.
std::optional<fs::path> file_of(TomlReader& table, const fs::path& folder, const std::string& run,
                                const fs::path& log) {
  const auto file = table.text("file");
  if (!log.empty() && is_of_log(table)) return log;
  if (!file) table.fail("", "has no key 'file'", "the name of the CSV file, or of a log and a topic");
  if (has_star(*file)) {
    const std::map<std::string, fs::path> files = files_by_run(table, folder, *file);
    const auto mine = files.find(run);
    return mine == files.end() ? std::nullopt : std::optional(mine->second);
  }
  if (!fs::is_regular_file(folder / *file) && !logs::is_log(folder / *file))
    table.fail("file", fmt::format("the file '{}' does not exist", *file),
               "a file beside recording.toml, or an absolute path");
  return folder / *file;
}

/// The second at or before the earliest first stamp of all streams.
std::int64_t whole_second_before(const std::vector<std::pair<StreamKind, StreamSource>>& streams,
                                 const logs::Definitions& definitions) {
  double earliest = std::numeric_limits<double>::infinity();
  for (const auto& [kind, source] : streams)
    if (const auto stamp = is_of_log(source) ? first_stamp_of_log(source, definitions) : first_stamp(source))
      earliest = std::min(earliest, *stamp);
  constexpr double kLatest_s = 9e18;  // that an integer holds
  return std::abs(earliest) < kLatest_s ? static_cast<std::int64_t>(std::floor(earliest)) : 0;
}

void take_time_origin(TomlReader& file, const logs::Definitions& definitions, RecordingMap& map) {
  const toml::node* const origin = file.node("time_origin");
  if (origin == nullptr) return;
  const bool first = origin->value<std::string>() == "first";
  if (!first && !origin->is_integer())
    file.fail("time_origin", "time_origin is neither \"first\" nor a whole number",
              "\"first\", or the second that becomes 0");
  map.time_origin_s = first ? whole_second_before(map.streams, definitions) : *origin->value<std::int64_t>();
  for (auto& [kind, source] : map.streams) source.time_scale.origin_s = map.time_origin_s;
}

/// What names of files in a recording.toml go by.
struct MapPlace {
  fs::path folder;
  std::string run;
  fs::path log;
};

void take_table(StreamKind kind, TomlReader& file, const MapPlace& where, RecordingMap& map) {
  std::optional<TomlReader> table = file.table(std::string(table_name_of(kind)));
  if (!table) return;
  if (kind == StreamKind::reference) {
    map.partial = read_partial_reference(*table);
    map.reference_noise = read_reference_noise(*table);
  }
  if (kind == StreamKind::relative_motion && table->has("tuple_file"))
    map.tuple_file = *table->text("tuple_file");
  const bool partial_only =
      (kind == StreamKind::reference && (!map.partial.empty() || map.reference_noise.stated())) ||
      (kind == StreamKind::relative_motion && !map.tuple_file.empty());
  if (table->has("file") || is_of_log(*table) || !partial_only) {
    const std::optional<fs::path> stream_file = file_of(*table, where.folder, where.run, where.log);
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

RecordingMap parse_recording_map(std::string_view text, const fs::path& path, const std::string& run,
                                 const LogContext& context) {
  const toml::table content = parse_toml(text, path.string());
  TomlReader file(content, path.string(), "");
  const fs::path folder = path.parent_path();
  RecordingMap map;
  map.session = file.text("session").value_or("");
  map.seen_as = file.text("seen_as").value_or("");
  map.robots = file.texts("robots");
  if (const auto tuple_file = file.text("tuple_file")) map.tuple_file = *tuple_file;
  for (const StreamKind kind : kStreamKinds)
    if (kind != StreamKind::landmarks) take_table(kind, file, {folder, run, context.log}, map);
  if (!map.tuple_file.empty()) {
    map.tuple_file = folder / map.tuple_file;
    if (!fs::is_regular_file(map.tuple_file))
      file.fail("tuple_file", fmt::format("the file '{}' does not exist", map.tuple_file.string()),
                "a .tuple file");
  }
  take_time_origin(file, context.definitions, map);
  file.check_keys();
  return map;
}

}  // namespace trundle::recording
