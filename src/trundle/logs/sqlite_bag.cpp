#include <map>

#include <fmt/format.h>
#include <sqlite3.h>

#include "trundle/io/error.hpp"
#include "trundle/logs/detail/byte_cursor.hpp"
#include "trundle/logs/detail/file_window.hpp"
#include "trundle/logs/detail/formats.hpp"
#include "trundle/logs/detail/inflater.hpp"
#include "trundle/logs/detail/temporary_folder.hpp"

namespace trundle::logs {
namespace {

namespace fs = std::filesystem;

// rosbag2_storage_sqlite3: tables `topics` and `messages`, since Iron `message_definitions`, too.

/// What a crash left beside a database, of which it is a part until somebody opens it to write.
std::vector<fs::path> leftovers_of(const fs::path& path) {
  std::vector<fs::path> found;
  for (const char* const ending : {"-wal", "-journal"}) {
    const fs::path beside = path.string() + ending;
    std::error_code error;
    if (fs::is_regular_file(beside, error) && fs::file_size(beside, error) > 0) found.push_back(beside);
  }
  return found;
}

/// How many pages a database has, by its head, and how many of them the file holds whole.
struct Pages {
  std::uint64_t size = 0;  ///< of one [bytes]; 0: the head says none
  std::uint64_t announced = 0;
  std::uint64_t whole = 0;
  bool breaks_off_within = false;  ///< one of them

  [[nodiscard]] bool is_cut() const { return whole < announced || breaks_off_within; }
};

/// As its header says.
Pages pages_of(const fs::path& path) {
  // https://www.sqlite.org/fileformat.html#the_database_header: 100 bytes. The number of pages at 28 is right
  // where the counters of changes, at 24, and of the change it is valid for, at 92, are the same.
  constexpr std::size_t kHead = 100, kSizeAt = 16, kCountAt = 28, kChangesAt = 24, kValidForAt = 92;
  FileWindow file(path);
  const std::span<const std::byte> head = file.peek(kHead);
  Pages pages;
  if (head.size() < kHead) return pages;
  const auto number = [&](std::size_t at, std::size_t bytes) {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < bytes; ++i)
      value = value << 8U | std::to_integer<std::uint64_t>(head[at + i]);
    return value;
  };
  pages.size = number(kSizeAt, 2);
  if (pages.size == 1) pages.size = 1 << 16;
  if (pages.size == 0) return pages;
  if (number(kChangesAt, 4) == number(kValidForAt, 4)) pages.announced = number(kCountAt, 4);
  pages.whole = file.size() / pages.size;
  pages.breaks_off_within = file.size() % pages.size != 0;
  return pages;
}

class Statement {
 public:
  Statement(sqlite3* database, const std::string& sql) {
    sqlite3_prepare_v2(database, sql.c_str(), -1, &statement_, nullptr);
  }
  ~Statement() { sqlite3_finalize(statement_); }
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  /// SQLITE_ROW, SQLITE_DONE, or what went wrong.
  int step() { return statement_ == nullptr ? SQLITE_ERROR : sqlite3_step(statement_); }
  std::int64_t integer(int column) { return sqlite3_column_int64(statement_, column); }
  std::span<const std::byte> bytes(int column) {
    const auto* const data = static_cast<const std::byte*>(sqlite3_column_blob(statement_, column));
    const int size = sqlite3_column_bytes(statement_, column);
    return data == nullptr ? std::span<const std::byte>() : std::span(data, static_cast<std::size_t>(size));
  }
  std::string text(int column) { return std::string(text_of(bytes(column))); }

