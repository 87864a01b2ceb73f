#include "trundle/pipeline/run.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "trundle/io/error.hpp"
#include "trundle/pipeline/stages.hpp"

namespace trundle {
namespace {

using Json = nlohmann::ordered_json;

/// What the stages write, some of it only of some recordings.
constexpr std::array kStageFiles = {"calibrated.toml",    "calibration.json",  "nominal.csv",
                                    "nominal.json",       "odometry.csv",      "odometry.json",
                                    "trajectory.csv",     "slip.csv",          "slip.json",
                                    "localization.csv",   "localization.json", "slam/trajectory.csv",
                                    "slam/path.csv",      "slam/online.csv",   "slam/landmarks.csv",
                                    "slam/steps.csv",     "slam/slam.json",    "slam/innovations.csv",
                                    "slam/particles.csv", "reference.csv",     "evaluation.json"};

Provenance provenance_of(const Work& work, const std::vector<Recording>& learned) {
  const RunQuestion& question = work.question;
  Provenance provenance{{}, {}, question.slam.seed};
  for (const Recording& recording : work.recordings) add_inputs(recording.inputs, provenance);
  provenance.inputs.push_back(work.used.file);
  for (const Recording& recording : work.training) add_inputs(recording.inputs, provenance);
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
std::vector<std::filesystem::path> results_in(const Work& work) {
  std::vector<std::filesystem::path> files;
  for (const char* name : kStageFiles) files.push_back(work.in_folder(name));
  for (const char* name : {"run.json", "info.json", "report.html"}) files.push_back(work.in_folder(name));
  return files;
}

/// Reads everything that is named, so that a wrong input is found before anything is done.
Work prepared(const RunQuestion& question) {
  const ReadOptions how{.robot_number = question.robot_number};
  Work work{.question = question,
            .given = read_robot_file(question.before.empty() ? question.robot : question.before),
            .used = read_robot_file(question.robot),
            .recordings = read_recordings({question.recording}, how),
            .training = read_recordings(question.calibrate_on, how),
            .answer = {},
            .no_odometry = {},
            .on_steps = {}};
  const std::vector<Recording> learned = read_recordings(question.learn, how);
  require_apart(work.recordings, {question.output});
  require_apart(work.training, {question.output});
  require_apart(learned, {question.output});
  RunAnswer& answer = work.answer;
  answer.provenance = provenance_of(work, learned);
  require_apart(answer.provenance.inputs, results_in(work));
  answer.recording_name = work.recordings.size() == 1 ? work.recording().name : question.recording;
  answer.session = work.recording().session;
  answer.recording_path = question.recording;
  answer.given_robot = work.given.file.path;
  answer.used_robot = work.used.file.path;
  return work;
}

/// Writes the files of a stage; their names relative to the folder.
std::vector<std::string> save(const Work& work, const std::vector<OutputFile>& files) {
  write_files(files, work.answer.provenance.inputs);
  std::vector<std::string> names;
  for (const OutputFile& file : files)
    names.push_back(file.path.lexically_relative(work.question.output).generic_string());
  return names;
}

/// What a stage tells, or why it tells nothing.
Stage tried(Work& work, const char* name, Told (*stage)(Work&), std::vector<OutputFile>& files) {
  try {
    Told told = stage(work);
    files = std::move(told.files);
    return {name, StageStatus::done, std::move(told.message), {}, std::move(told.remarks)};
  } catch (const NotApplicable& reason) {
    return {name, StageStatus::skipped, reason.why, {}};
  } catch (const CannotAnswer& reason) {
    return {name, StageStatus::failed, reason.what(), {}};
  } catch (const InputError& reason) {
    return {name, StageStatus::failed, reason.what(), {}};
  }
}

bool is_of_reference(const Finding& problem) {
  return problem.code == FindingCode::reference_unit || problem.code == FindingCode::reference_axes;
}

/// A misreading of what the motion is made of: nothing can be told of it then.
bool is_of_motion(const Finding& problem, const Work& work) {
  if (is_of_reference(problem) || problem.code == FindingCode::clocks)
    return false;  // wheels alone are right
  if (problem.code != FindingCode::time_unit) return true;
  return std::ranges::any_of(work.recordings, [&](const Recording& recording) {
    return problem.place == recording.wheels.origin.file || problem.place == recording.gyro.origin.file ||
           problem.place == recording.velocity.origin.file;
  });
}

/// Whether a stage would tell nonsense.
bool concerns(const Finding& problem, std::string_view stage, const Work& work) {
  if (stage == "report") return false;
  if (is_of_motion(problem, work)) return true;
  if (stage == "odometry" || stage == "slip") return false;
  return !is_of_reference(problem) || stage == "calibration" || stage == "evaluation";
}

/// The stage as it stands where the health check forbids it; nothing where it does not.
std::optional<Stage> forbidden(Work& work, const char* name) {
  const auto why = std::ranges::find_if(
      work.misread, [&](const Finding& problem) { return concerns(problem, name, work); });
  if (why == work.misread.end()) return std::nullopt;
  const std::string words = fmt::format("not done: {}: {}", why->place, describe(*why));
  if (std::string_view(name) == "odometry") work.no_odometry = std::make_exception_ptr(CannotAnswer(words));
  return Stage{name, StageStatus::failed, words, {}};
}

/// The stages one after the other, told about as they go.
class Stages {
 public:
  Stages(Work& work, const OnProgress& on_progress) : work_(work), on_progress_(on_progress) {}

  void attempt(const char* name, Told (*stage)(Work&)) {
    tell({.recording = work_.answer.recording_name, .stage = name});
    if (on_progress_)
      work_.on_steps = [&](std::size_t done, std::size_t of) {
        tell({.recording = work_.answer.recording_name, .stage = name, .done = done, .of = of});
      };
    std::vector<OutputFile> files;
    const std::optional<Stage> no = forbidden(work_, name);
    Stage entry = no ? *no : tried(work_, name, stage, files);
    entry.outputs = save(work_, files);
    work_.answer.stages.push_back(std::move(entry));
    tell({.recording = work_.answer.recording_name, .stage = name, .finished = &work_.answer.stages.back()});
  }

 private:
  void tell(const RunProgress& progress) const {
    if (on_progress_) on_progress_(progress);
  }

  Work& work_;
  const OnProgress& on_progress_;
};

bool wrote(const RunAnswer& answer, const std::string& file) {
  return std::ranges::any_of(answer.stages, [&](const Stage& stage) {
    return std::ranges::find(stage.outputs, file) != stage.outputs.end();
  });
}

/// The best odometry there is, where slip cannot be told.
void keep_odometry_as_trajectory(Work& work) {
  if (work.no_odometry || wrote(work.answer, "trajectory.csv")) return;
  Stage& odometry = *std::ranges::find(work.answer.stages, "odometry", &Stage::name);
  const std::vector<std::string> kept =
      save(work, {{work.in_folder("trajectory.csv"), read_file(work.in_folder("odometry.csv"))}});
  odometry.outputs.insert(odometry.outputs.end(), kept.begin(), kept.end());
}

/// What an earlier run left in the folder: a result is of one run.
void forget_earlier(const Work& work) {
  for (const char* file : kStageFiles)
    if (!wrote(work.answer, file)) std::filesystem::remove(work.in_folder(file));
}

/// How far off it is, or else how far it went.
std::string message_of(const RunAnswer& answer) {
  for (const char* name : {"evaluation", "odometry"}) {
    const auto stage = std::ranges::find(answer.stages, name, &Stage::name);
    if (stage->status == StageStatus::done) return stage->message;
  }
  return {};
}

/// Of one recording of a session: with the robot that all of them made, in a folder below.
RunQuestion question_of_one(const Work& work, const std::filesystem::path& recording,
                            const std::string& name) {
  RunQuestion question = work.question;
  question.recording = recording.string();
  question.output = work.in_folder(name);
  question.calibrate_on.clear();
  if (!work.answer.held_out) return question;
  question.before = work.question.robot;
  question.robot = work.used.file.path;
  return question;
}

/// A session's recordings one by one; the first failure counts only where all fail.
void run_each(Work& work, const OnProgress& on_progress) {
  bool any = false;
  for (const std::filesystem::path& path : recordings_below(work.question.recording)) {
    const std::string name = path.lexically_relative(work.question.recording).generic_string();
    Stage stage{name, StageStatus::failed, {}, {name + "/run.json"}};
    try {
      const RunAnswer one = run(question_of_one(work, path, name), on_progress);
      stage.status = StageStatus::done;
      stage.message = message_of(one);
      any = true;
    } catch (const std::runtime_error& reason) {  // CannotAnswer, InputError
      stage.message = reason.what();
      if (!work.no_odometry) work.no_odometry = std::current_exception();
    }
    work.answer.recordings.push_back(name);
    work.answer.stages.push_back(std::move(stage));
  }
  if (any) work.no_odometry = nullptr;
}

void write_run_json(const Work& work) {
  write_file(work.in_folder("run.json"), printed(document_of(work.answer)));
}

}  // namespace

std::string_view name_of(StageStatus status) {
  constexpr std::array<std::string_view, 3> kNames = {"done", "skipped", "failed"};
  return kNames[static_cast<std::size_t>(status)];
}

RunAnswer run(const RunQuestion& question, const OnProgress& on_progress) {
  Work work = prepared(question);
  std::error_code ignored;                                       // where there is no such folder yet
  std::filesystem::remove(work.in_folder("run.json"), ignored);  // until all of it is of this run
  Stages stages(work, on_progress);
  stages.attempt("health check", check_health);
  stages.attempt("calibration", calibrate_robot);
  if (work.recordings.size() > 1) {
    run_each(work, on_progress);
  } else {
    stages.attempt("odometry", integrate_odometry);
    stages.attempt("slip", find_slips);
    keep_odometry_as_trajectory(work);
    stages.attempt("localization", localize_on_map);
    stages.attempt("slam", map_landmarks);
    stages.attempt("evaluation", evaluate_trajectories);
  }
  forget_earlier(work);
  write_run_json(work);  // the page shows it too
  stages.attempt("report", draw_page);
  write_run_json(work);
  if (work.no_odometry) std::rethrow_exception(work.no_odometry);
  return work.answer;
}

nlohmann::ordered_json document_of(const RunAnswer& answer) {
  Json document = {{"format", "trundle-run"}, {"format_version", 1}};
  document.update(to_json(answer.provenance));
  document["recording"] = {
      {"name", answer.recording_name}, {"session", answer.session}, {"path", answer.recording_path}};
  document["robot"] = {{"given", answer.given_robot}, {"used", answer.used_robot}};
  document["held_out"] = answer.held_out ? Json(*answer.held_out) : Json();
  document["stages"] = Json::array();
  for (const Stage& stage : answer.stages)
    document["stages"].push_back({{"name", stage.name},
                                  {"status", name_of(stage.status)},
                                  {"message", stage.message},
                                  {"remarks", stage.remarks},
                                  {"outputs", stage.outputs}});
  document["trajectories"] = Json::array();
  for (const RunTrajectory& trajectory : answer.trajectories)
    document["trajectories"].push_back(
        {{"name", trajectory.name}, {"file", trajectory.file}, {"what", trajectory.what}});
  if (!answer.recordings.empty()) document["recordings"] = answer.recordings;
  return document;
}

}  // namespace trundle
