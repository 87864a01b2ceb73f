#include "trundle/report/result_json.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include <nlohmann/json.hpp>

#include "trundle/report/calibration_parts.hpp"
#include "trundle/report/labels.hpp"
#include "trundle/report/or_null.hpp"
#include "trundle/report/result_parts.hpp"

namespace trundle::report {
namespace {

using Json = nlohmann::ordered_json;

/// The one that the evaluation chose; the frame of a known map is the reference's.
Alignment alignment_of(const ResultTrack& track, const Results& results) {
  if (track.role == TrackRole::localized) return Alignment::none;
  return results.evaluation ? results.evaluation->alignment : Alignment::start;
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
  const ResultTrack* found = track_of_role(tracks, TrackRole::odometry);
  if (found == nullptr) return;
  const Trajectory odometry = found->trajectory;
  std::erase_if(tracks, [&](const ResultTrack& track) {
    return (track.role == TrackRole::result || track.role == TrackRole::corrected) &&
           are_the_same(track.trajectory, odometry);
  });
}

void compare_all(Results& results, ComparedWith with) {
  forget_copies_of_odometry(results.tracks);
  if (!with.robot) with.robot = results.robot;
  if (const ResultTrack* own = track_of_role(results.tracks, TrackRole::reference)) {
    with.reference = own->trajectory;
    with.noise = results.evaluation ? results.evaluation->noise : ReferenceSigmas{};
  } else if (!with.reference.poses.empty()) {
    results.tracks.push_back(
        {.name = "reference", .role = TrackRole::reference, .trajectory = with.reference});
  }
  if (with.reference.poses.empty()) return;
  for (ResultTrack& track : results.tracks)
    if (track.role != TrackRole::reference) compare(track, with, alignment_of(track, results));
}

/// The motion that laid the map's own trajectory on the reference.
Pose2 map_laid_by(const std::vector<ResultTrack>& tracks) {
  using enum TrackRole;
  for (const TrackRole role : {path, smoothed, online, localized, result})
    if (const ResultTrack* track = track_of_role(tracks, role)) return track->laid_by;
  return {};
}

/// The motion that laid the online estimate; the map's own where that is not there.
Pose2 growth_laid_by(const std::vector<ResultTrack>& tracks) {
  const ResultTrack* online = track_of_role(tracks, TrackRole::online);
  return online != nullptr ? online->laid_by : map_laid_by(tracks);
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

/// What the heads of several files say is said by the first of them.
Json sources_json(const std::vector<ResultSource>& sources) {
  Json all = Json::array();
  std::set<std::string> said;
  for (const ResultSource& source : sources) {
    Json made_by = Json::array();
    for (const std::string& line : source.made_by)
      if (said.insert(line).second) made_by.push_back(line);
    all.push_back({{"name", source.name},
                   {"path", source.file.path},
                   {"sha256", source.file.sha256},
                   {"made_by", std::move(made_by)}});
  }
  return all;
}

Json run_json(const std::optional<RunRecord>& run) {
  if (!run) return nullptr;
  Json asked = to_json(*run);
  asked.erase("stages");
  return asked;
}

/// All but the report itself, so that drawing a folder again gives the same bytes.
Json stages_json(const std::optional<RunRecord>& run) {
  Json stages = Json::array();
  if (!run) return stages;
  for (const Stage& stage : run->stages)
    if (stage.kind != StageKind::report) stages.push_back(to_json(stage));
  return stages;
}

constexpr auto whole_document = [](const auto& result) { return result.document; };

/// The gyro's bias over time is drawn of "gyro".
constexpr auto without_bias = [](const auto& result) {
  Json document = result.document;
  document.erase("gyro_bias_over_time");
  return document;
};

Json parts_of(const Results& results, std::size_t rows) {
  const ResultTrack* track = main_track(results.tracks);
  const Pose2 laid_by = map_laid_by(results.tracks);
  const auto slip = [&](const SlipResult& found) { return slip_json(found, track, rows); };
  const auto map = [&](const auto& landmarks) { return map_json(landmarks, laid_by); };
  const auto particles = [&](const auto& cloud) { return particles_json(cloud, laid_by); };
  Json growth = Json::array();
  for (const GrowthResult& one : results.growth)
    growth.push_back(growth_json(one, growth_laid_by(results.tracks), rows));
  const auto calibration = [&](const auto& found) { return with_thinned_runs(found.document, rows); };
  const auto filter = [&](const auto& columns) { return filter_json(columns, rows); };
  const auto sightings = [&](const auto& columns) { return sightings_json(columns, rows); };
  return {{"run", run_json(results.run)},
          {"stages", stages_json(results.run)},
          {"health", or_null(results.info, whole_document)},
          {"calibration", or_null(results.calibration, calibration)},
          {"tracks", tracks_json(results.tracks, rows)},
          {"errors", errors_json(results.tracks, rows)},
          {"not_compared", not_compared(results.tracks)},
          {"slip", or_null(results.slip, slip)},
          {"gyro", gyro_json(results)},
          {"map", or_null(results.landmarks, map)},
          {"particles", or_null(results.particles, particles)},
          {"growth", std::move(growth)},
          {"slam", or_null(results.slam, without_bias)},
          {"filter", or_null(results.filter, filter)},
          {"sightings", or_null(results.sightings, sightings)},
          {"sources", sources_json(results.sources)}};
}

bool overlap(const Json& a, const Json& b) {
  return a[0] <= b[1] && b[0] <= a[1];
}

/// What the page calls 0: that of the stamps, as in all files, unless these have too many digits to be read,
/// like seconds since 1970; then the whole second before the first of those spans that overlap with this one.
double origin_of(const Json& span, std::span<const Json> results) {
  constexpr double kManyDigits = 1e5;  // [s]: stamps since a start stay below for a day
  double first = span[0];
  for (const Json& other : results)
    if (other.at("span_s").is_array() && overlap(span, other.at("span_s")))
      first = std::min(first, other.at("span_s")[0].get<double>());
  return std::abs(first) < kManyDigits ? 0.0 : std::floor(first);
}

}  // namespace

Json result_json(Results results, ComparedWith with, std::size_t rows) {
  compare_all(results, std::move(with));
  const Json parts = parts_of(results, rows);
  Json result = {{"label", results.label}, {"origin_s", 0.0}, {"span_s", span_of(results.tracks)}};
  result["answers"] = answers_json(parts);
  result["attention"] = attention_json(parts, results);
  result.update(parts);
  return result;
}

Json read_result(const std::filesystem::path& input, const ComparedWith& with) {
  Results results = read_results(input);
  if (!with.robot) results.robot = read_robot_used(results.run, input);
  return result_json(std::move(results), with);
}

Json result_of_calibration(const Json& calibration) {
  return result_json({.label = "", .calibration = CalibrationDocument{calibration}});
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

}  // namespace trundle::report
