#include "trundle/pipeline/run_results.hpp"

#include <algorithm>

namespace trundle::pipeline {
namespace {

/// By the names of their files.
std::vector<ResultTrack> tracks_of(const RunFindings& found) {
  std::vector<ResultTrack> tracks;
  for (const auto& [entry, role, file] : trajectories_of(found))
    tracks.push_back(
        {.name = entry.file.substr(0, entry.file.rfind('.')), .role = role, .trajectory = file.trajectory});
  if (found.evaluation != nullptr)
    tracks.push_back(
        {.name = "reference", .role = TrackRole::reference, .trajectory = found.evaluation->reference});
  std::ranges::sort(tracks, {}, &ResultTrack::name);
  return tracks;
}

void add_slam(const SlamStage& slam, Results& results) {
  results.slam = slam.summary;
  results.landmarks = slam.landmarks;
  results.particles = slam.particles;
  results.filter = slam.filter;
  results.sightings = slam.sightings;
}

}  // namespace

std::vector<WrittenTrajectory> trajectories_of(const RunFindings& found) {
  std::vector<WrittenTrajectory> all;
  if (found.odometry != nullptr) all = found.odometry->trajectories;
  if (found.slip != nullptr) all.push_back(found.slip->corrected);
  if (found.localization != nullptr) all.push_back(*found.localization);
  if (found.slam != nullptr)
    all.insert(all.end(), found.slam->trajectories.begin(), found.slam->trajectories.end());
  return all;
}

Results results_of(const RunFindings& found, const RunRecord& record, const std::string& label,
                   std::vector<ResultSource> sources) {
  Results results{.label = label,
                  .run = record,
                  .tracks = tracks_of(found),
                  .robot = found.robot.robot,
                  .sources = std::move(sources)};
  if (found.health != nullptr) results.info = found.health->info;
  if (found.calibration != nullptr) results.calibration = found.calibration->document;
  if (found.odometry != nullptr) results.odometry = found.odometry->result;
  if (found.slip != nullptr) results.slip = found.slip->result;
  if (found.slam != nullptr) add_slam(*found.slam, results);
  if (found.evaluation != nullptr) results.evaluation = found.evaluation->summary;
  return results;
}

}  // namespace trundle::pipeline
