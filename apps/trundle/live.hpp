#pragma once

#include <CLI/CLI.hpp>

namespace trundle::app {

void add_live(CLI::App& app);

}  // namespace trundle::app
