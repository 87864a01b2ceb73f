#include "trundle/pipeline/run_results.hpp"

#include <algorithm>
#include <iterator>

namespace trundle::pipeline {
namespace {

/// By the names of their files.
std::vector<ResultTrack> tracks_of(std::vector<WrittenTrajectory> trajectories,
                                   const EvaluationStage* evaluation) {
  std::vector<ResultTrack> tracks;
  for (auto& [entry, role, file] : trajectories)
    tracks.push_back({.name = entry.file.substr(0, entry.file.rfind('.')),
                      .role = role,
                      .trajectory = std::move(file.trajectory),
                      .left_out = file.left_out});
  if (evaluation != nullptr)
    tracks.push_back(
        {.name = "reference", .role = TrackRole::reference, .trajectory = evaluation->reference});
  std::ranges::sort(tracks, {}, &ResultTrack::name);
  return tracks;
}

void append(std::vector<WrittenTrajectory>& more, std::vector<WrittenTrajectory>& all) {
  std::ranges::move(more, std::back_inserter(all));
}

void add_slam(const SlamStage& slam, Results& results) {
  results.slam = slam.summary;
  results.landmarks = slam.landmarks;
  results.particles = slam.particles;
  results.filter = slam.filter;
  results.sightings = slam.sightings;
}

}  // namespace

std::vector<WrittenTrajectory> take_trajectories(const RunFindings& found) {
  std::vector<WrittenTrajectory> all;
  if (found.odometry != nullptr) append(found.odometry->trajectories, all);
  if (found.slip != nullptr) all.push_back(std::move(found.slip->corrected));
  if (found.localization != nullptr) all.push_back(std::move(*found.localization));
  if (found.slam != nullptr) append(found.slam->trajectories, all);
  return all;
}

Results results_of(const RunFindings& found, std::vector<WrittenTrajectory> trajectories,
                   const RunRecord& record, const std::string& label) {
  Results results{.label = label,
                  .run = record,
                  .tracks = tracks_of(std::move(trajectories), found.evaluation),
                  .robot = found.robot.robot};
  if (found.health != nullptr) results.info = found.health->info;
  if (found.calibration != nullptr) results.calibration = found.calibration->document;
  if (found.odometry != nullptr) results.odometry = found.odometry->result;
  if (found.slip != nullptr) results.slip = found.slip->result;
  if (found.slam != nullptr) add_slam(*found.slam, results);
  if (found.evaluation != nullptr) results.evaluation = found.evaluation->summary;
  return results;
}

}  // namespace trundle::pipeline
