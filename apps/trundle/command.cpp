#include "command.hpp"

#include <fmt/core.h>

namespace trundle::app {

CLI::App* add_command(CLI::App& app, const std::string& name, const std::string& description,
                      const std::string& example, Common& common) {
  CLI::App* command = app.add_subcommand(name, description);
  command->footer("\nExample:\n  " + example);
  command->add_flag("--json", common.json, "Print one JSON document on stdout");
  command->add_flag("--quiet", common.quiet, "Print nothing but errors");
  return command;
}

nlohmann::ordered_json to_json(const Provenance& provenance) {
  nlohmann::ordered_json document = {{"program", "trundle"}, {"version", TRUNDLE_VERSION}};
  document["inputs"] = nlohmann::ordered_json::array();
  for (const InputFile& file : provenance.inputs)
    document["inputs"].push_back({{"path", file.path}, {"sha256", file.sha256}});
  document["options"] = nlohmann::ordered_json::object();
  for (const auto& [key, value] : provenance.options) document["options"][key] = value;
  if (provenance.seed) document["seed"] = *provenance.seed;
  return document;
}

std::vector<std::string> to_lines(const Provenance& provenance) {
  std::vector<std::string> lines = {fmt::format("trundle {}", TRUNDLE_VERSION)};
  for (const InputFile& file : provenance.inputs)
    lines.push_back(fmt::format("input {} sha256 {}", file.path, file.sha256));
  for (const auto& [key, value] : provenance.options)
    lines.push_back(fmt::format("option {} = {}", key, value));
  if (provenance.seed) lines.push_back(fmt::format("seed {}", *provenance.seed));
  return lines;
}

void print(const Common& common, const nlohmann::ordered_json& document, const std::string& text) {
  if (common.json) {
    fmt::print("{}\n", document.dump(2));
  } else if (!common.quiet) {
    fmt::print("{}", text);
  }
}

}  // namespace trundle::app
