#include "trundle/pipeline/run_results.hpp"

#include <algorithm>
#include <iterator>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "trundle/io/words.hpp"
#include "trundle/pipeline/odometry_answer.hpp"
#include "trundle/pipeline/viewers/shown.hpp"

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
  if (slam.growth) results.growth = {*slam.growth};
  results.filter = slam.filter;
  results.sightings = slam.sightings;
}

/// With every pose: what is kept of a long one is computed once more.
ShownTrajectory shown_of(const RunInputs& inputs, const RunFindings& found,
                         const WrittenTrajectory& trajectory) {
  const std::string& name = trajectory.entry.name;
  if (trajectory.file.left_out == 0) return shown(name, trajectory.file.trajectory);
  const auto produce = [&inputs, &found, role = trajectory.role](const TakePose& take) {
    if (role == TrackRole::corrected)
      (void)corrected_odometry(inputs.recording(), found.slip->answer, found.robot.robot, take);
    else
      (void)answer_odometry(inputs.recording(), role == TrackRole::nominal ? inputs.given : found.robot,
                            {.reading = inputs.question.reading}, take);
  };
  return {.name = name, .has_covariance = true, .produce = produce};
}

/// What is in the file.
std::vector<std::string> names_in(const Shown& all) {
  std::vector<std::string> names;
  for (const ShownTrajectory& trajectory : all.trajectories) names.push_back(trajectory.name);
  if (!all.landmarks.empty()) names.push_back(counted(all.landmarks.size(), "landmark"));
  if (!all.slips.empty()) names.push_back(counted(all.slips.size(), "slip"));
  return names;
}

}  // namespace

Found<std::filesystem::path> write_viewer_file(const RunInputs& inputs, const RunFindings& found,
                                               const std::vector<WrittenTrajectory>& trajectories,
                                               const WriteNow& write_now) {
  if (trajectories.empty()) throw NotApplicable{"there is no trajectory to show"};
  Shown all{
      .provenance = inputs.provenance, .time_origin_s = inputs.recording().time_origin_s, .trajectories = {}};
  for (const WrittenTrajectory& trajectory : trajectories)
    all.trajectories.push_back(shown_of(inputs, found, trajectory));
  if (found.evaluation != nullptr)
    all.trajectories.push_back(shown("reference", found.evaluation->reference));
  if (found.slam != nullptr) all.landmarks = found.slam->landmarks;
  if (found.slip != nullptr) all.slips = shown_slips(found.slip->answer.report.events, found.robot.robot);
  const ViewerFormat format = *inputs.question.viewer;
  const std::filesystem::path path = inputs.in_folder("run." + std::string(name_of(format)));
  std::string message = fmt::format("wrote {}: {}", path.string(), fmt::join(names_in(all), ", "));
  OutputFile file = write_now(viewer_file(path, format, std::move(all)));
  return {.value = path, .message = std::move(message), .files = {std::move(file)}};
}

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
