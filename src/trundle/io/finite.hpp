#pragma once

#include <filesystem>
#include <string_view>

#include "trundle/namespaces.hpp"

namespace trundle::io {

/// The last look at a file before it is written: throws CannotAnswer, which names file, line and column or
/// key, where a number of a .csv, .tum or .toml is none, or a variance is negative. JSON has null for what is
/// not known.
void require_finite(const std::filesystem::path& path, std::string_view content);

}  // namespace trundle::io
