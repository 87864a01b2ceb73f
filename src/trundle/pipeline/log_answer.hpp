#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "trundle/logs/survey.hpp"
#include "trundle/pipeline/provenance.hpp"

namespace trundle::pipeline {

/// What `trundle info` is asked of a log that nothing maps.
struct LogQuestion {
  std::filesystem::path log;  ///< a file, or a folder of rosbag2
  std::vector<std::filesystem::path> message_folders =
      {};  ///< with .msg files of types the log does not define
};
struct LogAnswer {
  Provenance provenance;
  std::filesystem::path log;
  logs::LogSummary summary;
};

/// The files of a log: itself, or all that its folder holds.
[[nodiscard]] std::vector<InputFile> inputs_of_log(const std::filesystem::path& log);

/// Throws InputError where it is no log, or nothing of it can be read.
[[nodiscard]] LogAnswer answer_log(const LogQuestion& question);

/// Its first and last message, on its clock; nothing where it has none.
struct LogSpan {
  double start_s = 0.0, end_s = 0.0;
};
[[nodiscard]] std::optional<LogSpan> span_of(const logs::LogSummary& summary);

/// What `trundle info --json` prints of it.
[[nodiscard]] nlohmann::ordered_json document_of(const LogAnswer& answer);

/// "bag.db3: byte 4711: the file ends within a page"; and of each piece that was passed over.
[[nodiscard]] std::vector<std::string> faults_of(const logs::LogSummary& summary);

}  // namespace trundle::pipeline
