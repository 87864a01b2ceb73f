#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "trundle/logs/detail/file_window.hpp"
#include "trundle/logs/log.hpp"

// What SQLite does not read is read page by page: a database that breaks off or is damaged. Of its format
// (https://www.sqlite.org/fileformat.html), whose numbers have their highest byte first:
//
// A file is pages of one size, numbered from 1. The first 100 bytes of the first say how large and how many.
//
// A table is a tree of pages below its root: interior ones, which hold the numbers of others, and leaves,
// which hold rows in the order of their numbers (rowid). A leaf does not say of which table it is. SQLite
// writes leaves as they become full, but pages that name them rarely: half of a file may hang on one at its
// end.
//
// A leaf lists its cells, and each holds a row: length of its record, rowid, record. Of a record too long for
// its page only the first part is there, before the number of the overflow page that goes on: the number of
// the next one, 0 in the last, and bytes.
//
// A record is a head and values. The head holds its own length and of each column a serial type, which is its
// kind and length. A column that is the rowid is NULL.
//
// Page 1 is the root of the table of tables: type, name, table, root page, SQL.
//
// Pages that are in use no more keep what they held. Trunk pages list them: the next trunk, a count, numbers.
namespace trundle::logs {

enum class SqliteKind { null, integer, real, text, blob };

/// A row, and the first columns of its record. It refers to the record's bytes.
class SqliteRow {
 public:
  SqliteRow(std::int64_t rowid, std::span<const std::byte> record);

  [[nodiscard]] std::int64_t rowid() const { return rowid_; }
  /// Whether it has these columns, and perhaps more. Their values need not be within the bytes.
  [[nodiscard]] bool begins_with(std::span<const SqliteKind> kinds) const;
  /// Of NULL: the rowid. What is no number, or not there, is 0.
  [[nodiscard]] std::int64_t integer(std::size_t column) const;
  /// Of a text or blob; else empty.
  [[nodiscard]] std::span<const std::byte> bytes(std::size_t column) const;
  [[nodiscard]] std::string text(std::size_t column) const;

 private:
  struct Column {
    SqliteKind kind = SqliteKind::null;
    std::uint64_t type = 0;  ///< serial
    std::size_t offset = 0;  ///< in the record
    std::size_t size = 0;    ///< [bytes]
  };
  static constexpr std::size_t kMostColumns = 5;  ///< that are looked at

  [[nodiscard]] const Column* column_at(std::size_t column) const;

  std::int64_t rowid_;
  std::span<const std::byte> record_;
  std::array<Column, kMostColumns> columns_;
  std::size_t count_ = 0;
};

/// Where a row is, on a leaf.
struct SqliteCell {
  std::int64_t rowid = 0;
  std::uint64_t size = 0;            ///< of the record [bytes]
  std::span<const std::byte> local;  ///< what of it is on the leaf
  std::uint32_t overflow = 0;        ///< page of what follows; 0: nothing does
};

/// A database's pages, as far as the file has them, whatever else it holds.
class SqliteFile {
 public:
  /// Throws InputError where its head is none.
  SqliteFile(const std::filesystem::path& path, const Limits& limits);

  [[nodiscard]] const std::filesystem::path& path() const { return file_.path(); }
  [[nodiscard]] std::size_t page_size() const { return page_size_; }
  /// That are in the file as a whole.
  [[nodiscard]] std::uint32_t pages() const { return pages_; }
  /// As the head counts them; 0: it does not.
  [[nodiscard]] std::uint32_t announced_pages() const { return announced_; }
  /// Some of them are missing, or a part of one.
  [[nodiscard]] bool is_cut() const { return is_cut_; }

  /// Empty where the file does not hold it.
  [[nodiscard]] std::vector<std::byte> page(std::uint32_t number);
  /// Of a table's leaf, as they are listed; of any other page none. They refer to it.
  [[nodiscard]] std::vector<SqliteCell> cells_of(std::span<const std::byte> page, std::uint32_t number) const;
  /// A cell's, valid until the next; nothing where a page of it is missing.
  [[nodiscard]] std::optional<std::span<const std::byte>> record_of(const SqliteCell& cell);
  /// Those in use no more, ascending.
  [[nodiscard]] std::vector<std::uint32_t> free_pages();

  /// Page at which a table begins.
  [[nodiscard]] std::optional<std::uint32_t> root_of(std::string_view table);
  /// Of the leaves of a small table that can be reached from its root.
  void each_row(std::uint32_t root, const std::function<void(const SqliteRow&)>& take);

 private:
  [[nodiscard]] std::span<const std::byte> look_at(std::uint32_t number);
  [[nodiscard]] std::uint64_t local_size(std::uint64_t size) const;

  FileWindow file_;
  std::uint64_t largest_record_;
  std::size_t page_size_ = 0;
  std::size_t usable_ = 0;  ///< of a page; what follows is reserved for others than SQLite
  std::uint32_t pages_ = 0;
  std::uint32_t announced_ = 0;
  bool is_cut_ = false;
  std::uint32_t first_free_ = 0;
  std::uint64_t overflows_left_ = 0;  ///< that are read: each is part of one record
  std::vector<std::byte> record_;
};

}  // namespace trundle::logs
