#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "trundle/logs/definitions.hpp"
#include "trundle/recording/csv/detail/streams.hpp"

namespace trundle::recording {

/// The type of a topic's messages, short: "nav_msgs/Odometry". Throws InputError with `place` where the log
/// has no such topic, and says which it has.
[[nodiscard]] std::string type_of_topic(const std::filesystem::path& log, const std::string& topic,
                                        const std::string& place);

/// What the columns of a stream are in messages of a known type; empty where nothing is known.
[[nodiscard]] std::vector<ColumnSource> columns_of_type(StreamKind kind, std::string_view type);

/// How far stamps are from the times at which their messages were recorded: the median, and the farthest from
/// it.
[[nodiscard]] Finding finding_of_stamps(const std::vector<std::int64_t>& stamps,
                                        const std::vector<std::int64_t>& log_times, const std::string& place);

struct LogStreamSource {
  StreamKind kind;
  const StreamSource* source;
};
/// The rows of streams of one log, all of them in one pass over it: one entry for each source. Appends to
/// `findings` where the log is cut, and what the stamps are. Throws InputError where a path leads nowhere, or
/// a stream has no row.
[[nodiscard]] std::vector<Table> read_log(std::span<const LogStreamSource> sources,
                                          const logs::Definitions& definitions,
                                          std::vector<Finding>& findings);

/// As first_stamp(), of a log: that of the first message of its topic.
[[nodiscard]] std::optional<double> first_stamp_of_log(const StreamSource& source,
                                                       const logs::Definitions& definitions);

}  // namespace trundle::recording
