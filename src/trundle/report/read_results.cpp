#include <algorithm>
#include <map>

#include "trundle/report/result_files.hpp"
#include "trundle/report/results.hpp"

namespace trundle::report {
namespace {

void read_document(const ResultFile& file, Results& results) {
  const std::string text = read_file(file.path), place = file.path.string();
  if (file.name == "run") results.run = run_record_from_json(text, place);
  if (file.name == "info") results.info = info_from_json(text, place);
  if (file.name == "calibration") results.calibration = calibration_from_json(text, place);
  if (file.name == "odometry") results.odometry = odometry_from_json(text, place);
  if (file.name == "slip") results.slip = slip_from_json(text, place);
  if (file.name == "evaluation") results.evaluation = evaluation_from_json(text, place);
  // In the folder of a run, or in that of `trundle slam`: the former comes later, and counts.
  if (file.name == "slam" || file.name == "slam/slam") results.slam = slam_from_json(text, file.name, place);
  if (file.name == "growth" || file.name == "slam/growth") results.growth = {growth_from_json(text, place)};
}

/// Of each kind the first by its name.
using Tables = std::map<ResultKind, std::filesystem::path>;

template <typename T>
void read_table(const Tables& tables, ResultKind kind, T (*read)(const std::filesystem::path&),
                std::optional<T>& into) {
  if (const auto csv = tables.find(kind); csv != tables.end()) into = read(csv->second);
}

void read_tables(const Tables& tables, Results& results) {
  if (!results.slip) read_table(tables, ResultKind::slips, slip_from_csv, results.slip);
  read_table(tables, ResultKind::landmarks, landmarks_from_csv, results.landmarks);
  read_table(tables, ResultKind::particles, particles_from_csv, results.particles);
  read_table(tables, ResultKind::filter_steps, filter_from_csv, results.filter);
  read_table(tables, ResultKind::innovations, sightings_from_csv, results.sightings);
}

/// Where an online estimate of its own is there, slam/trajectory.csv is the smoothed one.
void mark_smoothed(std::vector<ResultTrack>& tracks) {
  const bool smoothed = std::ranges::find(tracks, "slam/online", &ResultTrack::name) != tracks.end();
  const auto found = std::ranges::find(tracks, "slam/trajectory", &ResultTrack::name);
  if (smoothed && found != tracks.end()) found->role = TrackRole::smoothed;
}

/// What a run calls its trajectories says which is which.
void take_roles_from(const RunRecord& run, std::vector<ResultTrack>& tracks) {
  for (const RunTrajectory& entry : run.trajectories) {
    const std::string name = entry.file.substr(0, entry.file.rfind('.'));
    const auto track = std::ranges::find(tracks, name, &ResultTrack::name);
    const TrackRole role = role_of(entry.name);
    if (track != tracks.end() && role != TrackRole::other) track->role = role;
  }
}

/// Of several robots together what is of each is in a folder of its own, beside slam.json.
std::vector<ResultFile> files_of_robots(const std::filesystem::path& folder, const Results& results) {
  std::vector<ResultFile> files;
  if (!results.slam) return files;
  for (const std::string& robot : results.slam->robots) {
    const std::filesystem::path own = folder / std::filesystem::path(robot).filename();
    for (const auto& [name, kind] :
         {std::pair{"trajectory.csv", ResultKind::trajectory}, {"growth.json", ResultKind::json}})
      if (std::filesystem::is_regular_file(own / name)) files.push_back({robot, own / name, kind});
  }
  return files;
}

void read_file_of_robot(const ResultFile& file, Results& results) {
  if (file.kind == ResultKind::json) {
    results.growth.push_back(growth_from_json(read_file(file.path), file.path.string()));
    results.growth.back().robot = file.name;
  } else {
    results.tracks.push_back(read_track(file.path, file.name));
    results.tracks.back().role = TrackRole::other;
  }
}

/// The lines at the head of a CSV file that say how it was made.
std::vector<std::string> head_lines(std::string_view content) {
  std::vector<std::string> lines;
  while (content.starts_with("# ")) {
    const std::string_view line = content.substr(0, content.find('\n'));
    lines.emplace_back(line.substr(2));
    content.remove_prefix(std::min(content.size(), line.size() + 1));
  }
  return lines;
}

}  // namespace

Results read_results(const std::filesystem::path& input) {
  Results results{.label = input.string()};
  Tables tables;
  std::vector<ResultFile> files = result_files(input);
  for (const ResultFile& file : files) {
    if (file.kind == ResultKind::json)
      read_document(file, results);
    else if (file.kind == ResultKind::trajectory)
      results.tracks.push_back(read_track(file.path, file.name));
    else
      tables.try_emplace(file.kind, file.path);
  }
  for (ResultFile& file : files_of_robots(input, results)) {
    read_file_of_robot(file, results);
    files.push_back(std::move(file));
  }
  read_tables(tables, results);
  mark_smoothed(results.tracks);
  if (results.run) take_roles_from(*results.run, results.tracks);
  for (const ResultFile& file : files)
    if (file.name != "run")  // run.json is written after the page
      results.sources.push_back(source_of(file.name, file.path, read_file(file.path)));
  return results;
}

std::optional<Robot> read_robot_used(const std::optional<RunRecord>& run,
                                     const std::filesystem::path& folder) {
  if (!run || run->used_robot.empty()) return std::nullopt;
  for (const std::filesystem::path& path : {folder / run->used_robot, std::filesystem::path(run->used_robot)})
    if (std::filesystem::is_regular_file(path)) return read_robot(path);
  return std::nullopt;
}

ResultSource source_of(const std::string& name, const std::filesystem::path& path, std::string_view content) {
  ResultSource source{.name = name, .file = {path.string(), sha256_of(content)}};
  if (path.extension() != ".json") source.made_by = head_lines(content);
  return source;
}

}  // namespace trundle::report
