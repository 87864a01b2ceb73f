#include "trundle/report/provenance.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "trundle/io/words.hpp"
#include "trundle/report/json_text.hpp"

namespace trundle::report {
namespace {

using Json = nlohmann::ordered_json;

std::string text_of(const Json& value) {
  return value.is_string() ? value.get<std::string>() : dumped(value);
}

}  // namespace

std::string program_version() {
  return TRUNDLE_VERSION;
}

Json to_json(const Provenance& provenance) {
  Json document = {{"program", "trundle"}, {"version", provenance.version}};
  document["inputs"] = Json::array();
  for (const InputFile& file : provenance.inputs)
    document["inputs"].push_back({{"path", file.path}, {"sha256", file.sha256}});
  document["options"] = Json::object();
  for (const auto& [key, value] : provenance.options) document["options"][key] = value;
  if (provenance.seed) document["seed"] = *provenance.seed;
  return document;
}

Provenance provenance_from_json(const Json& document) {
  Provenance provenance;
  provenance.version = document.value("version", "");
  for (const Json& file : document.value("inputs", Json::array()))
    provenance.inputs.push_back({file.value("path", ""), file.value("sha256", "")});
  const Json options = document.value("options", Json::object());
  for (const auto& [key, value] : options.items()) provenance.options.emplace_back(key, text_of(value));
  if (const Json seed = document.value("seed", Json()); seed.is_number())
    provenance.seed = seed.get<std::uint64_t>();
  return provenance;
}

std::vector<std::string> to_lines(const Provenance& provenance) {
  std::vector<std::string> lines = {fmt::format("trundle {}", provenance.version)};
  for (const InputFile& file : provenance.inputs)
    lines.push_back(one_line(fmt::format("input {} sha256 {}", file.path, file.sha256)));
  for (const auto& [key, value] : provenance.options)
    lines.push_back(one_line(fmt::format("option {} = {}", key, value)));
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

void add_read_options(const ReadOptions& reading, Provenance& provenance) {
  if (reading.robot_number != 0)
    provenance.options.emplace_back("robot-number", std::to_string(reading.robot_number));
  if (!reading.map.empty()) provenance.options.emplace_back("recording", reading.map);
  for (const std::string& folder : reading.msg_path) provenance.options.emplace_back("msg-path", folder);
}

}  // namespace trundle::report
