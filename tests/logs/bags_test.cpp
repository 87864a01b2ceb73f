#include <filesystem>
#include <limits>
#include <set>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/io/error.hpp"
#include "trundle/io/file.hpp"
#include "trundle/logs/definitions.hpp"
#include "trundle/logs/field_reader.hpp"

#include "../real_data.hpp"
#include "../recording/folder.hpp"
#include "packed_writers.hpp"
#include "read_log.hpp"
#include "ros_writers.hpp"

namespace trundle::test {
namespace {

using namespace logs;
using testing::HasSubstr;
namespace fs = std::filesystem;

/// Two topics, whose messages count up.
WrittenLog counting_log(std::size_t messages, bool cdr = false) {
  WrittenLog log{.channels = {{"/counts", cdr ? "a/msg/Count" : "a/Count", "int32 count\n"},
                              {"/name", cdr ? "std_msgs/msg/String" : "std_msgs/String", "string data\n"}},
                 .messages = {}};
  for (std::size_t i = 0; i < messages; ++i) {
    const auto count = static_cast<std::int32_t>(i);
    const std::string name = fmt::format("message {}", i);
    const bool is_name = i % 3 == 2;
    const std::string bytes = cdr ? (is_name ? CdrBytes().text(name) : CdrBytes().put(count)).bytes()
                                  : (is_name ? RosBytes().text(name) : RosBytes().put(count)).bytes();
    log.messages.push_back(
        {is_name ? 1U : 0U, 1'700'000'000'123'456'789 + static_cast<std::int64_t>(i), bytes});
  }
  return log;
}

struct WhatCame {
  std::vector<std::string> lines;
  std::optional<Cut> cut;
};

WhatCame read_bag(const fs::path& path, const Limits& limits = {}) {
  WhatCame came;
  const auto log = open_log(path, limits);
  while (const auto message = log->next()) {
    std::string line = fmt::format("{} {}", message->channel->topic, message->log_time_ns);
    const bool is_whole = visit(layout_of(*message->channel), message->channel->encoding, message->bytes,
                                [&](std::string_view name, const Value& value) {
                                  if (const auto* const text = std::get_if<std::string_view>(&value))
                                    line += fmt::format(" {}={}", name, *text);
                                  else
                                    line += fmt::format(" {}={}", name, number_of(value).value());
                                });
    came.lines.push_back(is_whole ? line : line + " broken");
  }
  came.cut = log->cut();
  return came;
}

std::vector<std::string> lines_of(const WrittenLog& log) {
  std::vector<std::string> lines;
  for (std::size_t i = 0; i < log.messages.size(); ++i)
    lines.push_back(i % 3 == 2 ? fmt::format("/name {} data=message {}", log.messages[i].time_ns, i)
                               : fmt::format("/counts {} count={}", log.messages[i].time_ns, i));
  return lines;
}

struct BagKind {
  std::string name;
  bool is_mcap;
  WrittenHow how;

