// Databases of rosbag2 that break off or are damaged. SQLite finds no message of them whose page hangs on one
// that is lost; what is lost is told here by where the texts of the messages are in the file.
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <unordered_set>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/io/error.hpp"
#include "trundle/io/file.hpp"

#include "../real_data.hpp"
#include "../recording/folder.hpp"
#include "read_log.hpp"
#include "ros_writers.hpp"

namespace trundle::test {
namespace {

using testing::HasSubstr;
namespace fs = std::filesystem;

std::string text_of_number(std::size_t i, std::size_t length) {
  return fmt::format("<{0:06}{1}{0:06}>", i, std::string(length, static_cast<char>('a' + i % 26)));
}

/// Texts that begin and end with their numbers. One in 25 is too long for a page.
WrittenLog numbered_log(std::size_t messages, std::size_t page_size) {
  WrittenLog log{.channels = {{"/odd", "std_msgs/msg/String", ""}, {"/even", "std_msgs/msg/String", ""}},
                 .messages = {}};
  for (std::size_t i = 0; i < messages; ++i) {
    const std::size_t length = i % 25 == 7 ? 3 * page_size : page_size / 8 + (37 * i) % (page_size / 8);
    log.messages.push_back({static_cast<std::uint32_t>(1 - i % 2),
                            1'700'000'000'000'000'000 + static_cast<std::int64_t>(i) * 1000,
                            CdrBytes().text(text_of_number(i, length)).bytes()});
  }
  return log;
}

/// Where the pages of a message are in the file: from its first byte to the end of the last.
struct PagesOfMessage {
  std::size_t start = 0;
  std::size_t end = 0;
};

/// Of a text, by its two numbers, the last copy of each: as the first leaf becomes too full it moves.
std::vector<PagesOfMessage> places_in(const std::string& file, std::size_t messages, std::size_t page_size) {
  constexpr std::size_t kDigits = 6;
  std::vector<std::size_t> first(messages), last(messages);
  const auto note = [&](std::vector<std::size_t>& places, std::size_t at) {
    const std::string digits = file.substr(at, kDigits);
    if (digits.find_first_not_of("0123456789") == std::string::npos) places.at(std::stoul(digits)) = at;
  };
  for (std::size_t at = file.find_first_of("<>"); at != std::string::npos;
       at = file.find_first_of("<>", at + 1)) {
    if (file[at] == '<') note(first, at + 1);
    if (file[at] == '>') note(last, at - kDigits);
  }
  std::vector<PagesOfMessage> places;
  for (std::size_t i = 0; i < messages; ++i) {
    const std::size_t start = std::min(first[i], last[i]), end = std::max(first[i], last[i]) + kDigits;
    constexpr std::size_t kMostOverflow = 4;  // pages, which may be before the leaf
    places.push_back({(std::max(start / page_size, kMostOverflow) - kMostOverflow) * page_size,
                      (end / page_size + 1) * page_size});
  }
  return places;
}

/// The lines of those messages alone that `is_whole` finds to be in the file.
template <class IsWhole>
std::vector<std::string> lines_where(const std::vector<std::string>& lines,
                                     const std::vector<PagesOfMessage>& places, IsWhole is_whole) {
  std::vector<std::string> kept;
  for (std::size_t i = 0; i < lines.size(); ++i)
    if (is_whole(places[i])) kept.push_back(lines[i]);
  return kept;
}

/// Whether all of `part` are in `whole`, in its order, none twice.
bool is_part_of(const std::vector<std::string>& part, const std::vector<std::string>& whole) {
  auto from = whole.begin();
  for (const std::string& line : part) {
    from = std::find(from, whole.end(), line);
    if (from++ == whole.end()) return false;
  }
  return true;
}

/// Whether all of `needed` are in `lines`; gmock's IsSupersetOf takes minutes for as many.
bool has_all(const std::vector<std::string>& lines, const std::vector<std::string>& needed) {
  const std::unordered_set<std::string> given(lines.begin(), lines.end());
  return std::ranges::all_of(needed, [&](const std::string& line) { return given.contains(line); });
}

void put_big(std::string& bytes, std::size_t at, std::uint32_t number) {
  for (std::size_t i = 0; i < 4; ++i) bytes[at + i] = static_cast<char>(number >> (24 - 8 * i) & 0xffU);
}

/// A database of more than 600 pages. Of pages of 4096 bytes, which rosbag2 has, the first that is named by
/// the root of the messages is behind three quarters of the file.
struct LargeSqliteBag {
  explicit LargeSqliteBag(std::size_t page_bytes) : page_size(page_bytes) {
    const WrittenLog log = numbered_log(3200, page_size);
    write_sqlite_bag(folder / "whole.db3", log, "none", false, false, page_size);
    file = read_file(folder / "whole.db3");
    lines = read_log(file).lines;
    places = places_in(file, log.messages.size(), page_size);
  }
  std::size_t pages() const { return file.size() / page_size; }
  std::size_t share(double of_file) const {
    return static_cast<std::size_t>(of_file * static_cast<double>(file.size()));
  }
  std::vector<std::string> lines_before(std::size_t size) const {
    return lines_where(lines, places, [&](const PagesOfMessage& place) { return place.end <= size; });
  }

