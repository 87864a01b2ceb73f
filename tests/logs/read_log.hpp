#pragma once

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <fmt/format.h>
#include <sys/resource.h>

#include "trundle/logs/definitions.hpp"
#include "trundle/logs/field_reader.hpp"
#include "trundle/logs/log.hpp"

namespace trundle::test {
using namespace logs;

/// What reading may take at most, whatever a log holds, of all that the process has had [MB].
constexpr double kMostMemory_mb = 256.0;
inline double peak_memory_mb() {
#if defined(__SANITIZE_ADDRESS__)
  return 0.0;  // the sanitizer's own is more
#else
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return 1e-3 * static_cast<double>(usage.ru_maxrss);
#endif
}

/// A log in a file of its own, gone with it.
class LogFile {
 public:
  explicit LogFile(std::string_view bytes) {
    std::string name = (std::filesystem::temp_directory_path() / "trundle_log_XXXXXX").string();
    const int file = ::mkstemp(name.data());
    if (file < 0) throw std::runtime_error("no temporary file");
    path_ = name;
    std::ofstream(path_, std::ios::binary) << bytes;
    std::fclose(::fdopen(file, "r"));
  }
  ~LogFile() { std::filesystem::remove(path_); }
  LogFile(const LogFile&) = delete;
  LogFile& operator=(const LogFile&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

inline std::string text_of_value(const Value& value) {
  if (const auto* const text = std::get_if<std::string_view>(&value)) return fmt::format("'{}'", *text);
  if (const auto* const number = std::get_if<std::int64_t>(&value)) return fmt::format("{}", *number);
  if (const auto* const number = std::get_if<std::uint64_t>(&value)) return fmt::format("{}", *number);
  if (const auto* const number = std::get_if<double>(&value)) return fmt::format("{}", *number);
  return "none";
}

/// "path=value path=value", and "..." where the message ends before its layout; "?": it has none.
inline std::string fields_of(const Message& message) {
  std::string text;
  try {
    const bool whole =
        visit(layout_of(*message.channel), message.channel->encoding, message.bytes,
              [&](std::string_view path, const Value& value) {
                text += fmt::format("{}{}={}", text.empty() ? "" : " ", path, text_of_value(value));
              });
    return whole ? text : text + " ...";
  } catch (const BadDefinition&) {
    return "?";
  }
}

/// What a log holds, as lines "time_us topic: fields".
struct LogContent {
  std::vector<std::string> lines;
  std::optional<Cut> cut;
  std::vector<Loss> losses;
};

inline LogContent content_of(Log& log) {
  LogContent content;
  while (const std::optional<Message> message = log.next())
    content.lines.push_back(
        fmt::format("{} {}: {}", message->log_time_ns / 1000, message->channel->topic, fields_of(*message)));
  content.cut = log.cut();
  content.losses.assign(log.losses().begin(), log.losses().end());
  return content;
}

inline LogContent read_log(std::string_view bytes, const Limits& limits = {}) {
  const LogFile file(bytes);
  return content_of(*open_log(file.path(), limits));
}

}  // namespace trundle::test
