#include "trundle/pipeline/run_inputs.hpp"

#include <algorithm>
#include <array>

namespace trundle::pipeline {
namespace {

/// What a run of one recording writes, some of it only of some, besides the folder slam/.
constexpr std::array kStageFiles = {
    "calibrated.toml",   "calibration.json", "nominal.csv",     "nominal.json", "odometry.csv",
    "odometry.json",     "trajectory.csv",   "slip.csv",        "slip.json",    "localization.csv",
    "localization.json", "reference.csv",    "evaluation.json", "run.json",     "info.json",
    "report.html",       "run.mcap",         "run.wpilog"};

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
  if (question.viewer) provenance.options.emplace_back("export", std::string(name_of(*question.viewer)));
  add_read_options(question.reading, provenance);
  return provenance;
}

std::set<std::string> names_of_one(const std::string& folder) {
  std::set<std::string> names;
  for (const char* name : kStageFiles) names.insert(folder + name);
  for (const std::string& name : slam_file_names()) names.insert(folder + "slam/" + name);
  return names;
}

/// The recordings of a session whose results are in the folder; none where there is no such record.
std::vector<std::string> recordings_in(const std::filesystem::path& folder) {
  const std::string file = (folder / "run.json").string();
  try {
    std::vector<std::string> names = run_record_from_json(read_file(file), file).recordings;
    std::erase_if(names, [](const std::filesystem::path& name) {
      return name.is_absolute() || *name.lexically_normal().begin() == "..";
    });
    return names;
  } catch (const InputError&) {
    return {};
  }
}

}  // namespace

RunInputs read_run_inputs(const RunQuestion& question, const std::optional<RobotFile>& robot) {
  const ReadOptions how = question.reading;
  RunInputs inputs{.question = question,
                   .given = read_robot_file(question.before.empty() ? question.robot : question.before),
                   .robot = robot ? *robot : read_robot_file(question.robot),
                   .recordings = read_recordings({question.recording}, how),
                   .training = read_recordings(question.calibrate_on, how),
                   .provenance = {}};
  const std::vector<Recording> learned = read_recordings(question.learn, how);
  require_apart(inputs.recordings, {question.output});
  require_apart(inputs.training, {question.output});
  require_apart(learned, {question.output});
  inputs.provenance = provenance_of(inputs, learned);
  std::vector<std::filesystem::path> results;
  for (const std::string& name : result_names(inputs)) results.push_back(inputs.in_folder(name));
  require_apart(inputs.provenance.inputs, results);
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

std::set<std::string> result_names(const RunInputs& inputs) {
  std::set<std::string> names = names_of_one("");
  for (const std::string& recording : recordings_in(inputs.question.output))
    names.merge(names_of_one(recording + "/"));
  return names;
}

}  // namespace trundle::pipeline
