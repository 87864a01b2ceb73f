#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace trundle {

/// The whole file as text. Throws InputError when it cannot be read.
std::string read_file(const std::filesystem::path& path);

/// Writes to a temporary name beside `path` and renames it: a killed run leaves the old file or none.
/// Creates missing parent folders. Throws InputError when the place cannot be written.
void write_file(const std::filesystem::path& path, std::string_view content);

/// Lower-case hexadecimal SHA-256 of the content.
std::string sha256_of(std::string_view content);

/// An input as the outputs name it.
struct InputFile {
  std::string path;
  std::string sha256;
};

InputFile input_file(const std::filesystem::path& path);

}  // namespace trundle
