#include <algorithm>
#include <iterator>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "trundle/io/words.hpp"
#include "trundle/pipeline/info_answer.hpp"
#include "trundle/pipeline/stages.hpp"

namespace trundle::pipeline {
namespace {

bool gyro_rests(const Recording& recording) {
  return !recording.gyro.time_s.empty() && gyro_noise(recording).has_value();
}

/// Whether it is about what the motion is computed from.
bool is_of_motion_stream(const Finding& problem, const Recording& recording) {
  return problem.place == recording.wheels.origin.file || problem.place == recording.gyro.origin.file ||
         problem.place == recording.velocity.origin.file;
}

Misread misread_by(const Finding& problem, const std::vector<Recording>& recordings) {
  switch (problem.code) {
    case FindingCode::reference_unit:
    case FindingCode::reference_axes:
      return Misread::reference;
    case FindingCode::clocks:
      return Misread::other;
    case FindingCode::time_unit:
      return std::ranges::any_of(recordings,
                                 [&](const Recording& one) { return is_of_motion_stream(problem, one); })
                 ? Misread::motion
                 : Misread::other;
    default:
      return is_miswiring(problem) ? Misread::wires : Misread::motion;
  }
}

HealthProblem health_problem_of(const Finding& problem) {
  return {.is_warning = problem.severity == Severity::warning,
          .is_of_gyro_clock = problem.code == FindingCode::time_offset,
          .is_of_steering_clock = problem.code == FindingCode::steering_time_offset,
          .place = problem.place,
          .message = describe(problem)};
}

/// What is recorded and not used, once for all recordings.
std::vector<std::string> unused_in_any(const RunInputs& inputs) {
  std::vector<std::string> words;
  for (const Recording& recording : inputs.recordings)
    for (const std::string& one : unused_in(recording, inputs.given.robot))
      if (const std::string remark = "warning: missing: " + one; !std::ranges::count(words, remark))
        words.push_back(remark);
  return words;
}

}  // namespace

Found<HealthCheck> check_health(const RunInputs& inputs) {
  const InfoAnswer info =
      answer_info(inputs.recordings, {.robot = inputs.given,
                                      .gyro_noise = std::ranges::all_of(inputs.recordings, gyro_rests),
                                      .reading = inputs.question.reading});
  Found<HealthCheck> found{.value = {.info = {.document = document_of(info), .problems = {}}}};
  HealthCheck& health = found.value;
  std::size_t notes = 0;
  for (const RecordingInfo& one : info.recordings)
    for (const Finding& problem : one.findings.problems) {
      const HealthProblem told = health_problem_of(problem);
      const std::string words = fmt::format("{}: {}", told.place, told.message);
      health.info.problems.push_back(told);
      if (is_misreading(problem) || is_miswiring(problem))
        health.misreadings.push_back({misread_by(problem, inputs.recordings), words});
      if (!told.is_warning || told.is_of_gyro_clock || told.is_of_steering_clock)
        ++notes;
      else
        found.remarks.push_back("warning: " + words);
      if (told.is_warning && told.is_of_gyro_clock) health.gyro_clock.push_back("warning: " + words);
      if (told.is_warning && told.is_of_steering_clock) health.steering_clock.push_back("warning: " + words);
    }
  if (!inputs.is_session()) health.sensor_clock = info.recordings.front().findings.sighting_time_offset;
  std::ranges::move(unused_in_any(inputs), std::back_inserter(found.remarks));
  found.message = found.remarks.empty() && notes == 0
                      ? "no fault found"
                      : counted(found.remarks.size(), "warning") + ", " + counted(notes, "note");
  found.files = {{inputs.in_folder("info.json"), printed(health.info.document)}};
  return found;
}

}  // namespace trundle::pipeline
