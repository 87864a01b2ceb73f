#pragma once

#include <filesystem>

#include "trundle/recording/csv/detail/streams.hpp"
#include "trundle/recording/csv/detail/toml_reader.hpp"

namespace trundle::recording {

/// Whether a table of recording.toml names a topic, or one of its columns does.
[[nodiscard]] bool is_of_log(TomlReader& table);

/// What a table of recording.toml says of its stream, which is in this file: docs/recording.md. Throws
/// InputError.
[[nodiscard]] StreamSource stream_in(StreamKind kind, TomlReader& table, const std::filesystem::path& file);

}  // namespace trundle::recording
