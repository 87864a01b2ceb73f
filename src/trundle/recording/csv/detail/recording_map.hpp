#pragma once

#include <filesystem>
#include <string>
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
RecordingMap read_recording_map(const std::filesystem::path& file);

}  // namespace trundle::recording
