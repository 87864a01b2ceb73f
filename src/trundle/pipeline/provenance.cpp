#include "trundle/pipeline/provenance.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace trundle {

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

std::string head_of(const Provenance& provenance) {
  std::string text;
  for (const std::string& line : to_lines(provenance)) text += "# " + line + "\n";
  return text;
}

void add_inputs(const std::vector<InputFile>& inputs, Provenance& provenance) {
  provenance.inputs.insert(provenance.inputs.end(), inputs.begin(), inputs.end());
}

void add_robot_number(int robot_number, Provenance& provenance) {
  if (robot_number != 0) provenance.options.emplace_back("robot-number", std::to_string(robot_number));
}

const char* word_of(Severity severity) {
  return severity == Severity::warning ? "warning" : "note";
}

nlohmann::ordered_json to_json(const Finding& problem) {
  return {{"severity", word_of(problem.severity)},
          {"kind", name_of(problem.code)},
          {"place", problem.place},
          {"count", problem.count},
          {"message", describe(problem)}};
}

nlohmann::ordered_json to_json(const std::vector<Finding>& problems) {
  nlohmann::ordered_json document = nlohmann::ordered_json::array();
  for (const Finding& problem : problems) document.push_back(to_json(problem));
  return document;
}

}  // namespace trundle
