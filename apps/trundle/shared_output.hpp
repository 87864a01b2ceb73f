#pragma once

#include <filesystem>
#include <string>

#include "trundle/geometry/trajectory.hpp"
#include "trundle/recording/recording.hpp"

#include "command.hpp"

namespace trundle::app {

/// "warning" or "note".
const char* word_of(Severity severity);
nlohmann::ordered_json to_json(const Problem& problem);
/// "warning: place: message".
std::string line_of(const Problem& problem);

/// The provenance as comment lines, for the head of a file.
std::string head_of(const Provenance& provenance);

/// As CSV, or as TUM where the name says so, with the provenance in its head.
void write_trajectory(const std::filesystem::path& path, const Provenance& provenance,
                      const Trajectory& trajectory);

}  // namespace trundle::app
