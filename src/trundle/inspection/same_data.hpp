#pragma once

#include <string>

#include "trundle/recording/recording.hpp"

namespace trundle::inspection {

/// Whether two recordings were read from files with the same content, over the same time: one drive under two
/// names. What their recording.toml say does not matter.
bool same_data(const Recording& a, const Recording& b);

/// The folder that a recording was read from; its name where it was made in memory.
std::string folder_of(const Recording& recording);

}  // namespace trundle::inspection
