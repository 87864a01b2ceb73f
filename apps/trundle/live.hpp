#pragma once

#include <CLI/CLI.hpp>

namespace trundle::app {

/// Thrown at the end of a command whose wrong input has been told of already, line by line.
struct BadInputTold {};

void add_live(CLI::App& app);

}  // namespace trundle::app
