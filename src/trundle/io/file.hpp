#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "trundle/namespaces.hpp"

namespace trundle::io {

/// The whole file as text. Throws InputError when it cannot be read to its end, or is a folder, pipe or
/// device.
std::string read_file(const std::filesystem::path& path);

/// Writes to a temporary name beside `path` and renames it: a killed run leaves the old file or none.
/// Creates missing parent folders. Throws InputError when the place cannot be written, or holds what is no
/// file: a folder, a device.
void write_file(const std::filesystem::path& path, std::string_view content);

/// Lower-case hexadecimal SHA-256 of the content.
[[nodiscard]] std::string sha256_of(std::string_view content);

/// An input as the outputs name it.
struct InputFile {
  std::string path;
  std::string sha256;
};

[[nodiscard]] InputFile input_file(const std::filesystem::path& path);

/// Nothing that was read is written over: throws InputError where one of the outputs is one of the inputs, by
/// whatever name.
void require_apart(const std::vector<InputFile>& inputs, const std::vector<std::filesystem::path>& outputs);

}  // namespace trundle::io