  Folder folder;
  std::size_t page_size;
  std::string file;
  std::vector<std::string> lines;
  std::vector<PagesOfMessage> places;
};

class CutSqliteBag : public testing::TestWithParam<std::size_t> {};

TEST_P(CutSqliteBag, gives_every_message_whose_pages_are_before_the_cut) {
  const LargeSqliteBag bag(GetParam());
  ASSERT_GT(bag.pages(), 600U);
  ASSERT_EQ(bag.lines.size(), 3200U);
  std::size_t before = 0;
  for (double share = 0.02; share < 1.0; share += 0.031) {
    const std::size_t size = bag.share(share);
    const LogContent content = read_log(std::string_view(bag.file).substr(0, size));
    ASSERT_TRUE(is_part_of(content.lines, bag.lines)) << share;
    ASSERT_TRUE(has_all(content.lines, bag.lines_before(size))) << share;
    ASSERT_GT(content.lines.size(), before) << share;
    ASSERT_TRUE(content.cut) << share;
    EXPECT_EQ(content.cut->reason, fmt::format("the file breaks off: it holds {} of its {} pages",
                                               size / bag.page_size, bag.pages()));
    before = content.lines.size();
  }
  EXPECT_GT(before, bag.lines.size() * 9 / 10);
  EXPECT_LT(peak_memory_mb(), kMostMemory_mb);
}

TEST_P(CutSqliteBag, compressed_gives_the_messages_of_what_can_be_decompressed) {
  const LargeSqliteBag bag(GetParam());
  const std::string packed = compressed("zstd", bag.file);
  std::size_t before = 0;
  for (const double share : {0.25, 0.5, 0.75, 0.9}) {
    const auto size = static_cast<std::size_t>(share * static_cast<double>(packed.size()));
    const LogContent content = read_log(packed.substr(0, size));
    EXPECT_TRUE(is_part_of(content.lines, bag.lines)) << share;
    // A block of zstd is 128 KB of what it becomes.
    const double least = (share - 0.05) * static_cast<double>(bag.file.size()) - 2.0 * (1 << 17);
    EXPECT_TRUE(has_all(content.lines, bag.lines_before(static_cast<std::size_t>(std::max(least, 0.0)))));
    EXPECT_GT(content.lines.size(), before) << share;
    ASSERT_TRUE(content.cut) << share;
    EXPECT_EQ(content.cut->reason, "the compressed file breaks off");
    before = content.lines.size();
  }
}

/// As a download leaves it that made room for the whole file first.
TEST_P(CutSqliteBag, a_hole_costs_the_messages_in_it) {
  const LargeSqliteBag bag(GetParam());
  const std::size_t start = bag.pages() / 2 * bag.page_size, end = start + 20 * bag.page_size;
  std::string file = bag.file;
  std::fill(file.begin() + static_cast<std::ptrdiff_t>(start),
            file.begin() + static_cast<std::ptrdiff_t>(end), '\0');
  const LogContent content = read_log(file);
  EXPECT_TRUE(is_part_of(content.lines, bag.lines));
  EXPECT_TRUE(has_all(content.lines, lines_where(bag.lines, bag.places, [&](const PagesOfMessage& place) {
                        return place.end <= start || place.start >= end;
                      })));
  EXPECT_LT(content.lines.size(), bag.lines.size());
  ASSERT_TRUE(content.cut);
  EXPECT_THAT(content.cut->reason, HasSubstr("the database is damaged"));
}

TEST_P(CutSqliteBag, a_leaf_that_is_there_twice_is_used_once) {
  LargeSqliteBag bag(GetParam());
  const std::size_t pages = bag.pages();
  for (std::size_t page = 100; page < 120; ++page)
    bag.file += bag.file.substr(page * bag.page_size, bag.page_size);
  put_big(bag.file, 28, static_cast<std::uint32_t>(pages + 21));  // and one that is missing
  EXPECT_EQ(read_log(bag.file).lines, bag.lines);
}

INSTANTIATE_TEST_SUITE_P(Logs, CutSqliteBag, testing::Values(512, 4096),
                         [](const auto& of) { return fmt::format("pages_of_{}", of.param); });

void run_sql(const fs::path& path, const std::string& sql) {
  sqlite3* database = nullptr;
  sqlite3_open(path.c_str(), &database);
  EXPECT_EQ(sqlite3_exec(database, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK) << sql;
  sqlite3_close(database);
}

/// Page at which a table begins.
std::size_t root_in(const fs::path& path, const std::string& table) {
  sqlite3* database = nullptr;
  sqlite3_open(path.c_str(), &database);
  sqlite3_stmt* statement = nullptr;
  const std::string sql = "SELECT rootpage FROM sqlite_master WHERE name = '" + table + "'";
  sqlite3_prepare_v2(database, sql.c_str(), -1, &statement, nullptr);
  EXPECT_EQ(sqlite3_step(statement), SQLITE_ROW);
  const auto page = static_cast<std::size_t>(sqlite3_column_int64(statement, 0));
  sqlite3_finalize(statement);
  sqlite3_close(database);
  return page;
}

TEST(SqliteBagFromPages, what_was_deleted_stays_so_as_long_as_the_free_pages_are_known) {
  LargeSqliteBag bag(512);
  run_sql(bag.folder / "whole.db3",
          "PRAGMA secure_delete = OFF; DELETE FROM messages WHERE id BETWEEN 801 AND 1600");
  std::string file = read_file(bag.folder / "whole.db3");
  ASSERT_NE(file.find("<001200"), std::string::npos);  // its bytes are still there
  file.resize(bag.share(0.9));
  std::vector<std::string> kept = bag.lines_before(file.size());
  std::erase_if(kept, [&](const std::string& line) {
    const auto number = static_cast<std::size_t>(std::ranges::find(bag.lines, line) - bag.lines.begin());
    return number >= 800 && number < 1600;
  });
  const LogContent content = read_log(file);
  EXPECT_TRUE(has_all(content.lines, kept));
  const std::vector<std::string> deleted(bag.lines.begin() + 800, bag.lines.begin() + 1600);
  EXPECT_TRUE(std::ranges::none_of(deleted, [&](const std::string& line) {
    return std::ranges::find(content.lines, line) != content.lines.end();
  }));
  put_big(file, 32, 0);  // first of the free pages
  std::vector<std::string> lines = read_log(file).lines;
  EXPECT_GT(lines.size(), content.lines.size());
  EXPECT_TRUE(has_all(lines, kept));
  for (std::string& line : lines) line.resize(line.find('/'));  // its time
  EXPECT_TRUE(std::ranges::is_sorted(lines));
  EXPECT_EQ(std::ranges::adjacent_find(lines), lines.end());
}

TEST(SqliteBagFromPages, is_refused_without_topics) {
  LargeSqliteBag bag(4096);
  const std::size_t start = (root_in(bag.folder / "whole.db3", "topics") - 1) * bag.page_size;
  std::fill_n(bag.file.begin() + static_cast<std::ptrdiff_t>(start), bag.page_size, '\0');
  for (const std::size_t size : {bag.share(0.5), bag.page_size, bag.page_size / 2}) {
    try {
      (void)read_log(std::string_view(bag.file).substr(0, size));
      FAIL() << "it was read";
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("has no topics that can be read: the file breaks off: it holds"));
    }
  }
}

/// The log as it was first is in the file, which is cut, and the rest in what the crash left beside it.
TEST(SqliteBagFromPages, gives_what_a_crash_left_beside_it_too) {
  const Folder folder;
  const WrittenLog log = numbered_log(400, 512);
  sqlite3* const open = write_sqlite_bag(folder / "live.db3", log, "none", true);
  sqlite3_exec(
      open,
      "PRAGMA wal_checkpoint(TRUNCATE); DELETE FROM messages WHERE id = 1; "
      "INSERT INTO messages SELECT id + 1000, topic_id, timestamp, data FROM messages WHERE id > 300",
      nullptr, nullptr, nullptr);
  fs::copy_file(folder / "live.db3", folder / "crashed.db3");
  fs::copy_file(folder / "live.db3-wal", folder / "crashed.db3-wal");
  sqlite3_close(open);
  const auto lines_of_it = [&] { return content_of(*open_log(folder / "crashed.db3")).lines; };
  const std::vector<std::string> whole = lines_of_it();
  ASSERT_EQ(whole.size(), 499U);
  fs::resize_file(folder / "crashed.db3", fs::file_size(folder / "crashed.db3") / 2);
  const std::vector<std::string> lines = lines_of_it();
  EXPECT_TRUE(is_part_of(lines, whole));
  EXPECT_GT(lines.size(), 220U);
  EXPECT_EQ(lines.back(), whole.back());
}

/// Seven bits a byte, the highest first.
std::string varint(std::uint64_t number) {
  std::string bytes(1, static_cast<char>(number & 0x7fU));
  while (number >>= 7U) bytes.insert(bytes.begin(), static_cast<char>(0x80U | (number & 0x7fU)));
  return bytes;
}

/// A leaf of eight messages, each of 60 MB, whose rest is on a chain of overflow pages.
std::string crafted_leaf(std::uint64_t first_row, std::uint32_t overflow) {
  constexpr std::size_t kPage = 512, kCell = 60, kRows = 8, kLocal = 39;
  constexpr std::size_t kRecord = kLocal + 120'000 * (kPage - 4), kHead = 8, kNumbers = 9;
  std::string page(kPage, '\0');
  page[0] = '\x0d';
  page[4] = kRows;
  for (std::size_t i = 0; i < kRows; ++i) {
    const std::size_t place = kPage - (i + 1) * kCell;
    page[8 + 2 * i] = static_cast<char>(place >> 8U);
    page[9 + 2 * i] = static_cast<char>(place & 0xffU);
    const std::string before = varint(kRecord) + varint(first_row + i);
    const std::string record = std::string("\x08\x00\x01\x06", 4) +
                               varint(2 * (kRecord - kHead - kNumbers) + 12) + '\x01' + std::string(8, '\0');
    page.replace(place, before.size() + record.size(), before + record);
    put_big(page, place + before.size() + kLocal, overflow);
  }
  return page;
}

/// Read to their ends, they would be 144 GB, of a file of 200 KB.
TEST(SqliteBagFromPages, reads_no_more_overflow_pages_than_a_file_has) {
  constexpr std::size_t kPage = 512;
  constexpr std::uint32_t kLeaves = 300;
  const Folder folder;
  write_sqlite_bag(folder / "log.db3", numbered_log(200, kPage));
  std::string file = read_file(folder / "log.db3");
  const std::vector<std::string> lines = read_log(file).lines;
  const auto circle = static_cast<std::uint32_t>(file.size() / kPage + 1);
  file.resize(file.size() + kPage);
  put_big(file, file.size() - kPage, circle);
  for (std::uint32_t i = 0; i < kLeaves; ++i) file += crafted_leaf(100'000 + 8 * i, circle);
  put_big(file, 28, circle + kLeaves + 1);
  const auto start = std::chrono::steady_clock::now();
  EXPECT_EQ(read_log(file).lines, lines);
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
  EXPECT_LT(peak_memory_mb(), kMostMemory_mb);
}

TEST(SqliteBagFromPages, damaged_anywhere_ends_in_order) {
  const Folder folder;
  write_sqlite_bag(folder / "log.db3", numbered_log(12, 512));
  const std::string whole = read_file(folder / "log.db3");
  const std::string cut = whole.substr(0, whole.size() - 512);
  constexpr std::string_view kValues("\xff\x0d\x01\x00", 4);
  constexpr std::size_t kStep = 3;
  for (std::size_t at = 16; at < cut.size(); at += kStep) {
    std::string damaged = cut;
    damaged[at] = kValues[at % 4];
    try {
      (void)read_log(damaged);
    } catch (const InputError&) {
    }
  }
  EXPECT_LT(peak_memory_mb(), kMostMemory_mb);
}

TEST(GenuineLogs, a_database_that_is_cut_gives_what_is_before) {
  TRUNDLE_NEEDS_REAL_DATA("logs/dan_drive_square.db3");
  const std::string whole = read_file(real_data() / "logs" / "dan_drive_square.db3");
  const std::vector<std::string> lines = read_log(whole).lines;
  ASSERT_EQ(lines.size(), 2091U);
  for (const std::string& file : {whole, compressed("zstd", whole)})
    for (const auto& [percent, least] : {std::pair(25U, 20U), std::pair(50U, 45U), std::pair(90U, 85U)}) {
      const LogContent content = read_log(file.substr(0, file.size() * percent / 100));
      EXPECT_GE(100 * content.lines.size(), least * lines.size()) << percent;
      EXPECT_TRUE(is_part_of(content.lines, lines)) << percent;
      EXPECT_TRUE(content.cut) << percent;
    }
}

}  // namespace
}  // namespace trundle::test
