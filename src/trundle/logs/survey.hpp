#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "trundle/logs/definitions.hpp"
#include "trundle/logs/log.hpp"

namespace trundle::logs {

/// What a field was over a log.
struct FieldSummary {
  /// As FieldReader takes it; elements of arrays beside an array of names by these: "position[name=left]".
  std::string path;
  std::string unit = {};  ///< where the format names it
  bool is_text = false;
  std::uint64_t values = 0;   ///< that were numbers, or texts
  std::uint64_t changes = 0;  ///< how often one differed from the one before
  std::uint64_t falls = 0;    ///< how often it was less
  double first = 0.0, last = 0.0, least = 0.0, most = 0.0;
  double travel = 0.0;    ///< sum of the sizes of all changes
  std::string text = {};  ///< the first that is not empty

  /// The next number; one that is not finite is none.
  void add(double number);
};

/// How often a topic comes, and what its messages hold.
struct TopicSummary {
  std::string topic;
  std::string type;
  std::string metadata = {};
  std::string unreadable = {};  ///< why its messages cannot be decoded; empty: they can
  bool has_time = true;         ///< as of the channel
  std::uint64_t messages = 0;
  std::uint64_t broken = 0;  ///< that end before their layout does; only where fields were asked for
  std::int64_t start_ns = 0, end_ns = 0;  ///< earliest and latest, on the log's clock
  double rate_hz = 0.0;                   ///< of the median step between messages; 0: there is none
  std::uint64_t gaps = 0;                 ///< steps that are longer than max(0.5 s, 5 medians)
  double longest_step_s = 0.0;
  /// How much earlier the stamps in the headers are than the log's: mean, least and most; nothing: no stamps.
  struct StampLag {
    double mean_s = 0.0, least_s = 0.0, most_s = 0.0;
  };
  std::optional<StampLag> stamp_lag = {};
  std::vector<std::string> paths = {};  ///< of all fields, "name[]", as Layout::paths(); known with the first
  std::vector<FieldSummary> fields = {};  ///< where they were asked for
};

struct LogSummary {
  std::string format;
  bool is_written_on_change = false;
  std::vector<TopicSummary> topics;  ///< by name
  std::optional<Cut> cut;
  std::vector<Loss> losses;
};

struct SurveyOptions {
  bool fields = false;            ///< what each field was, too
  std::size_t most_fields = 256;  ///< of a topic: those of long arrays are left out
  std::size_t largest_message =
      1 << 14;  ///< of whose fields are told: larger ones are images and the like [bytes]
};

/// Reads a log from its start to its end. What it keeps grows with the number of topics, not with the file.
[[nodiscard]] LogSummary survey(Log& log, const SurveyOptions& options = {},
                                const Definitions& definitions = {});

}  // namespace trundle::logs
