#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "trundle/logs/definitions.hpp"
#include "trundle/recording/csv/detail/streams.hpp"

namespace trundle::recording {

/// What recording.toml says: docs/recording.md explains its keys.
struct RecordingMap {
  std::string session;                   ///< empty: not said
  std::int64_t time_origin_s = 0;        ///< the second of the files' clock that is 0 of the recording's
  std::string seen_as = {};              ///< likewise
  std::vector<std::string> robots = {};  ///< names in sightings that are robots
  std::vector<std::pair<StreamKind, StreamSource>> streams;
  PartialReference partial;
  ReferenceSigmas reference_noise = {};
  std::filesystem::path tuple_file;  ///< empty: none
};

/// How tables that name a topic are read.
struct LogContext {
  std::filesystem::path log;  ///< whatever their `file`; empty: that
  logs::Definitions definitions;
};

/// The recordings of one layout that a recording.toml maps by `file = "*_run-*.csv"`: what the stars stand
/// for in the names of the files that match, in their order. Empty: no `file` has a star, and it maps one
/// recording. Throws InputError where none of a stream's files match.
std::vector<std::string> runs_of(const std::filesystem::path& file);

/// `run`: one of runs_of(); empty where there are none. A stream that has no file of that run is left out.
/// Throws InputError with file, line, fact and expectation.
RecordingMap parse_recording_map(std::string_view text, const std::filesystem::path& file,
                                 const std::string& run = {}, const LogContext& context = {});

}  // namespace trundle::recording
