#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "trundle/io/file.hpp"
#include "trundle/recording/recording.hpp"

namespace trundle::report {

/// The version of this program.
std::string program_version();

/// Program version, inputs with SHA-256, options and seed: what every output names.
struct Provenance {
  std::vector<InputFile> inputs;
  std::vector<std::pair<std::string, std::string>> options;
  std::optional<std::uint64_t> seed;
  std::string version = program_version();
};

/// The first members of a document.
nlohmann::ordered_json to_json(const Provenance& provenance);
/// Those of a document in which each has its type or is missing: then it is empty.
Provenance provenance_from_json(const nlohmann::ordered_json& document);
/// The same as lines, for what quotes them itself.
std::vector<std::string> to_lines(const Provenance& provenance);
/// The same as comment lines, for the head of a CSV or TOML file.
std::string head_of(const Provenance& provenance);

void add_inputs(const std::vector<InputFile>& inputs, Provenance& provenance);
/// The options of how recordings are read, where they were given.
void add_read_options(const ReadOptions& reading, Provenance& provenance);

}  // namespace trundle::report