 private:
  sqlite3_stmt* statement_ = nullptr;
};

class Database {
 public:
  /// Nothing is written beside it: a database that was closed is opened as one that nobody changes, another
  /// is recovered in a copy.
  Database(const fs::path& path, const Limits& limits) : path_(path), pages_(pages_of(path)) {
    const std::vector<fs::path> leftovers = leftovers_of(path);
    if (!leftovers.empty()) {
      pages_ = {};  // of those that it lacks some stand beside it
      open_copy(path, leftovers, limits);
    } else if (pages_.breaks_off_within) {
      open_whole_pages(limits);
    } else {
      open("file:" + escaped(path) + "?immutable=1", SQLITE_OPEN_READONLY);
    }
    // Without it a database that lacks pages is refused as a whole; with it those are missing that are not
    // there.
    if (pages_.is_cut()) sqlite3_exec(database_, "PRAGMA writable_schema = ON", nullptr, nullptr, nullptr);
    sqlite3_limit(database_, SQLITE_LIMIT_LENGTH,
                  static_cast<int>(std::min<std::size_t>(limits.largest_message, std::size_t{1} << 30)));
    sqlite3_db_config(database_, SQLITE_DBCONFIG_DEFENSIVE, pages_.is_cut() ? 0 : 1, nullptr);
    sqlite3_db_config(database_, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  }
  ~Database() { sqlite3_close(database_); }
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  sqlite3* get() const { return database_; }
  std::string fault() const { return sqlite3_errmsg(database_); }
  const Pages& pages() const { return pages_; }
  /// A table, no view that computes its rows.
  bool has_table(const std::string& name) const {
    Statement found(database_, "SELECT 1 FROM sqlite_master WHERE type = 'table' AND name = '" + name + "'");
    return found.step() == SQLITE_ROW;
  }

 private:
  static std::string escaped(const fs::path& path) {
    std::string text;
    for (const char c : fs::absolute(path).string())
      text += c == '%' || c == '?' || c == '#' ? fmt::format("%{:02x}", static_cast<unsigned>(c))
                                               : std::string(1, c);
    return text;
  }

  void open_copy(const fs::path& path, const std::vector<fs::path>& leftovers, const Limits& limits) {
    if (fs::file_size(path) > limits.largest_database)
      throw InputError(path.string(), "was not closed, and is too large for a copy", "a bag that was closed");
    copy_ = std::make_unique<TemporaryFolder>();
    const fs::path copy = copy_->path() / "bag.db3";
    fs::copy_file(path, copy);
    for (const fs::path& beside : leftovers)
      fs::copy_file(beside, copy.string() + beside.string().substr(path.string().size()));
    open("file:" + escaped(copy), SQLITE_OPEN_READWRITE);
  }

  /// SQLite takes the rest of a page that breaks off for zeros, and so rows for others than they were.
  void open_whole_pages(const Limits& limits) {
    const std::uint64_t size = pages_.whole * pages_.size;
    if (size > limits.largest_database)
      throw InputError(path_.string(), "breaks off, and is too large for a copy", "a bag that was closed");
    copy_ = std::make_unique<TemporaryFolder>();
    const fs::path copy = copy_->path() / "bag.db3";
    fs::copy_file(path_, copy);
    fs::resize_file(copy, size);
    open("file:" + escaped(copy) + "?immutable=1", SQLITE_OPEN_READONLY);
  }

  void open(const std::string& uri, int flags) {
    const int status =
        sqlite3_open_v2(uri.c_str(), &database_, flags | SQLITE_OPEN_URI | SQLITE_OPEN_NOMUTEX, nullptr);
    if (database_ == nullptr) throw std::bad_alloc();
    if (status == SQLITE_OK) return;
    const std::string reason = fault();
    sqlite3_close(database_);
    throw InputError(path_.string(), "cannot be opened: " + reason, "a database of rosbag2");
  }

  fs::path path_;
  Pages pages_;
  std::unique_ptr<TemporaryFolder> copy_;
  sqlite3* database_ = nullptr;
};

class SqliteBag : public Log {
 public:
  SqliteBag(const fs::path& path, const Limits& limits)
      : path_(path), limits_(limits), database_(path, limits) {
    if (!database_.has_table("topics") || !database_.has_table("messages"))
      throw InputError(path.string(), "is a database without the tables topics and messages",
                       "a bag of rosbag2");
    const Definitions definitions = read_definitions();
    read_topics(definitions);
    messages_.emplace(database_.get(), "SELECT topic_id, timestamp, data FROM messages ORDER BY id");
  }

  std::string_view format() const override { return "rosbag2 (SQLite)"; }
  std::span<const Channel* const> channels() const override { return channels_.all(); }
  const std::optional<Cut>& cut() const override { return cut_; }

