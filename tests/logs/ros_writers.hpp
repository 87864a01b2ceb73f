#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include <bzlib.h>
#include <lz4frame.h>
#include <sqlite3.h>
#include <zstd.h>

#include "trundle/logs/detail/crc32.hpp"

/// Bags and MCAP files, written byte by byte from their specifications: they share no code with what reads
/// them.
namespace trundle::test {

/// Bytes, the lowest first.
class RosBytes {
 public:
  template <class Number>
  RosBytes& put(Number number) {
    bytes_.append(reinterpret_cast<const char*>(&number), sizeof number);
    return *this;
  }
  RosBytes& raw(std::string_view text) {
    bytes_ += text;
    return *this;
  }
  /// After its length of 32 bits.
  RosBytes& text(std::string_view text) { return put(static_cast<std::uint32_t>(text.size())).raw(text); }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

/// A message in CDR, of either order of bytes, with its padding. `kind`: that of the big-endian
/// encapsulation; from 6 on it is XCDR2.
class CdrBytes {
 public:
  explicit CdrBytes(bool big_endian = false, int kind = 0) : big_(big_endian), kind_(kind) {}
  template <class Number>
  CdrBytes& put(Number number) {
    const std::size_t unit = kind_ < 6 ? sizeof number : std::min<std::size_t>(sizeof number, 4);
    body_.append((unit - body_.size() % unit) % unit, '\0');
    body_ += in_order(number);
    return *this;
  }
  /// What `write` writes, after its length in bytes.
  template <class Write>
  CdrBytes& delimited(Write write) {
    put(std::uint32_t{0});
    const std::size_t start = body_.size();
    write();
    body_.replace(start - 4, 4, in_order(static_cast<std::uint32_t>(body_.size() - start)));
    return *this;
  }
  CdrBytes& text(std::string_view text) {
    put(static_cast<std::uint32_t>(text.size() + 1));
    body_ += text;
    body_ += '\0';
    return *this;
  }
  std::string bytes() const {
    return std::string{'\0', static_cast<char>(kind_ + (big_ ? 0 : 1)), '\0', '\0'} + body_;
  }

 private:
  template <class Number>
  std::string in_order(Number number) const {
    std::string bytes(reinterpret_cast<const char*>(&number), sizeof number);
    if (big_) bytes.assign(bytes.rbegin(), bytes.rend());
    return bytes;
  }

  bool big_;
  int kind_;
  std::string body_;
};

inline std::string compressed(const std::string& how, const std::string& bytes) {
  std::string out(bytes.size() * 2 + 1024, '\0');
  if (how == "bz2") {
    auto size = static_cast<unsigned>(out.size());
    BZ2_bzBuffToBuffCompress(out.data(), &size, const_cast<char*>(bytes.data()),
                             static_cast<unsigned>(bytes.size()), 9, 0, 0);
    out.resize(size);
  } else if (how == "lz4") {
    out.resize(LZ4F_compressFrameBound(bytes.size(), nullptr));
    out.resize(LZ4F_compressFrame(out.data(), out.size(), bytes.data(), bytes.size(), nullptr));
  } else if (how == "zstd") {
    out.resize(ZSTD_compressBound(bytes.size()));
    out.resize(ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), 3));
  } else {
    out = bytes;
  }
  return out;
}

struct WrittenMessage {
  std::uint32_t channel = 0;
  std::int64_t time_ns = 0;
  std::string bytes;
};

struct WrittenChannel {
  std::string topic;
  std::string type;
  std::string definition;
};

struct WrittenLog {
  std::vector<WrittenChannel> channels;
  std::vector<WrittenMessage> messages;
};

struct WrittenHow {
  std::string compression = "none";
  bool chunked = true;
  bool closed = true;  ///< with an index
  std::size_t messages_of_chunk = 3;
  std::string schema = "ros1msg";  ///< MCAP's
  std::string encoding = "ros1";
};

// ---- ROS 1 ----

inline std::string bag_fields(std::initializer_list<std::pair<std::string, std::string>> fields) {
  RosBytes out;
  for (const auto& [name, value] : fields) out.text(name + "=" + value);
  return out.bytes();
}

inline std::string bag_number(std::uint64_t number, std::size_t size) {
  return std::string(reinterpret_cast<const char*>(&number), size);
}

inline std::string bag_record(const std::string& header, const std::string& data) {
  return RosBytes().text(header).text(data).bytes();
}

