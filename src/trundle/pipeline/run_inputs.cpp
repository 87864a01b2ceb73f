#include "trundle/pipeline/run_inputs.hpp"

#include <algorithm>
#include <array>

namespace trundle::pipeline {
namespace {

/// What the stages write, some of it only of some recordings.
constexpr std::array kStageFiles = {
    "calibrated.toml", "calibration.json", "nominal.csv",          "nominal.json",
    "odometry.csv",    "odometry.json",    "trajectory.csv",       "slip.csv",
    "slip.json",       "localization.csv", "localization.json",    "slam/trajectory.csv",
    "slam/path.csv",   "slam/online.csv",  "slam/landmarks.csv",   "slam/landmarks_covariance.csv",
    "slam/steps.csv",  "slam/slam.json",   "slam/innovations.csv", "slam/particles.csv",
    "reference.csv",   "evaluation.json"};

Provenance provenance_of(const RunInputs& inputs, const std::vector<Recording>& learned) {
  const RunQuestion& question = inputs.question;
  Provenance provenance{{}, {}, question.slam.seed};
  for (const Recording& recording : inputs.recordings) add_inputs(recording.inputs, provenance);
  provenance.inputs.push_back(inputs.robot.file);
  for (const Recording& recording : inputs.training) add_inputs(recording.inputs, provenance);
  for (const Recording& recording : learned) add_inputs(recording.inputs, provenance);
  for (const std::string& folder : question.calibrate_on)
    provenance.options.emplace_back("calibrate-on", folder);
  for (const std::string& name : question.calibrate.free) provenance.options.emplace_back("free", name);
  for (const std::string& name : question.calibrate.fix) provenance.options.emplace_back("fix", name);
  for (const std::string& folder : question.learn) provenance.options.emplace_back("learn", folder);
  if (!question.map.empty()) {
    provenance.inputs.push_back(input_file(question.map));
    provenance.options.emplace_back("map", question.map);
  }
  provenance.options.emplace_back("filter", std::string(name_of(question.slam.method)));
  provenance.options.emplace_back("particles", std::to_string(question.slam.particles));
  add_robot_number(question.robot_number, provenance);
  return provenance;
}

/// Every file that a run may write.
std::vector<std::filesystem::path> results_in(const RunInputs& inputs) {
  std::vector<std::filesystem::path> files;
  for (const char* name : kStageFiles) files.push_back(inputs.in_folder(name));
  for (const char* name : {"run.json", "info.json", "report.html"}) files.push_back(inputs.in_folder(name));
  return files;
}

bool wrote(const RunRecord& record, const std::string& file) {
  return std::ranges::any_of(record.stages, [&](const Stage& stage) {
    return std::ranges::find(stage.outputs, file) != stage.outputs.end();
  });
}

}  // namespace

RunInputs read_run_inputs(const RunQuestion& question) {
  const ReadOptions how{.robot_number = question.robot_number};
  RunInputs inputs{.question = question,
                   .given = read_robot_file(question.before.empty() ? question.robot : question.before),
                   .robot = read_robot_file(question.robot),
                   .recordings = read_recordings({question.recording}, how),
                   .training = read_recordings(question.calibrate_on, how),
                   .provenance = {}};
  const std::vector<Recording> learned = read_recordings(question.learn, how);
  require_apart(inputs.recordings, {question.output});
  require_apart(inputs.training, {question.output});
  require_apart(learned, {question.output});
  inputs.provenance = provenance_of(inputs, learned);
  require_apart(inputs.provenance.inputs, results_in(inputs));
  return inputs;
}

RunRecord record_of(const RunInputs& inputs) {
  return {.provenance = inputs.provenance,
          .recording_name = inputs.is_session() ? inputs.question.recording : inputs.recording().name,
          .session = inputs.recording().session,
          .recording_path = inputs.question.recording,
          .given_robot = inputs.given.file.path,
          .used_robot = inputs.robot.file.path};
}

void forget_earlier(const RunInputs& inputs, const RunRecord& record) {
  for (const char* file : kStageFiles)
    if (!wrote(record, file)) std::filesystem::remove(inputs.in_folder(file));
}

}  // namespace trundle::pipeline
