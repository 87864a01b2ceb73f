#include "trundle/logs/detail/sqlite_leaves.hpp"

#include <algorithm>

namespace trundle::logs {
namespace {

/// At once, where their rows overlap: one is of the table, others were before their rows moved.
constexpr std::size_t kMostOpenLeaves = 16;

}  // namespace

SqliteLeaves::SqliteLeaves(SqliteFile& file, std::span<const SqliteKind> kinds,
                           std::optional<std::int64_t> after)
    : file_(file), kinds_(kinds), given_(after) {
  find_leaves();
}

void SqliteLeaves::find_leaves() {
  const std::vector<std::uint32_t> free = file_.free_pages();
  auto next_free = free.begin();
  FileWindow pages(file_.path());
  for (std::uint32_t number = 1; number <= file_.pages() && !has_too_many(); ++number) {
    next_free = std::find_if(next_free, free.end(), [&](std::uint32_t page) { return page >= number; });
    if (next_free != free.end() && *next_free == number) continue;
    pages.seek((number - std::uint64_t{1}) * file_.page_size());
    const std::vector<SqliteCell> cells = cells_of(pages.peek(file_.page_size()), number);
    if (!cells.empty()) leaves_.push_back({cells.back().rowid, number});
  }
  std::ranges::sort(leaves_, {}, [](const Leaf& leaf) { return std::pair(leaf.first, leaf.page); });
}

std::vector<SqliteCell> SqliteLeaves::cells_of(std::span<const std::byte> page, std::uint32_t number) const {
  std::vector<SqliteCell> cells = file_.cells_of(page, number);
  std::erase_if(
      cells, [&](const SqliteCell& cell) { return !SqliteRow(cell.rowid, cell.local).begins_with(kinds_); });
  std::ranges::stable_sort(cells, std::greater(), &SqliteCell::rowid);
  return cells;
}

SqliteLeaves::OpenLeaf* SqliteLeaves::next_leaf() {
  std::erase_if(open_, [](const OpenLeaf& leaf) { return leaf.cells.empty(); });
  auto next = std::ranges::min_element(open_, {}, &OpenLeaf::next);
  while (opened_ < leaves_.size() && (next == open_.end() || leaves_[opened_].first <= next->next())) {
    const std::uint32_t number = leaves_[opened_++].page;
    if (open_.size() == kMostOpenLeaves) continue;
    OpenLeaf leaf{.page = file_.page(number), .cells = {}};
    leaf.cells = cells_of(leaf.page, number);
    if (!leaf.cells.empty()) open_.push_back(std::move(leaf));
    next = std::ranges::min_element(open_, {}, &OpenLeaf::next);
  }
  return next == open_.end() ? nullptr : &*next;
}

std::optional<SqliteRow> SqliteLeaves::next() {
  while (OpenLeaf* const leaf = next_leaf()) {
    const SqliteCell cell = leaf->cells.back();
    leaf->cells.pop_back();
    if (given_ && cell.rowid <= *given_) continue;
    const auto record = file_.record_of(cell);
    if (!record) continue;
    given_ = cell.rowid;
    return SqliteRow(cell.rowid, *record);
  }
  return std::nullopt;
}

}  // namespace trundle::logs
