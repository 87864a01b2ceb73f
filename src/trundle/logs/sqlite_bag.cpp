#include <array>
#include <map>

#include <fmt/format.h>
#include <sqlite3.h>

#include "trundle/io/error.hpp"
#include "trundle/logs/detail/byte_cursor.hpp"
#include "trundle/logs/detail/formats.hpp"
#include "trundle/logs/detail/inflater.hpp"
#include "trundle/logs/detail/sqlite_leaves.hpp"
#include "trundle/logs/detail/temporary_folder.hpp"

namespace trundle::logs {
namespace {

namespace fs = std::filesystem;

// rosbag2_storage_sqlite3: tables `topics` and `messages`, since Iron `message_definitions`, too. SQLite
// reads what is whole. What breaks off or is damaged is read from its pages, whose rows are the same as those
// of these questions: columns in this order.
constexpr const char* kTopicsSql = "SELECT id, name, type, serialization_format FROM topics ORDER BY id";
constexpr const char* kDefinitionsSql =
    "SELECT id, topic_type, encoding, encoded_message_definition FROM message_definitions";
constexpr const char* kMessagesSql = "SELECT id, topic_id, timestamp, data FROM messages ORDER BY id";
constexpr std::array kTopicKinds = {SqliteKind::null, SqliteKind::text, SqliteKind::text, SqliteKind::text};
constexpr std::array kMessageKinds = {SqliteKind::null, SqliteKind::integer, SqliteKind::integer,
                                      SqliteKind::blob};

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
  Database(const fs::path& path, const Limits& limits, bool is_ours = false) {
    // Of another's nothing is written beside it: it is opened as one that nobody changes.
    const std::string uri = "file:" + escaped(path) + (is_ours ? "" : "?immutable=1");
    const int flags = is_ours ? SQLITE_OPEN_READWRITE : SQLITE_OPEN_READONLY;
    const int status =
        sqlite3_open_v2(uri.c_str(), &database_, flags | SQLITE_OPEN_URI | SQLITE_OPEN_NOMUTEX, nullptr);
    if (database_ == nullptr) throw std::bad_alloc();
    if (status != SQLITE_OK) {
      const std::string reason = fault();
      sqlite3_close(database_);
      throw InputError(path.string(), "cannot be opened: " + reason, "a database of rosbag2");
    }
    sqlite3_limit(database_, SQLITE_LIMIT_LENGTH,
                  static_cast<int>(std::min<std::size_t>(limits.largest_message, std::size_t{1} << 30)));
    sqlite3_db_config(database_, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
    sqlite3_db_config(database_, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  }
  ~Database() { sqlite3_close(database_); }
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  sqlite3* get() const { return database_; }
  std::string fault() const { return sqlite3_errmsg(database_); }
  /// SQLITE_ROW: there is one, and no view that computes its rows; SQLITE_DONE: there is none; or what went
  /// wrong.
  int find_table(const std::string& name) const {
    return Statement(database_, "SELECT 1 FROM sqlite_master WHERE type = 'table' AND name = '" + name + "'")
        .step();
  }
  /// What a crash left beside it is put into it.
  int settle() {
    const int status = sqlite3_exec(database_, "SELECT 1 FROM sqlite_master", nullptr, nullptr, nullptr);
    return status == SQLITE_OK
               ? sqlite3_exec(database_, "PRAGMA wal_checkpoint(TRUNCATE)", nullptr, nullptr, nullptr)
               : status;
  }

 private:
  static std::string escaped(const fs::path& path) {
    std::string text;
    for (const char c : fs::absolute(path).string())
      text += c == '%' || c == '?' || c == '#' ? fmt::format("%{:02x}", static_cast<unsigned>(c))
                                               : std::string(1, c);
    return text;
  }

  sqlite3* database_ = nullptr;
};

/// A database as it is when what a crash left beside it is a part of it: in a copy, where there is some.
class SettledFile {
 public:
  SettledFile(const fs::path& path, const Limits& limits) : path_(path) {
    const std::vector<fs::path> leftovers = leftovers_of(path);
    if (leftovers.empty()) return;
    const InputError too_large(path.string(), "was not closed, and is too large for a copy",
                               "a bag that was closed");
    if (fs::file_size(path) > limits.largest_database) throw too_large;
    copy_ = std::make_unique<TemporaryFolder>();
    path_ = copy_->path() / "bag.db3";
    fs::copy_file(path, path_);
    // SQLite takes the rest of a page that breaks off for zeros, and so rows for others than they were.
    const SqliteFile file(path_, limits);
    fs::resize_file(path_, file.pages() * std::uint64_t{file.page_size()});
    for (const fs::path& beside : leftovers)
      fs::copy_file(beside, path_.string() + beside.string().substr(path.string().size()));
    Database database(path_, limits, true);
    const int status = database.settle();
    // What is damaged is read as far as it goes, as any other.
    if (status != SQLITE_OK && status != SQLITE_CORRUPT && status != SQLITE_NOTADB)
      throw InputError(path.string(), "was not closed, and cannot be put right: " + database.fault(),
                       "a bag that was closed, or room for a copy");
    if (fs::file_size(path_) > limits.largest_database) throw too_large;
  }

  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
  std::unique_ptr<TemporaryFolder> copy_;
};

class SqliteBag : public Log {
 public:
  SqliteBag(const fs::path& path, const Limits& limits)
      : path_(path), limits_(limits), settled_(path, limits), file_(settled_.path(), limits) {
    fault_ = file_.is_cut() ? cut_of_file() : ask_for_channels();
    if (fault_.empty())
      messages_.emplace(database_->get(), kMessagesSql);
    else
      find_channels();
  }

  std::string_view format() const override { return "rosbag2 (SQLite)"; }
  std::span<const Channel* const> channels() const override { return channels_.all(); }
  const std::optional<Cut>& cut() const override { return cut_; }

  std::optional<Message> next() override {
    if (cut_ || is_at_end_) return std::nullopt;
    if (fault_.empty()) {
      std::optional<Message> message = next_asked_for();
      if (message || cut_ || is_at_end_) return message;
    }
    return next_found();
  }

 private:
  struct Definition {
    SchemaLanguage language = SchemaLanguage::none;
    std::string text;
  };
  using Definitions = std::map<std::string, Definition>;

  void end(std::string reason) { cut_ = Cut{path_.string(), 0, std::move(reason)}; }

  // ---- By SQLite ----

  /// What keeps it from telling; empty: nothing.
  std::string ask_for_channels() {
    database_.emplace(settled_.path(), limits_);
    for (const char* const table : {"topics", "messages"})
      if (const int status = database_->find_table(table); status != SQLITE_ROW) {
        if (status != SQLITE_DONE) return damage();
        throw InputError(path_.string(), "is a database without the tables topics and messages",
                         "a bag of rosbag2");
      }
    Definitions definitions;
    if (database_->find_table("message_definitions") == SQLITE_ROW)
      for (Statement row(database_->get(), kDefinitionsSql); row.step() == SQLITE_ROW;)
        take_definition(row, definitions);
    Statement row(database_->get(), kTopicsSql);
    int status = SQLITE_ROW;
    while ((status = row.step()) == SQLITE_ROW)
      if (!take_topic(row, definitions)) return {};
    return status == SQLITE_DONE ? std::string() : damage();
  }

  /// Nothing, too, where the pages are to be read themselves from here on.
  std::optional<Message> next_asked_for() {
    const int status = messages_->step();
    if (status == SQLITE_ROW) {
      last_id_ = messages_->integer(0);
      std::string flaw;
      std::optional<Message> message = message_of(*messages_, flaw);
      if (!message) end(std::move(flaw));
      return message;
    }
    if (status == SQLITE_DONE)
      is_at_end_ = true;
    else if (status == SQLITE_CORRUPT)
      fault_ = damage();
    else
      end(fmt::format("the database cannot be read on: {}", database_->fault()));
    return std::nullopt;
  }

  std::string damage() const { return fmt::format("the database is damaged: {}", database_->fault()); }

  // ---- From the pages ----

  std::string cut_of_file() const {
    return file_.announced_pages() > 0
               ? fmt::format("the file breaks off: it holds {} of its {} pages", file_.pages(),
                             file_.announced_pages())
               : fmt::format("the file breaks off within a page, after {} of them", file_.pages());
  }

  void find_channels() {
    const auto topics = file_.root_of("topics");
    if (topics && file_.root_of("messages")) {
      Definitions definitions;
      if (const auto root = file_.root_of("message_definitions"))
        file_.each_row(*root, [&](const SqliteRow& row) { take_definition(row, definitions); });
      file_.each_row(*topics, [&](const SqliteRow& row) {
        if (row.begins_with(kTopicKinds)) take_topic(row, definitions);
      });
    }
    if (channels_.size() == 0)
      throw InputError(path_.string(), "has no topics that can be read: " + fault_, "a bag of rosbag2");
  }

  /// Rows that are none of a topic's messages are of pages that are in use no more.
  std::optional<Message> next_found() {
    if (!leaves_) leaves_.emplace(file_, kMessageKinds, last_id_);
    std::string flaw;
    while (const auto row = leaves_->next())
      if (const auto message = message_of(*row, flaw)) return message;
    end(leaves_->has_too_many()
            ? fmt::format("{}; messages of {} pages are read, no more", fault_, SqliteLeaves::kMostLeaves)
            : fault_);
    leaves_.reset();
    return std::nullopt;
  }

  // ---- Rows of either: Statement or SqliteRow ----

  void take_definition(auto& row, Definitions& definitions) {
    const std::string encoding = row.text(2);
    const std::size_t size = row.bytes(3).size();
    if (definitions.size() >= limits_.most_channels) return;
    if (size > limits_.largest_definition || !channels_.takes(size, limits_)) return;
    if (encoding == "ros2msg") definitions[row.text(1)] = {SchemaLanguage::ros2msg, row.text(3)};
    if (encoding == "ros2idl") definitions[row.text(1)] = {SchemaLanguage::ros2idl, row.text(3)};
  }

  /// False: they are too many.
  bool take_topic(auto& row, const Definitions& definitions) {
    const std::int64_t id = row.integer(0);
    if (by_id_.contains(id)) return true;
    Channel channel{.id = static_cast<std::uint32_t>(id), .topic = row.text(1), .type = row.text(2)};
    if (row.text(3) == "cdr")
      channel.encoding = Encoding::cdr;
    else
      channel.unreadable = "its messages are not encoded as cdr";
    if (const auto found = definitions.find(channel.type); found != definitions.end()) {
      channel.language = found->second.language;
      channel.definition = found->second.text;
    }
    if (!channels_.takes(channel.topic.size() + channel.type.size() + channel.definition.size(), limits_))
      return false;
    by_id_[id] = &channels_.add(std::move(channel));
    return true;
  }

  /// Nothing: `flaw` says why it is none.
  std::optional<Message> message_of(auto& row, std::string& flaw) {
    const auto found = by_id_.find(row.integer(1));
    const std::int64_t time_ns = row.integer(2);
    flaw = found == by_id_.end()                     ? "a message is of no topic"
           : time_ns < 0 || time_ns > kLatestTime_ns ? "the time of a message is no time"
                                                     : "";
    if (!flaw.empty()) return std::nullopt;
    const std::span<const std::byte> bytes = plain(row.bytes(3), flaw);
    return flaw.empty() ? std::optional(Message{found->second, time_ns, bytes}) : std::nullopt;
  }

  /// A message that was compressed by itself (compression_mode: MESSAGE). CDR never starts as zstd does.
  std::span<const std::byte> plain(std::span<const std::byte> bytes, std::string& flaw) {
    constexpr std::string_view kZstd = "\x28\xb5\x2f\xfd";
    if (!text_of(bytes).starts_with(kZstd)) return bytes;
    Inflated inflated = inflater_.inflate_frame(bytes, limits_.largest_message);
    flaw = std::move(inflated.fault);
    return inflated.bytes;
  }

  fs::path path_;
  Limits limits_;
  SettledFile settled_;
  SqliteFile file_;
  std::string fault_;  ///< empty: SQLite reads it
  std::optional<Database> database_;
  ChannelList channels_;
  std::map<std::int64_t, Channel*> by_id_;
  std::optional<Statement> messages_;
  std::optional<std::int64_t> last_id_;  ///< of the messages that SQLite gave
  std::optional<SqliteLeaves> leaves_;
  Inflater inflater_;
  bool is_at_end_ = false;
  std::optional<Cut> cut_;
};

}  // namespace

std::unique_ptr<Log> open_sqlite_bag(const fs::path& path, const Limits& limits) {
  return std::make_unique<SqliteBag>(path, limits);
}

}  // namespace trundle::logs
