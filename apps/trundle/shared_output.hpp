#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "trundle/pipeline/files.hpp"
#include "trundle/pipeline/viewers/shown.hpp"
#include "trundle/recording/recording.hpp"

#include "command.hpp"

namespace trundle::app {

/// "warning: place: message".
std::string line_of(const Finding& problem);

/// Of a filter's sightings; nothing: there were none to judge by.
std::string line_of_nis(const std::optional<double>& mean, const std::optional<double>& median);

/// --export of a command whose result viewers can show: mcap or wpilog, empty where it is not given.
CLI::Option* add_viewer(CLI::App& command, std::string& format);

}  // namespace trundle::app