  std::string file(const WrittenLog& log) const { return is_mcap ? mcap_of(log, how) : bag_of(log, how); }
  bool is_cdr() const { return how.encoding == "cdr"; }
};

std::vector<BagKind> bag_kinds() {
  std::vector<BagKind> kinds;
  for (const bool closed : {true, false}) {
    const std::string end = closed ? "" : "_not_closed";
    for (const char* const compression : {"none", "bz2", "lz4"})
      kinds.push_back(
          {fmt::format("bag_{}{}", compression, end), false, {.compression = compression, .closed = closed}});
    for (const char* const compression : {"none", "lz4", "zstd"})
      kinds.push_back(
          {fmt::format("mcap_{}{}", compression, end),
           true,
           {.compression = compression, .closed = closed, .schema = "ros2msg", .encoding = "cdr"}});
    kinds.push_back({fmt::format("mcap_unchunked{}", end), true, {.chunked = false, .closed = closed}});
  }
  return kinds;
}

class EveryBag : public testing::TestWithParam<BagKind> {};

TEST_P(EveryBag, gives_every_message) {
  const Folder folder;
  const WrittenLog log = counting_log(10, GetParam().is_cdr());
  const fs::path path = folder.write("log", GetParam().file(log));
  const WhatCame came = read_bag(path);
  EXPECT_EQ(came.lines, lines_of(log));
  EXPECT_EQ(came.cut.has_value(), !GetParam().how.closed);
  EXPECT_THAT(came.cut ? came.cut->reason : "not closed", HasSubstr("not closed"));
  const auto opened = open_log(path);
  EXPECT_EQ(opened->channels().size(), GetParam().how.closed ? 2U : 0U);
  if (!GetParam().how.closed) return;
  EXPECT_EQ(opened->channels()[1]->messages, 3U);
}

TEST_P(EveryBag, cut_off_anywhere_gives_the_messages_before_and_says_so) {
  const Folder folder;
  const WrittenLog log = counting_log(7, GetParam().is_cdr());
  const std::string whole = GetParam().file(log);
  const std::vector<std::string> lines = lines_of(log);
  std::set<std::size_t> counts;
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const fs::path path = folder.write("log", whole.substr(0, size));
    try {
      const WhatCame came = read_bag(path);
      ASSERT_LE(came.lines.size(), lines.size()) << size;
      ASSERT_TRUE(std::equal(came.lines.begin(), came.lines.end(), lines.begin())) << size;
      const bool is_all = came.lines.size() == lines.size();  // then the index alone may be cut
      ASSERT_TRUE(came.cut || is_all) << size;
      counts.insert(came.lines.size());
    } catch (const InputError&) {
      ASSERT_LT(size, 300U);  // within the head
    }
  }
  EXPECT_GE(counts.size(), 3U);  // chunks that are whole are used, of others what can be
  EXPECT_LT(peak_memory_mb(), kMostMemory_mb);
}

TEST_P(EveryBag, damaged_anywhere_ends_in_order) {
  const Folder folder;
  const std::string whole = GetParam().file(counting_log(4, GetParam().is_cdr()));
  for (std::size_t at = 0; at < whole.size(); ++at)
    for (const char value : {'\0', '\xff', '\x7f'}) {
      std::string damaged = whole;
      damaged[at] = value;
      const fs::path path = folder.write("log", damaged);
      try {
        (void)read_bag(path);
      } catch (const InputError&) {
      } catch (const BadDefinition&) {
      }
    }
}

INSTANTIATE_TEST_SUITE_P(Logs, EveryBag, testing::ValuesIn(bag_kinds()),
                         [](const auto& of) { return of.param.name; });

TEST(Bags, messages_of_another_encoding_than_ROS_has_are_said_to_be_it) {
  const Folder folder;
  const fs::path path =
      folder.write("log", mcap_of(counting_log(3), {.schema = "protobuf", .encoding = "protobuf"}));
  try {
    (void)read_bag(path);
    FAIL() << "it was read";
  } catch (const BadDefinition& error) {
    EXPECT_THAT(error.what(), HasSubstr("encoded as 'protobuf'"));
  }
}

TEST(Bags, a_wrong_checksum_ends_a_log_of_mcap) {
  const Folder folder;
  std::string file = mcap_of(counting_log(6, true), {.schema = "ros2msg", .encoding = "cdr"});
  file[file.find("message 5") + 8] = '7';
  const WhatCame came = read_bag(folder.write("log", file));
  EXPECT_EQ(came.lines.size(), 3U);
  ASSERT_TRUE(came.cut);
  EXPECT_THAT(came.cut->reason, HasSubstr("checksum"));
}

TEST(Bags, a_chunk_that_becomes_too_much_is_refused) {
  const Folder folder;
  WrittenLog log = counting_log(2);
  log.messages[1].bytes = RosBytes().put(std::int32_t{1}).raw(std::string(100'000, 'x')).bytes();
  for (const char* const compression : {"bz2", "lz4"}) {
    const fs::path path = folder.write("log", bag_of(log, {.compression = compression}));
    const WhatCame came = read_bag(path, {.largest_chunk = 50'000});
    EXPECT_TRUE(came.lines.empty());
    ASSERT_TRUE(came.cut);
    EXPECT_THAT(came.cut->reason, HasSubstr("bytes, 1"));
  }
}

TEST(Bags, more_than_a_chunk_announces_is_not_decompressed) {
  const Folder folder;
  std::string records(1 << 20, '\0');
  for (const char* const compression : {"bz2", "lz4"}) {
    const std::string chunk =
        bag_record(bag_fields({{"op", "\x05"}, {"compression", compression}, {"size", bag_number(64, 4)}}),
                   compressed(compression, records));
    const WhatCame came = read_bag(folder.write("log", "#ROSBAG V2.0\n" + bag_header(0, 0, 1) + chunk));
    EXPECT_TRUE(came.lines.empty());
    EXPECT_TRUE(came.cut);
  }
}

TEST(Bags, definitions_that_are_large_together_are_refused) {
  const Folder folder;
  WrittenLog log{.channels = {}, .messages = {{0, 1, RosBytes().put(std::int32_t{1}).bytes()}}};
  const std::string large = "int32 count\n" + std::string(10'000, '#');
  for (int i = 0; i < 100; ++i)
    log.channels.push_back({fmt::format("/t{}", i), fmt::format("a/T{}", i), large});
  for (const std::string& file : {bag_of(log), mcap_of(log), mcap_of(log, {.chunked = false})}) {
    const fs::path path = folder.write("log", file);
    EXPECT_EQ(open_log(path)->channels().size(), 100U);
    const auto log_within = open_log(path, {.all_definitions = 500'000});
    while (log_within->next()) continue;
    EXPECT_LT(log_within->channels().size(), 50U);
  }
}

/// Differences of such times would be beyond 64 bits.
TEST(Bags, a_time_that_is_none_ends_a_log) {
  const Folder folder;
  WrittenLog log = counting_log(6, true);
  log.messages[4].time_ns = std::numeric_limits<std::int64_t>::min() + 7;
  const WrittenHow how{.schema = "ros2msg", .encoding = "cdr"};
  write_sqlite_bag(folder / "log.db3", log, "none", false, true);
  for (const fs::path& path : {folder.write("log.mcap", mcap_of(log, how)), folder / "log.db3"}) {
    const WhatCame came = read_bag(path);
    EXPECT_EQ(came.lines.size(), 4U) << path;
    ASSERT_TRUE(came.cut) << path;
    EXPECT_EQ(came.cut->reason, "the time of a message is no time");
  }
}

// ---- rosbag2 ----

TEST(SqliteBag, gives_every_message_with_and_without_definitions) {
  const Folder folder;
  const WrittenLog log = counting_log(10, true);
  write_sqlite_bag(folder / "log.db3", log, "none", false, true);
  EXPECT_EQ(read_bag(folder / "log.db3").lines, lines_of(log));
  write_sqlite_bag(folder / "packed.db3", log, "zstd", false, true);
  EXPECT_EQ(read_bag(folder / "packed.db3").lines, lines_of(log));
  write_sqlite_bag(folder / "bare.db3", log);
  EXPECT_THROW(read_bag(folder / "bare.db3"), BadDefinition);  // of a/Count; std_msgs are built in
}

TEST(SqliteBag, what_a_crash_left_is_read_and_nothing_is_changed) {
  const Folder folder;
  const WrittenLog log = counting_log(10, true);
  sqlite3* const open = write_sqlite_bag(folder / "live.db3", log, "none", true, true);
  fs::copy_file(folder / "live.db3", folder / "crashed.db3");
  fs::copy_file(folder / "live.db3-wal", folder / "crashed.db3-wal");
  sqlite3_close(open);
  const auto before = fs::file_size(folder / "crashed.db3-wal");
  EXPECT_EQ(read_bag(folder / "crashed.db3").lines, lines_of(log));
  EXPECT_EQ(fs::file_size(folder / "crashed.db3-wal"), before);
  EXPECT_FALSE(fs::exists(folder / "crashed.db3-shm"));
}

/// A bag as rosbag2 writes it, in one of the ways that it compresses.
std::string sqlite_file(const Folder& folder, const WrittenLog& log, const std::string& how) {
  write_sqlite_bag(folder / "whole.db3", log, how == "message" ? "zstd" : "none", false, true);
  std::string whole = read_file(folder / "whole.db3");
  return how == "file" ? compressed("zstd", whole) : whole;
}

class EverySqliteBag : public testing::TestWithParam<const char*> {};

TEST_P(EverySqliteBag, cut_off_anywhere_gives_messages_from_the_front_and_says_so) {
  const Folder folder;
  // A file that is compressed as a whole is in blocks, each of 128 KB of what it becomes.
  const bool is_in_blocks = std::string_view(GetParam()) == "file";
  const WrittenLog log = counting_log(is_in_blocks ? 20'000 : 40, true);
  const std::vector<std::string> lines = lines_of(log);
  const std::string whole = sqlite_file(folder, log, GetParam());
  EXPECT_EQ(read_bag(folder.write("log", whole)).lines, lines);
  std::set<std::size_t> counts;
  std::size_t refused = 0;  // the first bytes that are enough for the tables
  for (std::size_t size = 0; size < whole.size(); size += is_in_blocks ? whole.size() / 15 : 1) {
    const fs::path path = folder.write("log", whole.substr(0, size));
    try {
      const WhatCame came = read_bag(path);
      ASSERT_LE(came.lines.size(), lines.size()) << size;
      ASSERT_TRUE(std::equal(came.lines.begin(), came.lines.end(), lines.begin())) << size;
      ASSERT_TRUE(came.cut) << size;
      ASSERT_TRUE(counts.empty() || came.lines.size() >= *counts.rbegin()) << size;
      counts.insert(came.lines.size());
    } catch (const InputError&) {
      ASSERT_TRUE(counts.empty()) << size;
      refused = size;
    }
  }
  EXPECT_LT(refused, whole.size() / 2);
  EXPECT_GE(counts.size(), 3U);
  EXPECT_GE(*counts.rbegin(), lines.size() * 3 / 4);
  EXPECT_LT(peak_memory_mb(), kMostMemory_mb);
}

TEST_P(EverySqliteBag, damaged_anywhere_ends_in_order) {
  const Folder folder;
  const std::string whole = sqlite_file(folder, counting_log(10, true), GetParam());
  for (std::size_t at = 0; at < whole.size(); ++at) {
    std::string damaged = whole;
    damaged[at] = '\xff';
    try {
      (void)read_bag(folder.write("log", damaged));
    } catch (const InputError&) {
    } catch (const BadDefinition&) {
    }
  }
  EXPECT_LT(peak_memory_mb(), kMostMemory_mb);
}

INSTANTIATE_TEST_SUITE_P(Logs, EverySqliteBag, testing::Values("none", "message", "file"),
                         [](const auto& of) { return std::string(of.param); });

/// The files of a folder, one of which is cut.
TEST(SqliteBag, a_folder_whose_last_file_is_cut_gives_what_comes_before) {
  const Folder folder;
  const WrittenLog log = counting_log(40, true);
  write_sqlite_bag(folder / "log_0.db3", log, "none", false, true);
  const std::string whole = read_file(folder / "log_0.db3");
  folder.write("metadata.yaml",
               "rosbag2_bagfile_information:\n  relative_file_paths:\n    - log_0.db3\n    - log_1.db3\n");
  constexpr std::size_t kStep = 61;  // a prime: all places in a page are met
  for (std::size_t size = 0; size < whole.size(); size += kStep) {
    folder.write("log_1.db3", whole.substr(0, size));
    const WhatCame came = read_bag(folder.path());
    ASSERT_GE(came.lines.size(), 40U) << size;
    ASSERT_TRUE(came.cut) << size;
  }
  folder.write("log_1.db3", whole.substr(0, 300));
  EXPECT_THAT(read_bag(folder.path()).cut->reason, HasSubstr("its last file is left out: "));
  folder.write("log_1.db3", whole);
  folder.write("log_0.db3", whole.substr(0, 300));  // of those before every one is needed
  EXPECT_THROW(read_bag(folder.path()), InputError);
  fs::remove(folder / "log_1.db3");
  folder.write("log_0.db3", whole);
  EXPECT_THROW(read_bag(folder.path()), InputError);  // missing, not cut
}

// ---- What asks for too much ----

TEST(SqliteBag, what_becomes_too_much_is_refused) {
  const Folder folder;
  write_sqlite_bag(folder / "log.db3", counting_log(3, true), "none", false, true);
  const fs::path packed = folder.write("log.db3.zstd", compressed("zstd", read_file(folder / "log.db3")));
  EXPECT_EQ(read_bag(packed).lines.size(), 3U);
  EXPECT_THROW(read_bag(packed, {.largest_database = 1000}), InputError);
  WrittenLog large = counting_log(2, true);
  large.messages[1].bytes = CdrBytes().put(std::int32_t{1}).bytes() + std::string(1 << 20, '\0');
  write_sqlite_bag(folder / "large.db3", large, "zstd", false, true);
  EXPECT_EQ(read_bag(folder / "large.db3").lines.size(), 2U);
  const WhatCame came = read_bag(folder / "large.db3", {.largest_message = 1000});
  EXPECT_EQ(came.lines.size(), 1U);
  EXPECT_TRUE(came.cut);
}

TEST(Bags, a_chunk_of_mcap_that_becomes_too_much_is_not_decompressed) {
  const Folder folder;
  const std::string records(1 << 20, '\0');
  for (const char* const compression : {"lz4", "zstd"})
    for (const bool announces : {false, true}) {
      const std::string packed = compressed(compression, records);
      const std::uint64_t size = announces ? records.size() : 64;
      const std::string chunk = mcap_record(6, RosBytes()
                                                   .put(std::uint64_t{0})
                                                   .put(std::uint64_t{0})
                                                   .put(size)
                                                   .put(std::uint32_t{0})
                                                   .text(compression)
                                                   .put(static_cast<std::uint64_t>(packed.size()))
                                                   .raw(packed)
                                                   .bytes());
      const fs::path path = folder.write("log", std::string("\x89MCAP0\r\n", 8) + chunk);
      const WhatCame came =
          read_bag(path, {.largest_chunk = announces ? std::size_t{1} << 19 : std::size_t{1} << 22});
      EXPECT_TRUE(came.lines.empty());
      ASSERT_TRUE(came.cut);
      if (announces) {
        EXPECT_THAT(came.cut->reason, HasSubstr("once they are decompressed"));
      }
    }
  EXPECT_LT(peak_memory_mb(), kMostMemory_mb);
}

TEST(Bags, a_message_beyond_the_limit_ends_a_log) {
  const Folder folder;
  WrittenLog log = counting_log(3);
  log.messages[1].bytes = RosBytes().put(std::int32_t{1}).raw(std::string(5000, 'x')).bytes();
  for (const std::string& file : {bag_of(log), mcap_of(log, {.chunked = false})}) {
    const WhatCame came = read_bag(folder.write("log", file), {.largest_message = 1000});
    EXPECT_EQ(came.lines.size(), 1U);
    ASSERT_TRUE(came.cut);
    EXPECT_THAT(came.cut->reason, HasSubstr("a message has 50"));
  }
}

TEST(SqliteBag, folders_and_compressed_files_are_read_as_one) {
  const Folder folder;
  WrittenLog log = counting_log(6, true);
  const WrittenLog whole = log;
  log.messages.erase(log.messages.begin() + 3, log.messages.end());
  write_sqlite_bag(folder / "log_0.db3", log, "none", false, true);
  log = whole;
  log.messages.erase(log.messages.begin(), log.messages.begin() + 3);
  write_sqlite_bag(folder / "log_1.db3", log, "none", false, true);
  std::string second(fs::file_size(folder / "log_1.db3"), '\0');
  std::ifstream(folder / "log_1.db3", std::ios::binary)
      .read(second.data(), static_cast<std::streamsize>(second.size()));
  fs::remove(folder / "log_1.db3");
  folder.write("log_1.db3.zstd", compressed("zstd", second));
  folder.write(
      "metadata.yaml",
      "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: sqlite3\n  relative_file_paths:\n"
      "    - log_0.db3\n    - \"log_1.db3\"\n  duration:\n    nanoseconds: 0\n");
  ASSERT_TRUE(is_log(folder.path()));
  const auto opened = open_log(folder.path());
  EXPECT_EQ(opened->channels().size(), 2U);  // not four
  EXPECT_EQ(read_bag(folder.path()).lines, lines_of(whole));
}

/// rosbag2 writes metadata.yaml at its end: killed, it leaves the files alone, named after their folder.
TEST(Bags, a_folder_that_rosbag2_did_not_finish) {
  const Folder folder;
  const std::string name = folder.path().filename().string();
  WrittenLog log = counting_log(6, true);
  const WrittenLog whole = log;
  log.messages.erase(log.messages.begin() + 3, log.messages.end());
  write_sqlite_bag(folder / (name + "_0.db3"), log, "none", false, true);
  log = whole;
  log.messages.erase(log.messages.begin(), log.messages.begin() + 3);
  write_sqlite_bag(folder / (name + "_1.db3"), log, "none", false, true);
  ASSERT_TRUE(is_log(folder.path()));
  EXPECT_EQ(read_bag(folder.path()).lines, lines_of(whole));
  fs::rename(folder / (name + "_0.db3"), folder / "other_0.db3");
  EXPECT_FALSE(is_log(folder.path()));
  EXPECT_THROW((void)open_log(folder.path()), InputError);
}

TEST(Bags, what_is_none_is_refused) {
  const Folder folder;
  EXPECT_THROW((void)open_log(folder.write("text", "a,b\n1,2\n")), InputError);
  EXPECT_FALSE(is_log(folder / "text"));
  EXPECT_FALSE(is_log(folder / "nothing"));
  EXPECT_THROW((void)open_log(folder / "nothing"), InputError);
  EXPECT_THROW((void)open_log(folder.write("old.bag", "#ROSBAG V1.2\n")), InputError);
  EXPECT_THROW((void)open_log(folder.write("twice.zst", compressed("zstd", compressed("zstd", "text")))),
               InputError);
  folder.write("metadata.yaml", "nothing: here\n");
  EXPECT_THROW((void)open_log(folder.path()), InputError);
}

struct GenuineLog {
  const char* file;
  std::size_t messages;
  std::size_t undecoded;  ///< whose definition is neither in the log nor built in
};

TEST(GenuineLogs, every_message_of_the_bags_is_decoded) {
  TRUNDLE_NEEDS_REAL_DATA("logs");
  for (const GenuineLog& genuine :
       {GenuineLog{"../husky_gps_bag/test1.bag", 16806, 0}, GenuineLog{"drexel_circle.bag", 3887, 0},
        GenuineLog{"gsid_square.bag", 38496, 0}, GenuineLog{"cdr_test_0.mcap", 7, 0},
        GenuineLog{"mobrob_odom_a.mcap", 180, 0}, GenuineLog{"p4_pitch45.mcap", 6234, 0},
        GenuineLog{"rewriter_b_0.mcap", 75, 0}, GenuineLog{"cdr_test_0.db3", 7, 0},
        GenuineLog{"dan_drive_square.db3", 2091, 388}, GenuineLog{"topics_and_services.db3", 13, 6}}) {
    const auto log = open_log(real_data() / "logs" / genuine.file);
    std::size_t messages = 0, undecoded = 0;
    while (const auto message = log->next()) {
      ++messages;
      try {
        undecoded += visit(layout_of(*message->channel), message->channel->encoding, message->bytes,
                           [](std::string_view, const Value&) {})
                         ? 0
                         : 1;
      } catch (const BadDefinition&) {
        ++undecoded;
      }
    }
    EXPECT_EQ(messages, genuine.messages) << genuine.file;
    EXPECT_EQ(undecoded, genuine.undecoded) << genuine.file;
    EXPECT_FALSE(log->cut()) << genuine.file;
  }
}

}  // namespace
}  // namespace trundle::test
