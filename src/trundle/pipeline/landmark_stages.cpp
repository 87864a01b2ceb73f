#include <algorithm>
#include <cassert>
#include <cmath>

#include <nlohmann/json.hpp>

#include "trundle/pipeline/innovations.hpp"
#include "trundle/pipeline/localize_answer.hpp"
#include "trundle/pipeline/sentences.hpp"
#include "trundle/pipeline/stages.hpp"

namespace trundle::pipeline {
namespace {

void require_sightings(const RunInputs& inputs, const RobotFile& robot) {
  if (inputs.recording().sightings.empty()) throw NotApplicable{"the recording has no sightings"};
  if (!robot.robot.landmark_sensor) throw NotApplicable{"the robot file has no [landmark_sensor]"};
}

/// What a layout that knows its landmarks says of them.
MapFile map_of(const Recording& recording) {
  const auto is_of_landmarks = [](const InputFile& input) {
    return std::filesystem::path(input.path).filename().string().starts_with("Landmark");
  };
  const auto file = std::ranges::find_if(recording.inputs, is_of_landmarks);
  MapFile map{.landmarks = {}, .file = file == recording.inputs.end() ? recording.inputs.front() : *file};
  for (const Landmark& landmark : recording.landmarks)
    map.landmarks.push_back({.name = landmark.name, .position = landmark.position});
  return map;
}

/// Where the landmarks are.
MapFile known_map_of(const RunInputs& inputs) {
  if (!inputs.question.map.empty()) return read_map_file(inputs.question.map);
  const std::filesystem::path path = std::filesystem::path(inputs.question.recording) / "landmarks.csv";
  if (std::filesystem::exists(path)) return read_map_file(path);
  if (inputs.recording().landmarks.empty()) throw NotApplicable{"no map given (--map or landmarks.csv)"};
  return map_of(inputs.recording());
}

/// Smoothed; where the sightings do not determine that, what the filter alone can say.
SlamAnswer answer_slam_smoothed(const RunInputs& inputs, const RobotFile& robot, SlamQuestion question,
                                const SlipAnswer* slip) {
  try {
    question.smooth = true;
    return answer_slam(inputs.recording(), robot, question, slip);
  } catch (const CannotAnswer&) {
    question.smooth = false;
    return answer_slam(inputs.recording(), robot, question, slip);
  }
}

WrittenTrajectory written_slam(RunTrajectory entry, TrackRole role, const Trajectory& trajectory,
                               const RunInputs& inputs, const std::vector<OutputFile>& files) {
  const auto file = std::ranges::find(files, inputs.in_folder("slam") / entry.file, &OutputFile::path);
  assert(file != files.end());
  entry.file = "slam/" + entry.file;
  return {.entry = std::move(entry), .role = role, .file = written_trajectory(trajectory, *file)};
}

/// The filter's estimates first: the smoother has seen more than they had.
std::vector<WrittenTrajectory> trajectories_of(const SlamAnswer& slam, const RunInputs& inputs,
                                               const std::vector<OutputFile>& files) {
  std::vector<WrittenTrajectory> all;
  const auto add = [&](RunTrajectory entry, TrackRole role, const Trajectory& trajectory) {
    all.push_back(written_slam(std::move(entry), role, trajectory, inputs, files));
  };
  add({"slam online", slam.smoothed ? "online.csv" : "trajectory.csv",
       "with landmarks, from what was seen up to then"},
      TrackRole::online, slam.result.online);
  if (slam.result.path)
    add({"slam path", "path.csv", "with landmarks, the whole path of the best particle"}, TrackRole::path,
        *slam.result.path);
  if (slam.smoothed)
    add({"slam", "trajectory.csv", "with landmarks, smoothed: from all that was seen, before and after"},
        TrackRole::smoothed, slam.smoothed->trajectory);
  return all;
}

std::optional<ParticleColumns> particles_of(const SlamAnswer& slam) {
  if (slam.result.particles.empty()) return std::nullopt;
  ParticleColumns columns;
  for (const WeightedPose& particle : slam.result.particles) {
    columns.x_m.push_back(particle.pose.x);
    columns.y_m.push_back(particle.pose.y);
    columns.weight.push_back(particle.weight);
  }
  return columns;
}

FilterColumns filter_of(const SlamAnswer& slam) {
  FilterColumns columns;
  std::vector<double>& greatest_weight = columns.greatest_weight.emplace();
  for (std::size_t k = 0; k < slam.input.steps.size(); ++k) {
    const StepReport& report = slam.result.reports[k];
    columns.time_s.push_back(slam.input.steps[k].time_s);
    columns.effective_particles.push_back(report.effective_particles);
    columns.resampled.push_back(report.resampled ? 1.0 : 0.0);
    greatest_weight.push_back(report.greatest_weight);
  }
  return columns;
}

SightingColumns sightings_of(const SlamAnswer& slam) {
  SightingColumns columns;
  for (std::size_t k = 0; k < slam.input.steps.size(); ++k) {
    const SlamStep& step = slam.input.steps[k];
    for (std::size_t i = 0; i < step.observations.size(); ++i) {
      const ObservationReport& report = slam.result.reports[k].observations[i];
      columns.time_s.push_back(step.time_s);
      columns.landmark.push_back(landmark_in(step.observations[i], report, slam.input.landmarks));
      columns.decision.push_back(report.decision);
      columns.nis.push_back(report.nis > 0.0 ? report.nis : std::nan(""));
    }
  }
  return columns;
}

}  // namespace

Found<WrittenTrajectory> localize_on_map(const RunInputs& inputs, const RobotFile& robot, const Slip* slip) {
  require_sightings(inputs, robot);
  const MapFile map = known_map_of(inputs);
  LocalizeQuestion question{.seed = inputs.question.slam.seed, .reading = inputs.question.reading};
  if (slip != nullptr) question.slip = slip_question(inputs);
  const LocalizeAnswer answer =
      answer_localize(inputs.recording(), robot, map, question, slip == nullptr ? nullptr : &slip->answer);
  const OutputFile csv =
      trajectory_csv(inputs.in_folder("localization.csv"), answer.provenance, answer.result.trajectory);
  return {.value = written({"localization", "localization.csv", "on the known map, where the pose is known"},
                           TrackRole::localized, answer.result.trajectory, csv),
          .message = sentence_of(answer),
          .files = {csv, {inputs.in_folder("localization.json"), printed(document_of(answer))}}};
}

Found<SlamStage> map_landmarks(const RunInputs& inputs, const RobotFile& robot, const Slip* slip,
                               const OnSteps& on_steps) {
  require_sightings(inputs, robot);
  SlamQuestion question = inputs.question.slam;
  question.reading = inputs.question.reading;
  question.on_steps = on_steps;
  if (slip != nullptr) question.slip = slip_question(inputs);
  const SlamAnswer slam =
      answer_slam_smoothed(inputs, robot, question, slip == nullptr ? nullptr : &slip->answer);
  const std::vector<OutputFile> files = files_of(slam, inputs.in_folder("slam"));
  return {.value = {.trajectories = trajectories_of(slam, inputs, files),
                    .summary = slam_summary_of(slam),
                    .landmarks = landmark_rows_of(slam),
                    .particles = particles_of(slam),
                    .growth = growth_of(slam),
                    .filter = filter_of(slam),
                    .sightings = sightings_of(slam)},
          .message = sentence_of(slam),
          .files = files};
}

}  // namespace trundle::pipeline
