#pragma once

#include <filesystem>
#include <functional>
#include <string_view>

#include "trundle/namespaces.hpp"

namespace trundle::io {

/// Takes a text piece by piece.
using TakeText = std::function<void(std::string_view)>;

/// As write_file, of a text that is never all in memory: `produce` hands its pieces on.
void write_file(const std::filesystem::path& path, const std::function<void(const TakeText&)>& produce);

}  // namespace trundle::io
