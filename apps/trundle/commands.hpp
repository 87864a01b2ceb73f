#pragma once

#include <CLI/CLI.hpp>

namespace trundle::app {

/// Makes `app` the program: its name, its version and all its commands.
void add_commands(CLI::App& app);

}  // namespace trundle::app
