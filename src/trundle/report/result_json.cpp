#include "trundle/report/result_json.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include <nlohmann/json.hpp>

#include "trundle/io/file.hpp"
#include "trundle/report/calibration_json.hpp"
#include "trundle/report/labels.hpp"
#include "trundle/report/result_documents.hpp"
#include "trundle/report/result_parts.hpp"

namespace trundle {
namespace {

using Json = nlohmann::ordered_json;

/// The files of one folder by what they hold.
struct Found {
  std::map<std::string, Json> documents;  ///< by name
  std::vector<ResultTrack> tracks;
  std::map<ResultKind, std::filesystem::path> tables;
};

Json document_at(const ResultFile& file) {
  const std::string text = read_file(file.path);
  if (file.name == "calibration") return parse_calibration_json(text, file.path.string());
  return parse_result_document(text, file.name, file.path.string());
}

Found read_all(const std::vector<ResultFile>& files) {
  Found found;
  for (const ResultFile& file : files) {
    if (file.kind == ResultKind::json)
      found.documents[file.name] = document_at(file);
    else if (file.kind == ResultKind::trajectory)
      found.tracks.push_back(read_track(file.path, file.name));
    else
      found.tables.try_emplace(file.kind, file.path);
  }
  return found;
}

Json document_named(const Found& found, const std::string& name) {
  const auto document = found.documents.find(name);
  return document == found.documents.end() ? Json(nullptr) : document->second;
}

/// What the filter says of itself: in a run's folder, or in that of `trundle slam`.
Json slam_of(const Found& found) {
  const Json inside = document_named(found, "slam/slam");
  return inside.is_null() ? document_named(found, "slam") : inside;
}

/// The one that the evaluation chose; the frame of a known map is the reference's.
Alignment alignment_of(const ResultTrack& track, const Json& evaluation) {
  if (track.role == "localized") return Alignment::none;
  const Json kind = evaluation.is_object() ? evaluation.value("/alignment/kind"_json_pointer, Json("start"))
                                           : Json("start");
  for (const Alignment alignment : {Alignment::none, Alignment::se2})
    if (kind == name_of(alignment)) return alignment;
  return Alignment::start;
}

/// Where an online estimate of its own is there, slam/trajectory.csv is the smoothed one.
void tell_smoothed(std::vector<ResultTrack>& tracks) {
  const bool smoothed = std::ranges::find(tracks, "slam/online", &ResultTrack::name) != tracks.end();
  const auto found = std::ranges::find(tracks, "slam/trajectory", &ResultTrack::name);
  if (smoothed && found != tracks.end()) found->role = "smoothed";
}

/// What a run calls its trajectories says which is which.
void name_roles(const Json& run, std::vector<ResultTrack>& tracks) {
  if (!run.is_object() || !run.contains("trajectories")) return;
  for (const Json& entry : run.at("trajectories")) {
    const std::string file = entry.at("file");
    const auto track = std::ranges::find(tracks, file.substr(0, file.rfind('.')), &ResultTrack::name);
    const std::string role = role_of(entry.at("name").get<std::string>());
    if (track != tracks.end() && role != "other") track->role = role;
  }
}

/// The sigmas that evaluation.json names.
ReferenceSigmas noise_in(const Json& evaluation) {
  const Json noise =
      evaluation.is_object() ? evaluation.value("reference_noise", Json(nullptr)) : Json(nullptr);
  if (!noise.is_object()) return {};
  return {noise.at("position_sigma_m"), noise.at("heading_sigma_rad")};
}

bool are_the_same(const Trajectory& a, const Trajectory& b) {
  const auto same_pose = [](const StampedPose& p, const StampedPose& q) {
    return p.time_s == q.time_s && p.pose.x == q.pose.x && p.pose.y == q.pose.y &&
           p.pose.heading == q.pose.heading;
  };
  return std::ranges::equal(a.poses, b.poses, same_pose) && std::ranges::equal(a.covariances, b.covariances);
}

/// Where nothing was corrected the result is the odometry: once is enough.
void forget_copies_of_odometry(std::vector<ResultTrack>& tracks) {
  const ResultTrack* found = track_of_role(tracks, "odometry");
  if (found == nullptr) return;
  const Trajectory odometry = found->trajectory;
  std::erase_if(tracks, [&](const ResultTrack& track) {
    return (track.role == "result" || track.role == "corrected") && are_the_same(track.trajectory, odometry);
  });
}

/// The robot that a run used, if its file is still where run.json says: in the folder, or as it was given.
std::optional<Robot> robot_used(const Json& run, const std::filesystem::path& folder) {
  const Json used = run.is_object() ? run.value("/robot/used"_json_pointer, Json(nullptr)) : Json(nullptr);
  if (!used.is_string()) return std::nullopt;
  for (const std::filesystem::path& path :
       {folder / used.get<std::string>(), std::filesystem::path(used.get<std::string>())})
    if (std::filesystem::is_regular_file(path)) return read_robot(path);
  return std::nullopt;
}

void compare_all(Found& found, ComparedWith with) {
  tell_smoothed(found.tracks);
  name_roles(document_named(found, "run"), found.tracks);
  forget_copies_of_odometry(found.tracks);
  const Json evaluation = document_named(found, "evaluation");
  if (const ResultTrack* own = track_of_role(found.tracks, "reference")) {
    with.reference = own->trajectory;
    with.noise = noise_in(evaluation);
  } else if (!with.reference.poses.empty())
    found.tracks.push_back({"reference", "reference", with.reference, {}, {}, {}, {}});
  if (with.reference.poses.empty()) return;
  for (ResultTrack& track : found.tracks)
    if (track.role != "reference") compare(track, with, alignment_of(track, evaluation));
}

/// The motion that laid the map's own trajectory on the reference.
Pose2 map_laid_by(const std::vector<ResultTrack>& tracks) {
  for (const char* role : {"path", "smoothed", "online", "localized", "result"})
    if (const ResultTrack* track = track_of_role(tracks, role)) return track->laid_by;
  return {};
}

Json slip_of(const Found& found, const ResultTrack* track) {
  if (const Json document = document_named(found, "slip"); document.is_object())
    return slip_json(document, track);
  const auto csv = found.tables.find(ResultKind::slips);
  return csv == found.tables.end() ? Json(nullptr) : slip_json(csv->second, track);
}

template <typename Make>
Json from_table(const Found& found, ResultKind kind, Make make) {
  const auto csv = found.tables.find(kind);
  return csv == found.tables.end() ? Json(nullptr) : make(csv->second);
}

/// Errors that there are no tracks for, in words.
Json not_compared(const std::vector<ResultTrack>& tracks) {
  Json all = Json::array();
  for (const ResultTrack& track : tracks)
    if (!track.not_compared.empty()) all.push_back({{"name", track.name}, {"reason", track.not_compared}});
  return all;
}

/// First and last stamp of what has a time; null where nothing has.
Json span_of(const std::vector<ResultTrack>& tracks) {
  Json span = nullptr;
  for (const ResultTrack& track : tracks) {
    if (track.trajectory.poses.empty()) continue;
    const double first = track.trajectory.poses.front().time_s, last = track.trajectory.poses.back().time_s;
    span = span.is_null()
               ? Json{first, last}
               : Json{std::min(first, span[0].get<double>()), std::max(last, span[1].get<double>())};
  }
  return span;
}

Json source_json(const ResultFile& file) {
  const InputFile input = input_file(file.path);
  Json source = {{"name", file.name}, {"path", input.path}, {"sha256", input.sha256}};
  source["made_by"] = file.kind == ResultKind::json ? std::vector<std::string>{} : head_lines(file.path);
  return source;
}

Json run_of(const Json& run) {
  if (run.is_null()) return nullptr;
  Json asked = run;
  asked.erase("stages");
  return asked;
}

/// All but the report itself, so that drawing a folder again gives the same bytes.
Json stages_of(const Json& run) {
  Json stages = Json::array();
  if (run.is_null()) return stages;
  for (const Json& stage : run.at("stages"))
    if (stage.at("name") != "report") stages.push_back(stage);
  return stages;
}

Json parts_of(const Found& found) {
  const ResultTrack* track = main_track(found.tracks);
  const Json info = document_named(found, "info");
  const Json run = document_named(found, "run");
  Json result = {{"run", run_of(run)},
                 {"stages", stages_of(run)},
                 {"health", info},
                 {"calibration", document_named(found, "calibration")},
                 {"tracks", tracks_json(found.tracks)},
                 {"errors", errors_json(found.tracks)},
                 {"not_compared", not_compared(found.tracks)},
                 {"slip", slip_of(found, track)},
                 {"gyro", gyro_json(document_named(found, "odometry"), slam_of(found), info)}};
  const Pose2 laid_by = map_laid_by(found.tracks);
  result["map"] =
      from_table(found, ResultKind::landmarks, [&](const auto& csv) { return map_json(csv, laid_by); });
  result["particles"] =
      from_table(found, ResultKind::particles, [&](const auto& csv) { return particles_json(csv, laid_by); });
  result["slam"] = slam_of(found);
  result["filter"] = from_table(found, ResultKind::filter_steps, filter_json);
  result["sightings"] = from_table(found, ResultKind::innovations, sightings_json);
  return result;
}

/// A result's own parts with what stands above them.
Json headed(const std::string& label, const Json& span_s, const Json& parts) {
  Json result = {{"label", label}, {"origin_s", 0.0}, {"span_s", span_s}};
  result["answers"] = answers_json(parts);
  result["attention"] = attention_json(parts);
  result.update(parts);
  return result;
}

bool overlap(const Json& a, const Json& b) {
  return a[0] <= b[1] && b[0] <= a[1];
}

/// What the page calls 0: that of the stamps, as in all files, unless these have too many digits to be read,
/// like seconds since 1970; then the whole second before the first of those spans that overlap with this one.
double origin_of(const Json& span, std::span<const Json> results) {
  constexpr double kManyDigits = 1e5;
  double first = span[0];
  for (const Json& other : results)
    if (other.at("span_s").is_array() && overlap(span, other.at("span_s")))
      first = std::min(first, other.at("span_s")[0].get<double>());
  return std::abs(first) < kManyDigits ? 0.0 : std::floor(first);
}

}  // namespace

Json read_result(const std::filesystem::path& input, const ComparedWith& with) {
  const std::vector<ResultFile> files = result_files(input);
  Found found = read_all(files);
  ComparedWith compared = with;
  if (!compared.robot) compared.robot = robot_used(document_named(found, "run"), input);
  compare_all(found, std::move(compared));
  Json parts = parts_of(found);
  parts["sources"] = Json::array();
  for (const ResultFile& file : files)
    if (file.name != "run")
      parts["sources"].push_back(source_json(file));  // run.json is written after the page
  return headed(input.string(), span_of(found.tracks), parts);
}

Json result_of_calibration(const Json& calibration) {
  Found found;
  found.documents["calibration"] = calibration;
  Json parts = parts_of(found);
  parts["sources"] = Json::array();
  return headed("", nullptr, parts);
}

Json report_json(std::span<const Json> results, const Json& provenance) {
  Json document = {
      {"format", kReportFormat}, {"format_version", kReportFormatVersion}, {"provenance", provenance}};
  document["results"] = Json::array();
  std::vector<std::string> labels;
  for (const Json& result : results) labels.push_back(result.at("label"));
  if (labels.size() > 1) labels = shortest_labels(labels);
  for (std::size_t i = 0; i < results.size(); ++i) {
    Json result = results[i];
    result["label"] = labels[i];
    if (result.at("span_s").is_array()) result["origin_s"] = origin_of(result.at("span_s"), results);
    document["results"].push_back(std::move(result));
  }
  return document;
}

}  // namespace trundle
