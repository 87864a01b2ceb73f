#include "trundle/pipeline/evaluation_answer.hpp"

#include <algorithm>
#include <iterator>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "trundle/io/error.hpp"
#include "trundle/recording/alignment/align.hpp"
#include "trundle/recording/trajectory_file.hpp"

namespace trundle::pipeline {
namespace {

nlohmann::ordered_json json_of(const RelativePoseError& error) {
  nlohmann::ordered_json json = {{"distance_m", error.distance_m}, {"pairs", error.pairs}};
  if (error.pairs == 0) return json;
  json["translation_rms_m"] = error.translation_rms_m;
  json["translation_mean_percent"] = error.translation_mean_percent;
  json["heading_rms_deg"] = degrees(error.heading_rms_rad);
  return json;
}

nlohmann::ordered_json json_of(const Nees& nees) {
  return {{"degrees_of_freedom", nees.degrees_of_freedom},
          {"mean", nees.mean},
          {"bound_95", nees.bound_95},
          {"share_inside_95", nees.share_inside_95},
          {"poses", nees.poses},
          {"before_motion", nees.before_motion},
          {"without_covariance", nees.without_covariance}};
}

nlohmann::ordered_json json_of(const Evaluation& e) {
  const Pose2& T = e.reference_from_estimate;
  nlohmann::ordered_json json;
  json["alignment"] = {
      {"kind", name_of(e.alignment)}, {"x_m", T.x}, {"y_m", T.y}, {"heading_deg", degrees(T.heading)}};
  json["overlap"] = {{"first_s", e.first_s},
                     {"last_s", e.last_s},
                     {"duration_s", e.overlap_s()},
                     {"compared", e.compared},
                     {"estimate_poses", e.estimate_poses},
                     {"reference_poses", e.reference_poses}};
  json["path_m"] = e.path_m;
  json["position_m"] = {{"rms", e.position_m.rms},
                        {"mean", e.position_m.mean},
                        {"median", e.position_m.median},
                        {"max", e.position_m.max}};
  if (e.heading_rms_rad) json["heading_rms_deg"] = degrees(*e.heading_rms_rad);
  json["final"] = {{"position_m", e.final_position_m}};
  if (e.final_percent) json["final"]["percent_of_path"] = *e.final_percent;
  if (e.final_heading_rad) json["final"]["heading_deg"] = degrees(*e.final_heading_rad);
  json["relative"] = nlohmann::ordered_json::array();
  for (const RelativePoseError& error : e.relative) json["relative"].push_back(json_of(error));
  if (e.nees) json["nees"] = json_of(*e.nees);
  json["reference_noise"] = report::to_json(e.reference_noise);
  return json;
}

/// Its stamps, to which the robot's time_offset_s is added later, moved so that their sum is right.
TrajectoryFile with_clock(TrajectoryFile reference, const std::optional<ReferenceClock>& clock,
                          double given_s) {
  reference.clock = clock;
  if (clock)
    for (StampedPose& stamped : reference.trajectory.poses) stamped.time_s += clock->offset_s - given_s;
  return reference;
}

/// Nothing where they are not this robot's, or not there.
std::optional<AlignedReadings> readings_of(const Recording& recording, const Robot& robot) try {
  return align(recording, robot);
} catch (const InputError&) {
  return std::nullopt;
}

}  // namespace

TrajectoryFile read_trajectory_file(const std::filesystem::path& path) {
  if (std::filesystem::is_directory(path)) return reference_of(read_recording(path), path);
  return {.trajectory = read_trajectory(path), .files = {input_file(path)}};
}

TrajectoryFile written_trajectory(const Trajectory& trajectory, const OutputFile& file) {
  return {.trajectory = as_written(trajectory),
          .files = {{file.path.string(), file.sha256.empty() ? sha256_of(file.content) : file.sha256}}};
}

TrajectoryFile reference_of(const Recording& recording, const std::filesystem::path& path) {
  TrajectoryFile reference{
      .trajectory = reference_trajectory(recording), .files = {}, .noise = recording.reference_noise};
  if (reference.trajectory.poses.empty()) reference.trajectory = positions_of(recording.reference);
  if (reference.trajectory.poses.empty())
    throw InputError(path.string(), "the recording holds no reference position", "a reference with x and y");
  const auto is_of_reference = [&](const InputFile& input) {
    return input.path == recording.reference.origin.file ||
           std::filesystem::path(input.path).filename() == "recording.toml";
  };
  std::ranges::copy_if(recording.inputs, std::back_inserter(reference.files), is_of_reference);
  return reference;
}

TrajectoryFile on_clock_of_sensors(const Recording& recording, const std::filesystem::path& path,
                                   const AlignedReadings& readings, const Robot& robot) {
  TrajectoryFile reference = reference_of(recording, path);
  reference.files = recording.inputs;
  return with_clock(std::move(reference), clock_by_sensors(recording, readings, robot),
                    robot.reference_time_offset_s);
}

TrajectoryFile on_clock_of(const TrajectoryFile& estimate, TrajectoryFile reference,
                           const ClockQuestion& question) {
  const Robot robot = question.robot != nullptr ? question.robot->robot : Robot{};
  const auto clock =
      question.time_offset_s
          ? std::optional(ReferenceClock{.offset_s = *question.time_offset_s})
          : clock_by_estimate(reference.trajectory, estimate.trajectory, question.longest_gap_s, robot);
  return with_clock(std::move(reference), clock, robot.reference_time_offset_s);
}

TrajectoryFile on_clock_of(const TrajectoryFile& estimate, const Recording& recording,
                           const std::filesystem::path& path, const ClockQuestion& question) {
  if (question.robot != nullptr && !question.time_offset_s)
    if (const auto readings = readings_of(recording, question.robot->robot))
      return on_clock_of_sensors(recording, path, *readings, question.robot->robot);
  return on_clock_of(estimate, reference_of(recording, path), question);
}

TrajectoryFile on_clock_of(const TrajectoryFile& estimate, const std::filesystem::path& path,
                           const ClockQuestion& question) {
  if (std::filesystem::is_directory(path)) return on_clock_of(estimate, read_recording(path), path, question);
  return on_clock_of(estimate, read_trajectory_file(path), question);
}

EvaluationAnswer answer_evaluation(const TrajectoryFile& estimate, const TrajectoryFile& reference,
                                   EvaluateOptions options, const RobotFile* robot) {
  EvaluationAnswer answer{.provenance = {}, .evaluation = {}, .clock = reference.clock};
  options.reference_noise = reference.noise;
  answer.provenance.options = {{"align", std::string(name_of(options.alignment))},
                               {"longest_gap_s", fmt::format("{}", options.longest_gap_s)}};
  if (reference.clock && reference.clock->source == ClockSource::stated)
    answer.provenance.options.emplace_back("time_offset_s", fmt::format("{}", reference.clock->offset_s));
  add_inputs(estimate.files, answer.provenance);
  add_inputs(reference.files, answer.provenance);
  if (robot != nullptr) answer.provenance.inputs.push_back(robot->file);
  answer.evaluation = evaluate(
      robot != nullptr ? of_reference_sensor(estimate.trajectory, robot->robot) : estimate.trajectory,
      reference.trajectory, options);
  answer.evaluation.estimate_poses += estimate.left_out;
  return answer;
}

nlohmann::ordered_json document_of(const EvaluationAnswer& answer) {
  nlohmann::ordered_json document = to_json(answer.provenance);
  document.update(json_of(answer.evaluation));
  document["reference_clock"] = json_of(answer.clock);
  return document;
}

}  // namespace trundle::pipeline
