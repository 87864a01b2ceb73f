#include "trundle/pipeline/calibration_answer.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "trundle/calibration/export.hpp"
#include "trundle/inspection/inspect.hpp"
#include "trundle/inspection/same_data.hpp"
#include "trundle/inspection/steering_checks.hpp"
#include "trundle/io/error.hpp"
#include "trundle/pipeline/sound.hpp"
#include "trundle/report/calibration_json.hpp"
#include "trundle/report/json_text.hpp"
#include "trundle/slam/smoothing/landmark_calibration.hpp"

namespace trundle::pipeline {
namespace {

Provenance provenance_of(std::span<const Recording> training, std::span<const Recording> hold_out,
                         const RobotFile& nominal, const CalibrateOptions& options) {
  Provenance provenance;
  provenance.inputs.push_back(nominal.file);
  for (const Recording& recording : training) add_inputs(recording.inputs, provenance);
  for (const Recording& recording : hold_out) add_inputs(recording.inputs, provenance);
  for (const std::string& name : options.free) provenance.options.emplace_back("free", name);
  for (const std::string& name : options.fix) provenance.options.emplace_back("fix", name);
  if (options.learn_noise) provenance.options.emplace_back("learn_noise", "true");
  return provenance;
}

/// A fit would make a wheelbase of angles in another unit.
void require_steering_read_rightly(std::span<const Recording> training, const Robot& robot) {
  if (!is_steered(robot.chassis)) return;
  for (const Recording& recording : training)
    if (const auto problem = wrong_steering(recording, robot, overview_of(recording, robot)))
      throw CannotAnswer(problem->place + ": " + describe(*problem));
}

/// What is learned from a log that was read wrongly is nonsense: that comes before all else.
void warn_of_misreadings(std::span<const Recording> training, CalibrationResult& result) {
  std::vector<std::string> words;
  for (const Recording& recording : training)
    for (const Finding& problem : recording.findings)
      if (is_misreading(problem)) words.push_back(problem.place + ": " + describe(problem));
  result.warnings.insert(result.warnings.begin(), words.begin(), words.end());
}

/// One drive that was given twice: learned from twice, or learned from and held out.
void warn_of_copies(std::span<const Recording> training, std::span<const Recording> hold_out,
                    CalibrationResult& result) {
  for (std::size_t i = 0; i < training.size(); ++i)
    for (std::size_t j = i + 1; j < training.size(); ++j)
      if (same_data(training[i], training[j]))
        result.warnings.push_back(fmt::format(
            "{} and {} hold the same data: it counts twice, so the error bars are too small; leave "
            "one of them out",
            folder_of(training[i]), folder_of(training[j])));
  for (const Recording& held : hold_out)
    if (std::ranges::any_of(training, [&](const Recording& run) { return same_data(run, held); }))
      result.warnings.push_back(fmt::format(
          "{} is held out and learned from: its error is that of training, no judgement", folder_of(held)));
}

}  // namespace

CalibrationAnswer answer_calibration(std::span<const Recording> training, std::span<const Recording> hold_out,
                                     const RobotFile& nominal, const CalibrateOptions& options) {
  require_steering_read_rightly(training, nominal.robot);
  CalibrationAnswer answer{.provenance = provenance_of(training, hold_out, nominal, options),
                           .result = calibrate(training, hold_out, nominal.robot, options)};
  require_sound(answer.result);
  warn_of_misreadings(training, answer.result);
  warn_of_copies(training, hold_out, answer.result);
  add_provenance(answer.provenance, answer.result);
  return answer;
}

CalibrationAnswer answer_landmark_calibration(std::span<const Recording> training,
                                              std::span<const Recording> hold_out, const RobotFile& nominal,
                                              const CalibrateOptions& options) {
  require_steering_read_rightly(training, nominal.robot);
  CalibrationAnswer answer{.provenance = provenance_of(training, hold_out, nominal, options),
                           .result = calibrate_from_landmarks(training, hold_out, nominal.robot, options)};
  answer.provenance.options.emplace_back("landmarks", "true");
  if (options.with_reference) answer.provenance.options.emplace_back("with_reference", "true");
  require_sound(answer.result);
  warn_of_misreadings(training, answer.result);
  warn_of_copies(training, hold_out, answer.result);
  add_provenance(answer.provenance, answer.result);
  return answer;
}

void add_provenance(const Provenance& provenance, CalibrationResult& result) {
  if (!result.calibrated.calibration) return;
  std::vector<std::string>& lines = result.calibrated.calibration->provenance;
  const std::vector<std::string> named = to_lines(provenance);
  lines.insert(lines.begin(), named.begin(), named.end());
}

std::vector<OutputFile> files_of(const CalibrationAnswer& answer, const std::filesystem::path& robot,
                                 const std::string& export_format) {
  const CalibrationResult& result = answer.result;
  std::vector<OutputFile> files = {
      {robot, to_toml(result.calibrated)},
      {robot.parent_path() / "calibration.json", json_text(document_of(answer))}};
  if (!export_format.empty())
    files.push_back(
        {robot.parent_path() / fmt::format("{}.{}", robot.stem().string(), export_suffix(export_format)),
         export_robot(export_format, result.nominal, result.calibrated)});
  return files;
}

nlohmann::ordered_json document_of(const CalibrationAnswer& answer) {
  return calibration_json(answer.result, to_json(answer.provenance));
}

}  // namespace trundle::pipeline
