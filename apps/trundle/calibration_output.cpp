#include "calibration_output.hpp"

#include <cmath>

#include <fmt/format.h>

#include "trundle/calibration/export.hpp"
#include "trundle/io/words.hpp"

namespace trundle::app {
namespace {

/// Sigmas are read as a distance from the value: two digits are enough.
std::string sigma_of(const ParameterEstimate& estimate) {
  if (estimate.observable) return "± " + sigma_text(estimate.sigma_total);
  if (!std::isfinite(estimate.sigma_data))
    return fmt::format("unobservable, fixed at nominal (prior ± {})", sigma_text(estimate.sigma_prior));
  return fmt::format("fixed at nominal: data ± {}, prior ± {}", sigma_text(estimate.sigma_data),
                     sigma_text(estimate.sigma_prior));
}

std::string parameter_lines(const CalibrationResult& result) {
  std::string text = fmt::format("{:<24} {:>14} {:>14}\n", "parameter", "nominal", "calibrated");
  for (const ParameterEstimate& estimate : result.parameters)
    text += fmt::format("{:<24} {:>14.8g} {:>14.8g}  {} {}\n", estimate.name, estimate.nominal,
                        estimate.value, sigma_of(estimate), estimate.unit == "1" ? "" : estimate.unit);
  return text;
}

std::string error_lines(const CalibrationResult& result) {
  if (!result.calibrated.calibration || result.calibrated.calibration->errors.empty()) return {};
  std::string text = fmt::format("{:<39} {:>10} {:>10}\n", "error, start-aligned", "before", "after");
  for (const ErrorBeforeAfter& error : result.calibrated.calibration->errors)
    text += fmt::format("{:<39} {:>10.5g} {:>10.5g} {}\n", error.what, error.before, error.after, error.unit);
  if (result.nominal.chassis.gyro)
    text += "  with the gyro's bias as in the robot files; odometry learns it where the robot stands\n";
  return text;
}

}  // namespace

void add_calibration_output(CLI::App& command, CalibrationOutput& output) {
  CLI::Option* robot = command.add_option("-o,--output", output.robot_path,
                                          "Calibrated robot file; calibration.json is written beside it");
  const auto formats = export_formats();
  command
      .add_option("--export", output.export_format,
                  "Also write the result in the words of another stack, beside -o")
      ->check(CLI::IsMember(std::vector<std::string>(formats.begin(), formats.end())))
      ->needs(robot);
}

std::string table_of(const CalibrationResult& result) {
  std::string text = fmt::format("{} ({})\n\n{}\n{}", result.summary, result.method, parameter_lines(result),
                                 error_lines(result));
  for (const std::string& unknown : result.unobservable) text += fmt::format("not observable: {}\n", unknown);
  for (const std::string& warning : result.warnings) text += fmt::format("warning: {}\n", warning);
  for (const std::string& note : result.notes) text += fmt::format("note: {}\n", note);
  return text;
}

void finish_calibration(const CalibrationAnswer& answer, const CalibrationOutput& output,
                        const Common& common) {
  std::vector<OutputFile> files;
  if (!output.robot_path.empty()) files = files_of(answer, output.robot_path, output.export_format);
  write_files(files, answer.provenance.inputs);
  nlohmann::ordered_json document = document_of(answer);
  std::string text = table_of(answer.result);
  document["outputs"] = nlohmann::ordered_json::array();
  for (const OutputFile& file : files) {
    document["outputs"].push_back(file.path.string());
    text += fmt::format("wrote {}\n", file.path.string());
  }
  print(common, document, text);
}

}  // namespace trundle::app
