#pragma once

#include <CLI/CLI.hpp>

namespace trundle::app {

/// What the program exits with: docs/commands.md.
enum ExitCode : int { kDone = 0, kBug = 1, kUsage = 2, kBadInput = 3, kCannotAnswer = 4 };

/// Makes `app` the program: its name, its version and all its commands.
void add_commands(CLI::App& app);

}  // namespace trundle::app
