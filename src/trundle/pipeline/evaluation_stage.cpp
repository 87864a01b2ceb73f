#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "trundle/pipeline/stages.hpp"
#include "trundle/recording/alignment/align.hpp"

namespace trundle::pipeline {
namespace {

using Json = nlohmann::ordered_json;

/// One trajectory by every alignment that can be done.
struct Evaluated {
  const RunTrajectory* trajectory = nullptr;
  std::vector<EvaluationAnswer> answers = {};

  const EvaluationAnswer* by(Alignment alignment) const {
    for (const EvaluationAnswer& answer : answers)
      if (answer.evaluation.alignment == alignment) return &answer;
    return nullptr;
  }
};

/// The reference that the trajectories are compared with, for those who draw.
std::string reference_csv_of(const RunInputs& inputs, const ReferenceStream& reference) {
  const auto cell = [](double value) { return std::isnan(value) ? std::string() : fmt::format("{}", value); };
  std::string text = head_of(inputs.provenance) + "time_s,x_m,y_m,heading_rad\n";
  for (std::size_t i = 0; i < reference.time_s.size(); ++i)
    text += fmt::format("{},{},{},{}\n", cell(reference.time_s[i]), cell(reference.x_m[i]),
                        cell(reference.y_m[i]), cell(reference.heading_rad[i]));
  return text;
}

Evaluated evaluated(const WrittenTrajectory& trajectory, const TrajectoryFile& reference,
                    const RobotFile& robot) {
  Evaluated all{.trajectory = &trajectory.entry};
  std::vector<Alignment> alignments = {Alignment::start, Alignment::se2};
  if (trajectory.role == TrackRole::localized) alignments.push_back(Alignment::none);  // in the map's frame
  for (const Alignment alignment : alignments) try {
      all.answers.push_back(answer_evaluation(trajectory.file, reference, {.alignment = alignment}, &robot));
    } catch (const CannotAnswer&) {  // of this alignment alone
    }
  return all;
}

Json json_of(const Evaluated& evaluated) {
  Json evaluations = Json::object();
  for (const EvaluationAnswer& answer : evaluated.answers)
    evaluations[std::string(name_of(answer.evaluation.alignment))] = document_of(answer);
  return {{"name", evaluated.trajectory->name},
          {"file", evaluated.trajectory->file},
          {"evaluations", std::move(evaluations)}};
}

/// "position error, rms, start-aligned: nominal 0.0960 m, odometry 0.0138 m; in the map's frame: localization
/// 0.0412 m": as the page has them.
std::string errors_in_words(const std::vector<Evaluated>& all, Alignment common) {
  std::string text = "position error, rms";
  std::optional<Alignment> last;
  for (const Evaluated& one : all) {
    const Alignment alignment = one.by(Alignment::none) != nullptr ? Alignment::none : common;
    const EvaluationAnswer* const answer = one.by(alignment);
    if (answer == nullptr) continue;
    const bool goes_on = last == alignment;
    if (!goes_on) text += fmt::format("{} {}:", last ? ";" : ",", words_of(alignment));
    text += fmt::format("{} {} {:.4f} m", goes_on ? "," : "", one.trajectory->name,
                        answer->evaluation.position_m.rms);
    last = alignment;
  }
  return text;
}

/// In which the trajectories are compared with each other: se2 where the reference has no heading.
Alignment common_alignment(const std::vector<Evaluated>& all) {
  for (const Alignment alignment : {Alignment::start, Alignment::se2})
    for (const Evaluated& one : all)
      if (one.by(alignment) != nullptr) return alignment;
  throw CannotAnswer("no trajectory can be compared with the reference: are they of the same time?");
}

}  // namespace

std::string_view words_of(Alignment alignment) {
  switch (alignment) {
    case Alignment::start:
      return "start-aligned";
    case Alignment::se2:
      return "best fit (SE2)";
    case Alignment::none:
      return "in the map's frame";
  }
  return {};
}

Found<EvaluationStage> evaluate_trajectories(const RunInputs& inputs, const RobotFile& robot,
                                             std::span<const WrittenTrajectory> trajectories) {
  const Recording& recording = inputs.recording();
  if (positions_of(recording.reference).poses.empty())
    throw NotApplicable{"the recording has no reference with x and y"};
  if (trajectories.empty()) throw NotApplicable{"there is no trajectory to compare"};
  const TrajectoryFile reference =
      on_clock_of_sensors(recording, inputs.question.recording, align(recording, robot.robot), robot.robot);
  ReferenceStream measured = recording.reference;
  if (reference.clock) move_stamps(reference.clock->offset_s - robot.robot.reference_time_offset_s, measured);
  std::vector<Evaluated> all;
  for (const WrittenTrajectory& trajectory : trajectories)
    all.push_back(evaluated(trajectory, reference, robot));
  std::vector<PositionError> errors;
  for (const Evaluated& one : all)
    for (const Alignment alignment : {Alignment::start, Alignment::se2})
      if (const EvaluationAnswer* const answer = one.by(alignment))
        errors.push_back({one.trajectory->name, alignment, answer->evaluation.position_m.rms});
  const EvaluationSummary summary{.alignment = common_alignment(all), .noise = reference.noise};
  Json document = to_json(inputs.provenance);
  document.update(to_json(summary));
  document["trajectories"] = Json::array();
  for (const Evaluated& one : all) document["trajectories"].push_back(json_of(one));
  Found<EvaluationStage> found{
      .value = {.summary = summary, .reference = positions_of(measured), .errors = std::move(errors)},
      .message = errors_in_words(all, summary.alignment),
      .files = {{inputs.in_folder("reference.csv"), reference_csv_of(inputs, measured)},
                {inputs.in_folder("evaluation.json"), printed(document)}}};
  if (reference.clock) found.remarks.push_back("note: corrected: " + sentence_of(*reference.clock));
  return found;
}

}  // namespace trundle::pipeline
