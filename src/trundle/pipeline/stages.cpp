#include "trundle/pipeline/stages.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "trundle/calibration/conclusion.hpp"
#include "trundle/inspection/findings.hpp"
#include "trundle/io/error.hpp"
#include "trundle/io/words.hpp"
#include "trundle/pipeline/calibration_answer.hpp"
#include "trundle/pipeline/evaluation_answer.hpp"
#include "trundle/pipeline/info_answer.hpp"
#include "trundle/pipeline/localize_answer.hpp"
#include "trundle/pipeline/no_rest.hpp"
#include "trundle/pipeline/odometry_answer.hpp"
#include "trundle/pipeline/report_answer.hpp"
#include "trundle/pipeline/sentences.hpp"
#include "trundle/pipeline/slip_answer.hpp"
#include "trundle/recording/same_data.hpp"
#include "trundle/report/page.hpp"

namespace trundle {
namespace {

using Json = nlohmann::ordered_json;

bool gyro_rests(const Recording& recording) {
  return !recording.gyro.time_s.empty() && gyro_noise(recording).has_value();
}

/// A robot as it is about to be written.
RobotFile robot_of(const OutputFile& file) {
  const std::string path = file.path.string();
  return {parse_robot(file.content, path), {path, sha256_of(file.content)}};
}

/// What cannot be learned from.
void require_something_to_learn_from(const Work& work) {
  if (!work.question.before.empty()) throw NotApplicable{"the robot was calibrated with the whole session"};
  if (work.question.calibrate_on.empty() && work.used.robot.calibration)
    throw NotApplicable{"the robot file has a [calibration] already: it is used as it is"};
  if (std::string words = nothing_to_calibrate(work.given.robot.chassis); !words.empty())
    throw NotApplicable{std::move(words)};
}

/// The recording itself has passed the health check; those that others are learned from have not.
void require_read_rightly(std::span<const Recording> training, const Robot& robot) {
  for (const Recording& recording : training)
    for (const Problem& problem : find_in(recording, &robot).problems)
      if (is_misreading(problem))
        throw CannotAnswer(fmt::format("not done: {}: {}", problem.place, problem.message));
}

/// What a person should know who uses the calibrated robot; the rest stands in the report.
std::vector<std::string> remarks_of(const CalibrationResult& result, const std::vector<Stage>& before) {
  std::vector<std::string> remarks;
  const auto is_told = [&](const std::string& remark) {
    return std::ranges::any_of(before, [&](const Stage& stage) {
      return std::ranges::find(stage.remarks, remark) != stage.remarks.end();
    });
  };
  for (const std::string& words : result.warnings)
    if (!is_told("warning: " + words)) remarks.push_back("warning: " + words);
  for (const std::string& words : result.unobservable) remarks.push_back("note: " + words);
  for (const std::string& words : result.notes)
    if (words.starts_with("gyro.time_offset_s")) remarks.push_back("note: corrected: " + words);
  return remarks;
}

/// No reference anywhere, but something seen.
bool only_landmarks(const std::vector<Recording>& recordings, const Robot& robot) {
  return robot.landmark_sensor && std::ranges::none_of(recordings, &Recording::has_reference) &&
         std::ranges::any_of(recordings, [](const Recording& r) { return !r.sightings.empty(); });
}

/// Trajectory and document of one robot.
Told integrate_with(Work& work, const RobotFile& robot, const std::string& name, const std::string& what) {
  const OdometryAnswer odometry =
      answer_odometry(work.recording(), robot, {.robot_number = work.question.robot_number});
  Told told{
      sentence_of(odometry.odometry),
      {{work.in_folder(name + ".csv"), head_of(odometry.provenance) + to_csv(odometry.odometry.trajectory)},
       {work.in_folder(name + ".json"), printed(document_of(odometry))}}};
  if (const auto at = std::ranges::find(odometry.odometry.problems, ProblemKind::no_rest, &Problem::kind);
      at != odometry.odometry.problems.end())
    told.remarks.push_back("note: " + at->message);
  work.answer.trajectories.push_back({name, name + ".csv", what});
  return told;
}

/// The gyro's, by the calibration.
bool has_corrected_clock(const Work& work) {
  const auto &given = work.given.robot.chassis.gyro, &used = work.used.robot.chassis.gyro;
  return given && used && given->time_offset_s != used->time_offset_s;
}

SlipQuestion slip_question(const Work& work) {
  return {.learn = work.question.learn,
          .spin_odds = work.question.spin_odds,
          .robot_number = work.question.robot_number};
}

/// Who goes on from the odometry takes the corrected one, where slip could be looked for.
std::optional<SlipQuestion> slip_correction(const Work& work) {
  return work.slip ? std::optional(slip_question(work)) : std::nullopt;
}

const SlipAnswer* slip_found(const Work& work) {
  return work.slip ? &*work.slip : nullptr;
}

void require_sightings(const Work& work) {
  if (work.recording().sightings.empty()) throw NotApplicable{"the recording has no sightings"};
  if (!work.used.robot.landmark_sensor) throw NotApplicable{"the robot file has no [landmark_sensor]"};
}

/// Where the landmarks are.
MapFile known_map_of(const Work& work) {
  if (!work.question.map.empty()) return read_map_file(work.question.map);
  const std::filesystem::path path = std::filesystem::path(work.question.recording) / "landmarks.csv";
  if (!std::filesystem::exists(path)) throw NotApplicable{"no map given (--map or landmarks.csv)"};
  return read_map_file(path);
}

/// The filter's estimates first: the smoother has seen more than they had.
void add_trajectories_of(const SlamAnswer& slam, std::vector<RunTrajectory>& trajectories) {
  trajectories.push_back({"slam online", "slam/online.csv", "with landmarks, from what was seen up to then"});
  if (slam.result.path)
    trajectories.push_back(
        {"slam path", "slam/path.csv", "with landmarks, the whole path of the best particle"});
  if (slam.smoothed)
    trajectories.push_back({"slam", "slam/trajectory.csv",
                            "with landmarks, smoothed: from all that was seen, before and after"});
}

/// Smoothed; where the sightings do not determine that, what the filter alone can say.
SlamAnswer answer_slam_smoothed(const Work& work, SlamQuestion question) {
  try {
    question.smooth = true;
    return answer_slam(work.recording(), work.used, question, slip_found(work));
  } catch (const CannotAnswer&) {
    question.smooth = false;
    return answer_slam(work.recording(), work.used, question, slip_found(work));
  }
}

/// The reference as it was read, for those who draw.
std::string reference_csv_of(const Work& work) {
  const ReferenceStream& reference = work.recording().reference;
  const auto cell = [](double value) { return std::isnan(value) ? std::string() : fmt::format("{}", value); };
  std::string text = head_of(work.answer.provenance) + "time_s,x_m,y_m,heading_rad\n";
  for (std::size_t i = 0; i < reference.time_s.size(); ++i)
    text += fmt::format("{},{},{},{}\n", cell(reference.time_s[i]), cell(reference.x_m[i]),
                        cell(reference.y_m[i]), cell(reference.heading_rad[i]));
  return text;
}

/// One trajectory by every alignment that can be done.
Json evaluations_of(const Work& work, const RunTrajectory& trajectory, const TrajectoryFile& reference) {
  const TrajectoryFile estimate = read_trajectory_file(work.in_folder(trajectory.file));
  Json evaluations = Json::object();
  std::vector<Alignment> alignments = {Alignment::start, Alignment::se2};
  if (trajectory.name == "localization") alignments.push_back(Alignment::none);  // in the map's frame
  for (const Alignment alignment : alignments) try {
      evaluations[std::string(name_of(alignment))] =
          document_of(answer_evaluation(estimate, reference, {.alignment = alignment}, &work.used));
    } catch (const CannotAnswer&) {  // of this alignment alone
    }
  return evaluations;
}

bool any_same_data(const std::vector<Recording>& some, const std::vector<Recording>& others) {
  return std::ranges::any_of(some, [&](const Recording& one) {
    return std::ranges::any_of(others, [&](const Recording& other) { return same_data(one, other); });
  });
}

/// "0.0960 m rms nominal, 0.0138 m odometry".
std::string sentence_of(const Json& trajectories, const std::string& alignment) {
  std::string text;
  for (const Json& one : trajectories)
    if (const Json& evaluations = one.at("evaluations"); evaluations.contains(alignment))
      text += fmt::format("{}{} {:.4f} m", text.empty() ? "position error, rms: " : ", ",
                          one.at("name").get<std::string>(),
                          evaluations.at(alignment).at("position_m").at("rms").get<double>());
  return text;
}

}  // namespace

Told check_health(Work& work) {
  const InfoAnswer info =
      answer_info(work.recordings, {.robot = work.given,
                                    .gyro_noise = std::ranges::all_of(work.recordings, gyro_rests),
                                    .robot_number = work.question.robot_number});
  std::vector<std::string> warnings;
  std::size_t notes = 0;
  for (const RecordingInfo& one : info.recordings)
    for (const Problem& problem : one.findings.problems) {
      if (is_misreading(problem)) work.misread.push_back(problem);
      const std::string words = fmt::format("warning: {}: {}", problem.place, problem.message);
      if (problem.severity == Severity::note)
        ++notes;
      else if (problem.kind == ProblemKind::time_offset)  // the calibration may correct it
        work.clocks.push_back(words);
      else
        warnings.push_back(words);
    }
  notes += work.clocks.size();
  const std::string message = warnings.empty() && notes == 0
                                  ? "no fault found"
                                  : counted(warnings.size(), "warning") + ", " + counted(notes, "note");
  return {message, {{work.in_folder("info.json"), printed(document_of(info))}}, std::move(warnings)};
}

Told calibrate_robot(Work& work) {
  require_something_to_learn_from(work);
  const bool apart = !work.question.calibrate_on.empty();
  std::vector<Recording> hold_out;
  if (apart) std::ranges::copy_if(work.recordings, std::back_inserter(hold_out), &Recording::has_reference);
  if (apart) require_read_rightly(work.training, work.given.robot);
  const std::vector<Recording>& training = apart ? work.training : work.recordings;
  const auto answer =
      only_landmarks(training, work.given.robot) ? answer_landmark_calibration : answer_calibration;
  const CalibrationAnswer calibration = answer(training, hold_out, work.given, work.question.calibrate);
  const std::vector<OutputFile> files = files_of(calibration, work.in_folder("calibrated.toml"));
  work.used = robot_of(files.front());
  work.answer.used_robot = "calibrated.toml";
  work.answer.held_out = apart && !any_same_data(training, work.recordings);
  return {calibration.result.summary, files, remarks_of(calibration.result, work.answer.stages)};
}

Told integrate_odometry(Work& work) {
  try {
    Told told;
    if (work.used.file.sha256 != work.given.file.sha256)
      told = integrate_with(work, work.given, "nominal", "odometry with the robot file as given");
    Told used = integrate_with(work, work.used, "odometry",
                               work.answer.held_out || !work.question.before.empty()
                                   ? "odometry with the calibrated robot"
                                   : "odometry with the robot file as given");
    used.files.insert(used.files.begin(), told.files.begin(), told.files.end());
    if (!has_corrected_clock(work))
      used.remarks.insert(used.remarks.end(), work.clocks.begin(), work.clocks.end());
    return used;
  } catch (...) {
    work.no_odometry = std::current_exception();
    throw;
  }
}

Told find_slips(Work& work) {
  const auto& wheels = work.used.robot.chassis;
  if (observability(rows_of(wheels, !work.recording().gyro.time_s.empty())).degrees_of_freedom == 0)
    throw NotApplicable{"slip is not observable: no redundant measurement"};
  const SlipAnswer& slip = work.slip.emplace(answer_slip(work.recording(), work.used, slip_question(work)));
  Told told{sentence_of(slip),
            {{work.in_folder("slip.csv"), slip_csv_of(slip, work.used.robot)},
             {work.in_folder("slip.json"), printed(document_of(slip, work.used.robot))},
             {work.in_folder("trajectory.csv"), head_of(slip.provenance) + to_csv(slip.corrected)}}};
  work.answer.trajectories.push_back({"corrected", "trajectory.csv", "odometry with the slips corrected"});
  return told;
}

Told localize_on_map(Work& work) {
  require_sightings(work);
  const MapFile map = known_map_of(work);
  const Recording& recording = work.recording();
  const LocalizeQuestion question{.seed = work.question.slam.seed,
                                  .slip = slip_correction(work),
                                  .robot_number = work.question.robot_number};
  const LocalizeAnswer answer = answer_localize(recording, work.used, map, question, slip_found(work));
  work.answer.trajectories.push_back(
      {"localization", "localization.csv", "on the known map, where the pose is known"});
  return {
      sentence_of(answer),
      {{work.in_folder("localization.csv"), head_of(answer.provenance) + to_csv(answer.result.trajectory)},
       {work.in_folder("localization.json"), printed(document_of(answer))}}};
}

Told map_landmarks(Work& work) {
  require_sightings(work);
  SlamQuestion question = work.question.slam;
  question.robot_number = work.question.robot_number;
  question.on_steps = work.on_steps;
  question.slip = slip_correction(work);
  const SlamAnswer slam = answer_slam_smoothed(work, question);
  add_trajectories_of(slam, work.answer.trajectories);
  return {sentence_of(slam), files_of(slam, work.in_folder("slam"))};
}

Told evaluate_trajectories(Work& work) {
  if (positions_of(work.recording().reference).poses.empty())
    throw NotApplicable{"the recording has no reference with x and y"};
  if (work.answer.trajectories.empty()) throw NotApplicable{"there is no trajectory to compare"};
  const TrajectoryFile reference = reference_of(work.recording(), work.question.recording);
  Json trajectories = Json::array();
  for (const RunTrajectory& trajectory : work.answer.trajectories)
    trajectories.push_back({{"name", trajectory.name},
                            {"file", trajectory.file},
                            {"evaluations", evaluations_of(work, trajectory, reference)}});
  std::string sentence = sentence_of(trajectories, "start");
  const std::string alignment = sentence.empty() ? "se2" : "start";
  if (sentence.empty()) sentence = sentence_of(trajectories, alignment);
  if (sentence.empty())
    throw CannotAnswer("no trajectory can be compared with the reference: are they of the same time?");
  Json document = to_json(work.answer.provenance);
  document["alignment"] = {{"kind", alignment}};
  document["reference_noise"] = to_json(reference.noise);
  document["trajectories"] = std::move(trajectories);
  return {sentence,
          {{work.in_folder("reference.csv"), reference_csv_of(work)},
           {work.in_folder("evaluation.json"), printed(document)}}};
}

/// Of a session, what was calibrated: each of its recordings has a page of its own.
Told draw_page(Work& work) {
  const bool session = work.recordings.size() > 1;
  const std::filesystem::path shown = session ? work.in_folder("calibration.json") : work.question.output;
  if (session && !std::filesystem::exists(shown))
    throw NotApplicable{"nothing was calibrated; each recording has a page of its own"};
  const ReportAnswer report = answer_report({.inputs = {shown.string()}});
  const std::filesystem::path page = work.in_folder("report.html");
  return {"wrote " + page.string(), {{page, report_page(report.document)}}};
}

std::string printed(const Json& document) {
  return document.dump(2) + "\n";
}

}  // namespace trundle
