#pragma once

#include <string>

#include "manual.hpp"

namespace trundle::app {

/// trundle(1), in the macros of man(7).
std::string man_page(const Manual& manual);

// What a shell needs to complete a command line: commands, options, the values that are possible, else files.
std::string bash_completion(const Manual& manual);
std::string zsh_completion(const Manual& manual);
std::string fish_completion(const Manual& manual);

}  // namespace trundle::app
