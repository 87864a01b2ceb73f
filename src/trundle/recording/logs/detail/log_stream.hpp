#pragma once

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "trundle/logs/field_reader.hpp"
#include "trundle/recording/logs/detail/log_streams.hpp"
#include "trundle/recording/logs/detail/up_axis.hpp"

namespace trundle::recording {

inline constexpr std::string_view kUp = ".up";    ///< of three axes, the one that points up
inline constexpr std::string_view kYaw = ".yaw";  ///< of a quaternion

/// What is read of the messages of one channel.
struct ChannelReaders {
  std::optional<logs::FieldReader> stamp;   ///< none: the log's time
  std::optional<logs::FieldReader> status;  ///< of a sensor_msgs/NavSatFix: below 0 it has no fix
  std::vector<std::pair<std::size_t, logs::FieldReader>> columns;  ///< of LogStream::values_
  bool makes_rows = false;
  UpAxis* up = nullptr;
};

/// One stream's rows, as the messages come.
class LogStream {
 public:
  LogStream(const StreamSource& source, const logs::Definitions& definitions);

  void take(const logs::Message& message);
  /// Nothing: no row is there yet.
  std::optional<std::int64_t> first_stamp() const;
  /// All rows; and what there is to say of stamps and axes.
  Table finish(std::vector<Finding>& findings);

 private:
  /// Of a value that is computed of several fields.
  void add_parts(const ColumnSource& column, std::string_view ending,
                 std::initializer_list<std::string_view> parts);

  struct PendingRow {
    std::int64_t stamp;
    std::int64_t log_time;
    std::int64_t start;  ///< of its instant
  };

  struct Path {
    std::string path;
    const ColumnSource* column;
  };
  const std::string& topic_of(const ColumnSource& column) const;
  std::string place_name() const;
  const std::string& place_of(const ColumnSource& column) const;
  /// Compiled when a channel is met first; nullptr: nothing of it is wanted.
  ChannelReaders* readers_of(const logs::Message& message);
  std::unique_ptr<ChannelReaders> compile(const logs::Channel& channel);
  logs::Layout layout_or_refuse(const logs::Channel& channel) const;
  static logs::FieldReader reader_or_refuse(const logs::Layout& layout, const logs::Channel& channel,
                                            const std::string& path, const std::string& where);
  /// Where recording.toml names none: that of a header, if there is one.
  std::optional<logs::FieldReader> stamp_reader(const logs::Layout& layout, const logs::Channel& channel);
  void take_rows(const logs::Message& message, const ChannelReaders& readers);
  /// A single value goes to all rows of a message.
  static logs::Value value_at(const std::vector<logs::Value>& values, std::size_t index, std::size_t row,
                              const ChannelReaders& readers);
  void push_stamp(const logs::Message& message, const ChannelReaders& readers, std::size_t row);
  void push_row(std::int64_t stamp, std::int64_t log_time);
  void push_value(std::size_t index, const logs::Value& value);
  double time_of(const logs::Value& value) const;
  static std::string text_of(const logs::Value& value);

  // Columns of several topics: each keeps its last value, and a row is made once its instant is over.
  void take_held(const logs::Message& message, const ChannelReaders& readers);
  /// Whether the instant of a row is over. Entries of one cycle of a robot's loop are written one after the
  /// other: they are one row, until one of them is written again.
  bool is_over(const PendingRow& row, const logs::Message& message) const;
  void push_held();
  void take_column(std::size_t i, Table& table, std::vector<Finding>& findings, const std::string& name);
  /// In place of the first of a quaternion's four. One of zeros says that there is none.
  void take_yaw(std::size_t first);
  /// In place of the first of three axes: what of them is about the vertical.
  void take_vertical(std::size_t first, const std::array<double, 3>& vertical);
  void report_axis(const Table& table, std::vector<Finding>& findings) const;
  static void report_axis(const UpAxis::Answer& up, std::vector<Finding>& findings, const std::string& name);
  /// Which stamps they are, and how far from the times at which messages were recorded. A publisher that
  /// leaves its stamps empty has none.
  void report_stamps(std::vector<Finding>& findings, const std::string& name);

  [[noreturn]] void refuse_empty() const;

  const StreamSource& source_;
  const logs::Definitions& definitions_;
  std::vector<Path> paths_;
  std::vector<std::size_t> first_value_;  ///< of each of the source's columns among the paths
  bool holds_ = false;                    ///< columns are of several topics
  bool is_header_stamp_ = false;
  std::map<const logs::Channel*, std::unique_ptr<ChannelReaders>> readers_;
  std::optional<UpAxis> up_;
  std::size_t messages_ = 0;
  std::vector<std::int64_t> stamps_, log_times_;
  LineMap ordinals_;  ///< of the row's message among those of its topic, from 1
  std::vector<std::vector<double>> numbers_;
  std::vector<std::vector<std::string>> texts_;
  std::vector<std::vector<logs::Value>> held_;  ///< of one message
  std::vector<logs::Value> stamp_values_;
  std::map<std::size_t, double> held_numbers_;  ///< of each path that was read already
  std::map<std::size_t, std::string> held_texts_;
  std::optional<PendingRow> pending_;
  std::vector<const logs::Channel*> written_;  ///< in its instant
};

}  // namespace trundle::recording
