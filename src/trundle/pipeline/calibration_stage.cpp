#include <algorithm>
#include <iterator>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "trundle/calibration/validation/conclusion.hpp"
#include "trundle/inspection/findings.hpp"
#include "trundle/inspection/same_data.hpp"
#include "trundle/pipeline/calibration_answer.hpp"
#include "trundle/pipeline/stages.hpp"

namespace trundle::pipeline {
namespace {

/// What cannot be learned from.
void require_something_to_learn_from(const RunInputs& inputs) {
  if (!inputs.question.before.empty())
    throw NotApplicable{fmt::format("the robot was calibrated on {}", inputs.question.calibrated_on)};
  if (inputs.question.calibrate_on.empty() && inputs.robot.robot.calibration)
    throw NotApplicable{"the robot file has a [calibration] already: it is used as it is"};
}

/// Odometry that was computed elsewhere can be corrected by a gyro or a reference alone.
void require_something_to_compare(std::span<const Recording> training, const Robot& robot) {
  if (robot.chassis.wheel_count > 0) return;
  const bool has_any = std::ranges::any_of(training, [](const Recording& recording) {
    return !recording.gyro.time_s.empty() || recording.has_reference() || !recording.sightings.empty();
  });
  if (!has_any)
    throw NotApplicable{
        "velocity input used unchanged: no wheels to calibrate, and no gyro or reference to compare it with"};
}

/// The recording itself has passed the health check; those that others are learned from have not.
void require_read_rightly(std::span<const Recording> training, const Robot& robot) {
  for (const Recording& recording : training)
    for (const Finding& problem : find_in(recording, &robot).problems)
      if (is_misreading(problem))
        throw CannotAnswer(fmt::format("not done: {}: {}", problem.place, describe(problem)));
}

/// No reference anywhere, but something seen.
bool only_landmarks(const std::vector<Recording>& recordings, const Robot& robot) {
  return robot.landmark_sensor && std::ranges::none_of(recordings, &Recording::has_reference) &&
         std::ranges::any_of(recordings, [](const Recording& r) { return !r.sightings.empty(); });
}

bool any_same_data(const std::vector<Recording>& some, const std::vector<Recording>& others) {
  return std::ranges::any_of(some, [&](const Recording& one) {
    return std::ranges::any_of(others, [&](const Recording& other) { return same_data(one, other); });
  });
}

/// What a person should know who uses the calibrated robot; the rest stands in the report.
std::vector<std::string> remarks_of(const CalibrationResult& result) {
  std::vector<std::string> remarks;
  for (const std::string& words : result.warnings) remarks.push_back("warning: " + words);
  for (const std::string& words : result.unobservable) remarks.push_back("note: " + words);
  for (const auto& clock : {result.velocity_lag, result.steering_clock, result.gyro_clock,
                            result.reference_clocks, result.sensor_clock})
    if (clock) remarks.push_back("note: corrected: " + *clock);
  if (result.gyro_biases) remarks.push_back("note: " + *result.gyro_biases);
  return remarks;
}

/// The robot as its file says it (parse_robot(to_toml(r)) == r), with the lines of that file for messages.
RobotFile robot_in(const OutputFile& file) {
  const std::string path = file.path.string();
  return {parse_robot(file.content, path), {path, sha256_of(file.content)}};
}

}  // namespace

Found<CalibratedRobot> calibrate_robot(const RunInputs& inputs) {
  require_something_to_learn_from(inputs);
  const bool apart = !inputs.question.calibrate_on.empty();
  std::vector<Recording> hold_out;
  if (apart) std::ranges::copy_if(inputs.recordings, std::back_inserter(hold_out), &Recording::has_reference);
  if (apart) require_read_rightly(inputs.training, inputs.given.robot);
  const std::vector<Recording>& training = apart ? inputs.training : inputs.recordings;
  require_something_to_compare(training, inputs.given.robot);
  const auto answer =
      only_landmarks(training, inputs.given.robot) ? answer_landmark_calibration : answer_calibration;
  const CalibrationAnswer calibration = answer(training, hold_out, inputs.given, inputs.question.calibrate);
  const std::vector<OutputFile> files = files_of(calibration, inputs.in_folder("calibrated.toml"));
  return {.value = {.robot = robot_in(files.front()),
                    .held_out = apart && !any_same_data(training, inputs.recordings),
                    .document = calibration_document(calibration.result, to_json(calibration.provenance))},
          .message = calibration.result.summary,
          .files = files,
          .remarks = remarks_of(calibration.result)};
}

}  // namespace trundle::pipeline