  std::optional<Message> next() override {
    if (cut_ || is_at_end_) return std::nullopt;
    const int status = messages_->step();
    if (status != SQLITE_ROW) {
      is_at_end_ = true;
      if (database_.pages().is_cut())
        end(fmt::format("the file breaks off: it holds {} of its {} pages", database_.pages().whole,
                        database_.pages().announced));
      else if (status != SQLITE_DONE)
        end(fmt::format("the database cannot be read on: {}", database_.fault()));
      return std::nullopt;
    }
    const auto found = by_id_.find(messages_->integer(0));
    if (found == by_id_.end()) {
      end("a message is of no topic");
      return std::nullopt;
    }
    const std::int64_t time_ns = messages_->integer(1);
    if (time_ns < 0 || time_ns > kLatestTime_ns) {
      end("the time of a message is no time");
      return std::nullopt;
    }
    const std::span<const std::byte> bytes = plain(messages_->bytes(2));
    if (cut_) return std::nullopt;
    return Message{found->second, time_ns, bytes};
  }

 private:
  struct Definition {
    SchemaLanguage language = SchemaLanguage::none;
    std::string text;
  };
  using Definitions = std::map<std::string, Definition>;

  void end(std::string reason) { cut_ = Cut{path_.string(), 0, std::move(reason)}; }

  Definitions read_definitions() {
    Definitions definitions;
    if (!database_.has_table("message_definitions")) return definitions;
    Statement rows(database_.get(),
                   "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions");
    while (rows.step() == SQLITE_ROW && definitions.size() < limits_.most_channels) {
      const std::string encoding = rows.text(1);
      const std::size_t size = rows.bytes(2).size();
      if (size > limits_.largest_definition || !channels_.takes(size, limits_)) continue;
      if (encoding == "ros2msg") definitions[rows.text(0)] = {SchemaLanguage::ros2msg, rows.text(2)};
      if (encoding == "ros2idl") definitions[rows.text(0)] = {SchemaLanguage::ros2idl, rows.text(2)};
    }
    return definitions;
  }

  void read_topics(const Definitions& definitions) {
    Statement rows(database_.get(), "SELECT id, name, type, serialization_format FROM topics ORDER BY id");
    int status = SQLITE_ROW;
    while ((status = rows.step()) == SQLITE_ROW) {
      const std::int64_t id = rows.integer(0);
      Channel channel{.id = static_cast<std::uint32_t>(id), .topic = rows.text(1), .type = rows.text(2)};
      if (rows.text(3) == "cdr")
        channel.encoding = Encoding::cdr;
      else
        channel.unreadable = "its messages are not encoded as cdr";
      if (const auto found = definitions.find(channel.type); found != definitions.end()) {
        channel.language = found->second.language;
        channel.definition = found->second.text;
      }
      if (!channels_.takes(channel.topic.size() + channel.type.size() + channel.definition.size(), limits_))
        break;
      by_id_[id] = &channels_.add(std::move(channel));
    }
    if (status == SQLITE_ERROR || status == SQLITE_CORRUPT || status == SQLITE_NOTADB)
      throw InputError(path_.string(), "has no topics that can be read: " + database_.fault(),
                       "a bag of rosbag2");
  }

  /// A message that was compressed by itself (compression_mode: MESSAGE). CDR never starts as zstd does.
  std::span<const std::byte> plain(std::span<const std::byte> bytes) {
    constexpr std::string_view kZstd = "\x28\xb5\x2f\xfd";
    if (!text_of(bytes).starts_with(kZstd)) return bytes;
    Inflated inflated = inflater_.inflate_frame(bytes, limits_.largest_message);
    if (!inflated.fault.empty()) end(std::move(inflated.fault));
    return inflated.bytes;
  }

  fs::path path_;
  Limits limits_;
  Database database_;
  ChannelList channels_;
  std::map<std::int64_t, Channel*> by_id_;
  std::optional<Statement> messages_;
  Inflater inflater_;
  bool is_at_end_ = false;
  std::optional<Cut> cut_;
};

}  // namespace

std::unique_ptr<Log> open_sqlite_bag(const fs::path& path, const Limits& limits) {
  return std::make_unique<SqliteBag>(path, limits);
}

}  // namespace trundle::logs
