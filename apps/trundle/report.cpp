#include <memory>

#include <fmt/format.h>

#include "trundle/pipeline/files.hpp"
#include "trundle/pipeline/report_answer.hpp"
#include "trundle/report/json_text.hpp"
#include "trundle/report/page.hpp"

#include "command.hpp"

namespace trundle::app {
namespace {

struct ReportArguments {
  ReportQuestion question;
  std::string output = "report.html";
  Common common;
};

std::string text_of(const ReportArguments& options, const nlohmann::ordered_json& report) {
  const bool json = std::filesystem::path(options.output).extension() == ".json";
  return json ? json_text(report) : report_page(report);
}

/// All files of a folder, whether they were read or not.
void add_files_in(const std::filesystem::path& folder, std::vector<InputFile>& inputs) {
  std::error_code none;  // a file, or nothing
  for (const auto& entry : std::filesystem::directory_iterator(folder, none))
    inputs.push_back({entry.path().string(), {}});
}

/// All that the page may not go over: what it was drawn from, the records of the runs, and the recording that
/// it is compared with.
std::vector<InputFile> inputs_of(const ReportArguments& options, const ReportAnswer& answer) {
  std::vector<InputFile> inputs = answer.provenance.inputs;
  for (const std::string& folder : options.question.inputs)
    inputs.push_back({(std::filesystem::path(folder) / "run.json").string(), {}});
  add_files_in(options.question.reference, inputs);
  return inputs;
}

void run(const ReportArguments& options) {
  const ReportAnswer answer = answer_report(options.question);
  write_files({{options.output, text_of(options, answer.document)}}, inputs_of(options, answer));
  nlohmann::ordered_json document = to_json(answer.provenance);
  document["outputs"] = {options.output};
  print(options.common, document, fmt::format("wrote {}\n", options.output));
}

}  // namespace

void add_report(CLI::App& app) {
  auto options = std::make_shared<ReportArguments>();
  CLI::App* command = add_command(app, "report", "Draw results as one page that opens from disk",
                                  "trundle report out/kobuki -o report.html", options->common);
  command
      ->add_option("DIR", options->question.inputs,
                   "Folders with any of run.json, info.json, calibration.json, trajectories, slip.json or "
                   "slip.csv, slam/; or such files; several are compared")
      ->required();
  command->add_option("--reference", options->question.reference,
                      "What trajectories are compared with where a folder has no reference.csv: a recording, "
                      "or a trajectory");
  command->add_option("--robot", options->question.robot, "Robot file: where its [reference_sensor] is");
  command->add_option("-o,--output", options->output, "The page; .json by its name: what it draws")
      ->capture_default_str();
  command->callback([options] { run(*options); });
}

}  // namespace trundle::app
