#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "trundle/pipeline/files.hpp"
#include "trundle/pipeline/viewers/shown.hpp"
#include "trundle/recording/recording.hpp"

#include "command.hpp"

namespace trundle::app {

/// "warning: place: message".
std::string line_of(const Finding& problem);

/// --export of a command whose result viewers can show: mcap or wpilog, empty where it is not given.
CLI::Option* add_viewer(CLI::App& command, std::string& format);

}  // namespace trundle::app
