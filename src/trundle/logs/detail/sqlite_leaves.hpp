#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "trundle/logs/detail/sqlite_file.hpp"

namespace trundle::logs {

/// The rows of a table taken from all leaves of a file, without the pages above them: in the order of their
/// numbers, each once. They are known by their columns' kinds, which no other table may have. What is kept
/// is a number a leaf.
class SqliteLeaves {
 public:
  /// Of so many leaves rows are given: 16 GB of pages as they are by default, whose index takes 64 MB.
  static constexpr std::size_t kMostLeaves = std::size_t{1} << 22;

  /// Both outlive it. `after`: what comes after this row alone.
  SqliteLeaves(SqliteFile& file, std::span<const SqliteKind> kinds, std::optional<std::int64_t> after);

  /// Valid until the next. A row of which an overflow page is missing is passed over.
  [[nodiscard]] std::optional<SqliteRow> next();
  [[nodiscard]] bool has_too_many() const { return leaves_.size() == kMostLeaves; }

 private:
  struct Leaf {
    std::int64_t first = 0;  ///< of its rows
    std::uint32_t page = 0;
  };
  /// Read: the rest of its rows, the first one last.
  struct OpenLeaf {
    std::vector<std::byte> page;
    std::vector<SqliteCell> cells;

    [[nodiscard]] std::int64_t next() const { return cells.back().rowid; }
  };

  void find_leaves();
  [[nodiscard]] std::vector<SqliteCell> cells_of(std::span<const std::byte> page, std::uint32_t number) const;
  /// The one with the row of the smallest number; nullptr: there are no more.
  [[nodiscard]] OpenLeaf* next_leaf();

  SqliteFile& file_;
  std::span<const SqliteKind> kinds_;
  std::optional<std::int64_t> given_;  ///< the last row
  std::vector<Leaf> leaves_;           ///< by their first rows
  std::size_t opened_ = 0;             ///< of them
  std::vector<OpenLeaf> open_;
};

}  // namespace trundle::logs
