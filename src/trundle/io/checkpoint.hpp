#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "trundle/namespaces.hpp"

namespace trundle::io {

/// Writes a state: a line "trundle checkpoint <format> <kind> <SHA-256 of the state>", then its bytes.
/// Complete or not at all, as write_file.
void write_checkpoint(const std::filesystem::path& path, std::string_view kind, std::string_view state);

/// The state of a checkpoint of this kind. Throws InputError when the file is none, is of another kind or
/// format, or is not complete to the last byte.
std::string read_checkpoint(const std::filesystem::path& path, std::string_view kind);

}  // namespace trundle::io
