#include <memory>

#include <fmt/format.h>

#include "trundle/report/calibration_json.hpp"
#include "trundle/report/page.hpp"

#include "command.hpp"

namespace trundle::app {
namespace {

struct Options {
  std::vector<std::string> inputs;  ///< folders of results, or their files
  std::string output = "report.html";
  Common common;
};

/// The calibration.json that is meant by a folder or by its own name.
std::filesystem::path result_file(const std::filesystem::path& input) {
  constexpr const char* kExpected =
      "the folder that trundle calibrate or umbmark wrote to, or its calibration.json";
  if (!std::filesystem::exists(input)) throw InputError(input.string(), "does not exist", kExpected);
  if (!std::filesystem::is_directory(input)) return input;
  if (!std::filesystem::exists(input / "calibration.json"))
    throw InputError(input.string(), "has no calibration.json", kExpected);
  return input / "calibration.json";
}

void run(const Options& options) {
  Provenance provenance;
  nlohmann::ordered_json results = nlohmann::ordered_json::array();
  for (const std::string& input : options.inputs) {
    const std::filesystem::path path = result_file(input);
    const std::string text = read_file(path);
    provenance.inputs.push_back({path.string(), sha256_of(text)});
    results.push_back({{"label", input}, {"document", parse_calibration_json(text, path.string())}});
  }
  write_file(options.output, report_page(results, to_json(provenance)));
  nlohmann::ordered_json document = to_json(provenance);
  document["outputs"] = {options.output};
  print(options.common, document, fmt::format("wrote {}\n", options.output));
}

}  // namespace

void add_report(CLI::App& app) {
  auto options = std::make_shared<Options>();
  CLI::App* command = add_command(app, "report", "Draw results as one page that opens from disk",
                                  "trundle report out/calibration -o report.html", options->common);
  command
      ->add_option("DIR", options->inputs,
                   "Folders with a calibration.json, or such files; several are compared")
      ->required();
  command->add_option("-o,--output", options->output, "The page")->capture_default_str();
  command->callback([options] { run(*options); });
}

}  // namespace trundle::app