inline std::string bag_connection(const WrittenLog& log, std::size_t id) {
  const WrittenChannel& channel = log.channels[id];
  return bag_record(bag_fields({{"op", "\x07"}, {"conn", bag_number(id, 4)}, {"topic", channel.topic}}),
                    bag_fields({{"topic", channel.topic},
                                {"type", channel.type},
                                {"md5sum", "*"},
                                {"message_definition", channel.definition}}));
}

inline std::string bag_header(std::uint64_t index, std::size_t connections, std::size_t chunks) {
  const std::string header = bag_fields({{"op", "\x03"},
                                         {"index_pos", bag_number(index, 8)},
                                         {"conn_count", bag_number(connections, 4)},
                                         {"chunk_count", bag_number(chunks, 4)}});
  return bag_record(header, std::string(100, ' '));
}

inline std::string bag_of(const WrittenLog& log, const WrittenHow& how = {}) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  const std::string magic = "#ROSBAG V2.0\n";
  std::string chunks, infos;
  std::vector<bool> seen(log.channels.size());
  for (std::size_t first = 0; first < log.messages.size(); first += how.messages_of_chunk) {
    std::string records;
    std::vector<std::uint32_t> counts(log.channels.size());
    for (std::size_t i = first; i < std::min(first + how.messages_of_chunk, log.messages.size()); ++i) {
      const WrittenMessage& message = log.messages[i];
      if (!seen[message.channel]) records += bag_connection(log, message.channel);
      seen[message.channel] = true;
      ++counts[message.channel];
      const auto time = static_cast<std::uint64_t>(message.time_ns / kSecond) |
                        static_cast<std::uint64_t>(message.time_ns % kSecond) << 32U;
      records += bag_record(
          bag_fields(
              {{"op", "\x02"}, {"conn", bag_number(message.channel, 4)}, {"time", bag_number(time, 8)}}),
          message.bytes);
    }
    chunks += bag_record(
        bag_fields(
            {{"op", "\x05"}, {"compression", how.compression}, {"size", bag_number(records.size(), 4)}}),
        compressed(how.compression, records));
    chunks +=
        bag_record(bag_fields({{"op", "\x04"}, {"ver", bag_number(1, 4)}, {"conn", bag_number(0, 4)}}), "");
    RosBytes data;
    for (std::size_t id = 0; id < counts.size(); ++id)
      data.put(static_cast<std::uint32_t>(id)).put(counts[id]);
    infos += bag_record(bag_fields({{"op", "\x06"}, {"ver", bag_number(1, 4)}}), data.bytes());
  }
  const std::string head = magic + bag_header(0, 0, 0);
  if (!how.closed) return head + chunks;
  std::string index;
  for (std::size_t id = 0; id < log.channels.size(); ++id) index += bag_connection(log, id);
  return magic + bag_header(head.size() + chunks.size(), log.channels.size(), 0) + chunks + index + infos;
}

// ---- MCAP ----

inline std::string mcap_record(std::uint8_t opcode, const std::string& content) {
  return RosBytes().put(opcode).put(static_cast<std::uint64_t>(content.size())).raw(content).bytes();
}

inline std::string mcap_channels(const WrittenLog& log, const WrittenHow& how) {
  std::string out;
  for (std::size_t id = 0; id < log.channels.size(); ++id) {
    const WrittenChannel& channel = log.channels[id];
    out += mcap_record(3, RosBytes()
                              .put(static_cast<std::uint16_t>(id + 1))
                              .text(channel.type)
                              .text(how.schema)
                              .text(channel.definition)
                              .bytes());
    out += mcap_record(4, RosBytes()
                              .put(static_cast<std::uint16_t>(id))
                              .put(static_cast<std::uint16_t>(id + 1))
                              .text(channel.topic)
                              .text(how.encoding)
                              .put(std::uint32_t{0})
                              .bytes());
  }
  return out;
}

