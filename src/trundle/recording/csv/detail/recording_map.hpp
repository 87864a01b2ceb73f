#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "trundle/recording/csv/detail/streams.hpp"

namespace trundle::recording {

/// What recording.toml says: docs/recording.md explains its keys.
struct RecordingMap {
  std::string session;  ///< empty: not said
  std::vector<std::pair<StreamKind, StreamSource>> streams;
  PartialReference partial;
  std::filesystem::path tuple_file;  ///< empty: none
};

/// Throws InputError with file, line, fact and expectation.
RecordingMap parse_recording_map(std::string_view text, const std::filesystem::path& file);

}  // namespace trundle::recording
