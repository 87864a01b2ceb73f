#include "trundle/calibration/squares/umbmark.hpp"

#include <memory>

#include <fmt/format.h>

#include "trundle/calibration/squares/square_runs.hpp"

#include "calibration_output.hpp"
#include "command.hpp"

namespace trundle::app {
namespace {

struct UmbmarkArguments {
  std::vector<std::string> inputs;  ///< one sheet, or recordings of square runs
  std::string robot;
  std::optional<double> side_m;
  std::string method = "orientation";
  CalibrationOutput output;
  Common common;
};

/// What the method works on, and what it was read from.
struct Squares {
  CalibrationResult result;
  std::vector<InputFile> files;
};

Squares from_sheet(const UmbmarkArguments& options, const Robot& nominal, SquareMethod method) {
  const std::filesystem::path path = options.inputs.front();
  return {umbmark(read_sheet(path, options.side_m), nominal, method), {input_file(path)}};
}

Squares from_recordings(const UmbmarkArguments& options, const Robot& nominal, SquareMethod method) {
  if (!options.side_m) throw CLI::RequiredError("--side-m (the nominal side of the square that was driven)");
  const std::vector<Recording> recordings = read_recordings(options.inputs);
  Squares input = {umbmark(recordings, nominal, *options.side_m, method), {}};
  for (const Recording& recording : recordings)
    input.files.insert(input.files.end(), recording.inputs.begin(), recording.inputs.end());
  return input;
}

bool is_sheet(const UmbmarkArguments& options) {
  if (!std::filesystem::is_directory(options.inputs.front())) {
    if (options.inputs.size() == 1) return true;
    throw InputError(options.inputs[1], "more than one input, the first a sheet",
                     "one sheet, or recording folders");
  }
  return false;
}

Provenance provenance_of(const UmbmarkArguments& options, std::vector<InputFile> files) {
  files.push_back(input_file(options.robot));
  Provenance provenance = {
      .inputs = std::move(files), .options = {{"method", options.method}}, .seed = std::nullopt};
  if (options.side_m) provenance.options.emplace_back("side_m", fmt::format("{}", *options.side_m));
  if (!options.output.export_format.empty())
    provenance.options.emplace_back("export", options.output.export_format);
  return provenance;
}

void run(const UmbmarkArguments& options) {
  const Robot nominal = read_robot(options.robot);
  const SquareMethod method = *square_method_named(options.method);
  Squares input =
      is_sheet(options) ? from_sheet(options, nominal, method) : from_recordings(options, nominal, method);
  CalibrationAnswer answer{provenance_of(options, std::move(input.files)), std::move(input.result)};
  add_provenance(answer.provenance, answer.result);
  finish_calibration(answer, options.output, options.common);
}

}  // namespace

void add_umbmark(CLI::App& app) {
  auto options = std::make_shared<UmbmarkArguments>();
  CLI::App* command =
      add_command(app, "umbmark", "Calibrate from squares driven both ways, measured by hand or recorded",
                  "trundle umbmark sheet.csv --robot nominal.toml -o calibrated.toml", options->common);
  command->add_option("SHEET", options->inputs, "A sheet (CSV), or recording folders of single square runs")
      ->required();
  command->add_option("--robot", options->robot, "Nominal robot file")->required();
  command
      ->add_option("--side-m", options->side_m, "Nominal side of the square [m]; a sheet may say it itself")
      ->check(number_from(kSmallest, kLargest));
  command
      ->add_option("--method", options->method,
                   "classic: positions; orientation: headings and the leg; ml: everything at once")
      ->check(CLI::IsMember({"classic", "orientation", "ml"}))
      ->capture_default_str();
  add_calibration_output(*command, options->output);
  command->callback([options] { run(*options); });
}

}  // namespace trundle::app