inline std::string mcap_of(const WrittenLog& log, const WrittenHow& how = {}) {
  const std::string magic("\x89MCAP0\r\n", 8);
  std::string file = magic + mcap_record(1, RosBytes().text("").text("test").bytes());
  std::vector<std::uint64_t> counts(log.channels.size());
  for (std::size_t first = 0; first < log.messages.size(); first += how.messages_of_chunk) {
    std::string records = first == 0 ? mcap_channels(log, how) : "";
    for (std::size_t i = first; i < std::min(first + how.messages_of_chunk, log.messages.size()); ++i) {
      const WrittenMessage& message = log.messages[i];
      ++counts[message.channel];
      records += mcap_record(5, RosBytes()
                                    .put(static_cast<std::uint16_t>(message.channel))
                                    .put(static_cast<std::uint32_t>(i))
                                    .put(message.time_ns)
                                    .put(message.time_ns)
                                    .raw(message.bytes)
                                    .bytes());
    }
    if (!how.chunked) {
      file += records;
      continue;
    }
    const std::string packed = compressed(how.compression, records);
    const std::uint32_t crc = logs::crc32_of(std::as_bytes(std::span(records)));
    file += mcap_record(6, RosBytes()
                               .put(std::int64_t{0})
                               .put(std::int64_t{0})
                               .put(static_cast<std::uint64_t>(records.size()))
                               .put(crc)
                               .text(how.compression == "none" ? "" : how.compression)
                               .put(static_cast<std::uint64_t>(packed.size()))
                               .raw(packed)
                               .bytes());
  }
  if (!how.closed) return file;
  file += mcap_record(15, RosBytes().put(std::uint32_t{0}).bytes());
  const std::uint64_t summary = file.size();
  RosBytes statistics;
  statistics.put(static_cast<std::uint64_t>(log.messages.size())).put(std::uint16_t{1}).put(std::uint32_t{1});
  statistics.put(std::uint32_t{0})
      .put(std::uint32_t{0})
      .put(std::uint32_t{0})
      .put(std::int64_t{0})
      .put(std::int64_t{0});
  statistics.put(static_cast<std::uint32_t>(10 * counts.size()));
  for (std::size_t id = 0; id < counts.size(); ++id)
    statistics.put(static_cast<std::uint16_t>(id)).put(counts[id]);
  file += mcap_channels(log, how) + mcap_record(11, statistics.bytes());
  file += mcap_record(2, RosBytes().put(summary).put(std::uint64_t{0}).put(std::uint32_t{0}).bytes());
  return file + magic;
}

// ---- rosbag2 ----

/// Leaves the database open where `crash` is given: what is not in the file yet is in that beside it.
inline sqlite3* write_sqlite_bag(const std::string& path, const WrittenLog& log,
                                 const std::string& compression = "none", bool crash = false,
                                 bool with_definitions = false, std::size_t page_size = 512) {
  sqlite3* database = nullptr;
  sqlite3_open(path.c_str(), &database);
  const auto run = [&](const std::string& sql) {
    sqlite3_exec(database, sql.c_str(), nullptr, nullptr, nullptr);
  };
  run("PRAGMA page_size=" + std::to_string(page_size));  // 512: a small file has many
  if (crash) run("PRAGMA journal_mode=WAL; PRAGMA wal_autocheckpoint=0;");
  run("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, "
      "serialization_format TEXT "
      "NOT NULL, offered_qos_profiles TEXT NOT NULL)");
  run("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, "
      "data BLOB "
      "NOT NULL); CREATE INDEX timestamp_idx ON messages (timestamp ASC)");
  if (with_definitions)
    run("CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL, encoding TEXT "
        "NOT NULL, "
        "encoded_message_definition TEXT NOT NULL, type_description_hash TEXT NOT NULL)");
  for (std::size_t id = 0; id < log.channels.size(); ++id) {
    const WrittenChannel& channel = log.channels[id];
    run("INSERT INTO topics VALUES (" + std::to_string(id + 1) + ", '" + channel.topic + "', '" +
        channel.type + "', 'cdr', '')");
    if (with_definitions)
      run("INSERT INTO message_definitions VALUES (NULL, '" + channel.type + "', 'ros2msg', '" +
          channel.definition + "', '')");
  }
  run("BEGIN");
  for (const WrittenMessage& message : log.messages) {
    sqlite3_stmt* insert = nullptr;
    sqlite3_prepare_v2(database, "INSERT INTO messages VALUES (NULL, ?, ?, ?)", -1, &insert, nullptr);
    const std::string data = compressed(compression, message.bytes);
    sqlite3_bind_int64(insert, 1, message.channel + 1);
    sqlite3_bind_int64(insert, 2, message.time_ns);
    sqlite3_bind_blob(insert, 3, data.data(), static_cast<int>(data.size()), SQLITE_TRANSIENT);
    sqlite3_step(insert);
    sqlite3_finalize(insert);
  }
  run("COMMIT");
  if (crash) return database;
  sqlite3_close(database);
  return nullptr;
}

}  // namespace trundle::test
