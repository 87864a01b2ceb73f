#include "trundle/pipeline/run.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <span>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "trundle/inspection/findings.hpp"
#include "trundle/io/file.hpp"
#include "trundle/io/words.hpp"
#include "trundle/pipeline/run_results.hpp"
#include "trundle/pipeline/stages.hpp"
#include "trundle/recording/alignment/align.hpp"
#include "trundle/recording/time_offset.hpp"
#include "trundle/slam/models/sensor_clock.hpp"

namespace trundle::pipeline {
namespace {

template <typename Result>
auto value_in(Result& result) {
  return result.value ? &*result.value : nullptr;
}

/// How far off it is, or else how far it went.
std::string message_of(const RunRecord& record) {
  for (const StageKind kind : {StageKind::evaluation, StageKind::odometry}) {
    const auto stage = std::ranges::find(record.stages, kind, &Stage::kind);
    if (stage->status == StageStatus::done) return stage->message;
  }
  return {};
}

/// Of one recording of a session: with the robot that all of them made, in a folder below.
RunQuestion question_of_one(const RunInputs& inputs, const CalibratedRobot* calibrated,
                            const std::filesystem::path& recording, const std::string& name) {
  RunQuestion question = inputs.question;
  question.recording = recording.string();
  question.output = inputs.in_folder(name);
  question.calibrate_on.clear();
  if (calibrated == nullptr) return question;
  const std::vector<std::string>& others = inputs.question.calibrate_on;
  question.calibrated_on = others.empty() ? "the whole session" : fmt::format("{}", fmt::join(others, ", "));
  question.before = inputs.question.robot;
  return question;
}

RunAnswer run_one(const RunInputs& inputs, const ResultFolder& results, const OnProgress& on_progress);

/// A run of one recording of a session; why there is nothing where its inputs cannot be read.
RunAnswer tried(const RunInputs& session, const CalibratedRobot* calibrated, const ResultFolder& results,
                const std::filesystem::path& recording, const std::string& name,
                const OnProgress& on_progress) {
  std::optional<RobotFile> robot;
  if (calibrated != nullptr) robot = calibrated->robot;
  try {
    const RunInputs inputs = read_run_inputs(question_of_one(session, calibrated, recording, name), robot);
    return run_one(inputs, results, on_progress);
  } catch (const std::runtime_error& reason) {  // InputError, or of the file system
    results.discard(session.in_folder(name));
    return {.record = {}, .no_odometry = Failure{exit_code_of(reason), reason.what()}};
  }
}

/// Of a trajectory over the runs that have one.
struct PooledError {
  std::string name;
  double squares = 0.0;
  int runs = 0;
};

/// The errors of one kind.
std::vector<PooledError> pooled(std::span<const PositionError> errors, Alignment alignment) {
  std::vector<PooledError> all;
  for (const PositionError& error : errors) {
    if (error.alignment != alignment) continue;
    auto same = std::ranges::find(all, error.trajectory, &PooledError::name);
    if (same == all.end()) same = all.insert(all.end(), {.name = error.trajectory});
    same->squares += error.rms_m * error.rms_m;
    ++same->runs;
  }
  return all;
}

/// What became of a session's recordings.
struct SessionRuns {
  std::optional<Failure> failure = {};  ///< the first, where all fail
  std::vector<PositionError> errors = {};
};

/// One by one.
SessionRuns run_each(const RunInputs& inputs, const CalibratedRobot* calibrated, const ResultFolder& results,
                     RunRecord& record, const OnProgress& on_progress) {
  SessionRuns runs;
  bool any = false;
  for (const std::filesystem::path& path : recordings_below(inputs.question.recording)) {
    const std::string name = path.lexically_relative(inputs.question.recording).generic_string();
    const RunAnswer one = tried(inputs, calibrated, results, path, name, on_progress);
    Stage stage{.outputs = {name + "/run.json"}, .recording = name};
    if (one.no_odometry) {
      stage.message = one.no_odometry->message;
      if (!runs.failure) runs.failure = one.no_odometry;
    } else {
      stage.status = StageStatus::done;
      stage.message = message_of(one.record);
      any = true;
    }
    std::ranges::copy(one.errors, std::back_inserter(runs.errors));
    record.recordings.push_back(name);
    record.stages.push_back(std::move(stage));
  }
  if (any) runs.failure.reset();
  return runs;
}

void note(const CalibratedRobot& calibrated, RunRecord& record) {
  record.used_robot = "calibrated.toml";
  record.held_out = calibrated.held_out;
}

void write_record(const RunInputs& inputs, const ResultFolder& results, const RunRecord& record) {
  results.write(inputs.in_folder("run.json"), printed(to_json(record)));
}

/// Of the landmark sensor of one recording, to `robot`: what the health check found holds for the robot as
/// given, and most of a velocity's lag is a delay.
std::optional<TimeOffset> sensor_clock_for(const Robot& robot, const RunInputs& inputs,
                                           const HealthCheck& health) {
  if (robot.chassis.velocity.lag_s == inputs.given.robot.chassis.velocity.lag_s) return health.sensor_clock;
  const Recording& recording = inputs.recordings.front();
  return sighting_time_offset(recording.sightings, align(recording, robot), robot);
}

/// The errors of all runs together; by their best fit where no reference has headings.
Found<bool> evaluate_session(std::span<const PositionError> errors) {
  if (errors.empty()) throw NotApplicable{"no recording has a reference with x and y"};
  const bool by_start = std::ranges::count(errors, Alignment::start, &PositionError::alignment) > 0;
  const Alignment alignment = by_start ? Alignment::start : Alignment::se2;
  const std::vector<PooledError> all = pooled(errors, alignment);
  std::string message = fmt::format("position error, rms of the runs' rms, {}:", words_of(alignment));
  for (const PooledError& one : all)
    message += fmt::format("{} {} {:.4f} m ({})", &one == all.data() ? "" : ",", one.name,
                           std::sqrt(one.squares / one.runs), counted(one.runs, "run"));
  return {.value = true, .message = std::move(message)};
}

/// Of a session the page shows what was calibrated: each of its recordings has a page of its own.
RunAnswer run_session(const RunInputs& inputs, const CalibratedRobot* calibrated, const ResultFolder& results,
                      RunRecord& record, StageRunner& stage, const OnProgress& on_progress) {
  const SessionRuns runs = run_each(inputs, calibrated, results, record, on_progress);
  stage(StageKind::evaluation, [&] { return evaluate_session(runs.errors); });
  stage(StageKind::report, [&] {
    if (calibrated == nullptr)
      throw NotApplicable{"nothing was calibrated; each recording has a page of its own"};
    return draw_page(inputs, {.label = inputs.in_folder("calibration.json").string(),
                              .calibration = calibrated->document,
                              .sources = stage.sources_of(StageKind::calibration)});
  });
  write_record(inputs, results, record);
  return {.record = record, .no_odometry = runs.failure};
}

/// Signs and columns that are wrong in the robot file as given, and right in the robot that is used.
bool are_wires_put_right(const HealthCheck& health, const RunInputs& inputs, const Robot& used) {
  return std::ranges::count(health.misreadings, Misread::wires, &Misreading::what) > 0 &&
         std::ranges::none_of(inputs.recordings, [&](const Recording& recording) {
           return std::ranges::any_of(find_in(recording, &used).problems, is_miswiring);
         });
}

RunAnswer run_one(const RunInputs& inputs, const ResultFolder& results, const OnProgress& on_progress) {
  RunRecord record = record_of(inputs);
  StageRunner stage(inputs, results, record, on_progress);

  const auto health = stage(StageKind::health_check, [&] { return check_health(inputs); });
  if (health.value) stage.forbid(health.value->misreadings);
  const auto calibration = stage(StageKind::calibration, [&] { return calibrate_robot(inputs); });
  if (calibration.value) note(*calibration.value, record);
  RobotFile robot = calibration.value ? calibration.value->robot : inputs.robot;
  if (health.value && are_wires_put_right(*health.value, inputs, robot.robot)) stage.permit(Misread::wires);
  if (inputs.is_session())
    return run_session(inputs, value_in(calibration), results, record, stage, on_progress);

  std::optional<std::string> sensor_clock;
  if (health.value)
    sensor_clock = set_sensor_clock(sensor_clock_for(robot.robot, inputs, *health.value), robot.robot);
  const auto say_clock = [&](auto landmarks) {
    if (sensor_clock) landmarks.remarks.push_back("note: corrected: " + *sensor_clock);
    return landmarks;
  };
  const WriteNow write_now = [&](OutputFile file) { return stage.write_now(std::move(file)); };
  auto odometry = stage(StageKind::odometry,
                        [&] { return integrate_odometry(inputs, robot, value_in(health), write_now); });
  auto slip = stage(StageKind::slip, [&] { return find_slips(inputs, robot, write_now); });
  if (odometry.value && !slip.value)  // then it is the best trajectory there is
    stage.add_copy(StageKind::odometry, inputs.in_folder("odometry.csv"), inputs.in_folder("trajectory.csv"));
  auto localization = stage(StageKind::localization,
                            [&] { return say_clock(localize_on_map(inputs, robot, value_in(slip))); });
  auto slam = stage(StageKind::slam, [&] {
    return say_clock(map_landmarks(inputs, robot, value_in(slip), stage.steps_of(StageKind::slam)));
  });
  if (slip.value && !inputs.question.viewer)
    slip.value->answer.report = {};  // nobody goes on from it any more
  RunFindings found{.robot = robot,
                    .health = value_in(health),
                    .calibration = value_in(calibration),
                    .odometry = value_in(odometry),
                    .slip = value_in(slip),
                    .localization = value_in(localization),
                    .slam = value_in(slam)};
  std::vector<WrittenTrajectory> trajectories = take_trajectories(found);
  const auto evaluation =
      stage(StageKind::evaluation, [&] { return evaluate_trajectories(inputs, robot, trajectories); });
  found.evaluation = value_in(evaluation);
  if (inputs.question.viewer)
    stage(StageKind::viewer_file, [&] { return write_viewer_file(inputs, found, trajectories, write_now); });
  for (const WrittenTrajectory& trajectory : trajectories) record.trajectories.push_back(trajectory.entry);
  stage(StageKind::report, [&] {
    Results shown = results_of(found, std::move(trajectories), record, inputs.question.output.string());
    shown.sources = stage.sources();
    return draw_page(inputs, std::move(shown));
  });
  write_record(inputs, results, record);
  RunAnswer answer{.record = record, .no_odometry = odometry.failure};
  if (evaluation.value) answer.errors = evaluation.value->errors;
  return answer;
}

}  // namespace

RunAnswer run(const RunQuestion& question, const OnProgress& on_progress) {
  const RunInputs inputs = read_run_inputs(question);
  ResultFolder results(question.output);
  const RunAnswer answer = run_one(inputs, results, on_progress);
  if (!answer.no_odometry) results.commit(result_names(inputs), "run.json");
  return answer;
}

}  // namespace trundle::pipeline
