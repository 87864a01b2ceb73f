#include "trundle/logs/detail/sqlite_file.hpp"

#include <algorithm>
#include <bit>
#include <limits>
#include <set>

#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/logs/detail/byte_cursor.hpp"

namespace trundle::logs {
namespace {

constexpr std::size_t kSqliteHead = 100;  ///< before the first page's own [bytes]
constexpr std::size_t kSmallestPage = 512, kLargestPage = 1 << 16, kLeastUsable = 480;
constexpr std::uint8_t kTableInterior = 0x05, kTableLeaf = 0x0d;
/// Of a table that is reached from its root. Those of a bag have some, messages excepted.
constexpr std::size_t kMostTablePages = 1 << 16;
constexpr std::size_t kMostFreePages = 1 << 22;

/// The highest byte first.
std::uint64_t take_big(ByteCursor& cursor, std::size_t bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < bytes; ++i) value = value << 8U | cursor.take<std::uint8_t>();
  return value;
}

std::uint32_t take_page_number(ByteCursor& cursor) {
  return static_cast<std::uint32_t>(take_big(cursor, 4));
}

/// Seven bits a byte, of which the highest says that more follow; all eight of a ninth.
std::uint64_t take_varint(ByteCursor& cursor) {
  std::uint64_t value = 0;
  for (int i = 0; i < 8; ++i) {
    const auto byte = cursor.take<std::uint8_t>();
    value = value << 7U | (byte & 0x7fU);
    if (byte < 0x80) return value;
  }
  return value << 8U | cursor.take<std::uint8_t>();
}

constexpr std::array<std::size_t, 10> kNumberSizes = {0, 1, 2, 3, 4, 6, 8, 8, 0, 0};  ///< by serial type
constexpr std::uint64_t kRealType = 7, kZeroType = 8, kFirstBlobType = 12;

SqliteKind column_kind(std::uint64_t type) {
  if (type == 0) return SqliteKind::null;
  if (type == kRealType) return SqliteKind::real;
  if (type < kFirstBlobType) return SqliteKind::integer;
  return type % 2 == 0 ? SqliteKind::blob : SqliteKind::text;
}

std::uint64_t column_size(std::uint64_t type) {
  return type < kNumberSizes.size() ? kNumberSizes[type] : (type - kFirstBlobType) / 2;
}

/// Where the page's own head begins.
std::size_t page_head(std::uint32_t page) {
  return page == 1 ? kSqliteHead : 0;
}

/// The pages below an interior one, in order; of another page none.
std::vector<std::uint32_t> children_of(std::span<const std::byte> page, std::uint32_t number) {
  constexpr std::size_t kCountAt = 3, kSkipped = 3;
  std::vector<std::uint32_t> children;
  ByteCursor head(page.subspan(std::min(page_head(number), page.size())));
  if (head.take<std::uint8_t>() != kTableInterior) return children;
  head.take_bytes(kCountAt - 1);
  const auto count = static_cast<std::size_t>(take_big(head, 2));
  head.take_bytes(kSkipped);
  const std::uint32_t last = take_page_number(head);
  for (std::size_t i = 0; i < count; ++i) {
    const auto place = static_cast<std::size_t>(take_big(head, 2));
    if (!head.is_good() || place > page.size()) break;
    ByteCursor cell(page.subspan(place));
    children.push_back(take_page_number(cell));
  }
  children.push_back(last);
  return children;
}

}  // namespace

SqliteRow::SqliteRow(std::int64_t rowid, std::span<const std::byte> record) : rowid_(rowid), record_(record) {
  ByteCursor lengths(record);
  const std::uint64_t head = take_varint(lengths);
  if (!lengths.is_good() || head > record.size()) return;
  ByteCursor types(record.first(static_cast<std::size_t>(head)));
  take_varint(types);
  std::uint64_t offset = head;
  while (count_ < kMostColumns && !types.is_empty()) {
    const std::uint64_t type = take_varint(types);
    const std::uint64_t size = column_size(type);
    const bool is_reserved = type == 10 || type == 11;
    if (!types.is_good() || is_reserved || size > std::numeric_limits<std::uint32_t>::max()) return;
    columns_[count_++] = {column_kind(type), type, static_cast<std::size_t>(offset),
                          static_cast<std::size_t>(size)};
    offset += size;
  }
}

bool SqliteRow::begins_with(std::span<const SqliteKind> kinds) const {
  return kinds.size() <= count_ &&
         std::ranges::equal(kinds, std::span(columns_).first(kinds.size()), {}, {}, &Column::kind);
}

const SqliteRow::Column* SqliteRow::column_at(std::size_t column) const {
  if (column >= count_) return nullptr;
  const Column& found = columns_[column];
  return found.offset + found.size <= record_.size() ? &found : nullptr;
}

std::int64_t SqliteRow::integer(std::size_t column) const {
  const Column* const found = column_at(column);
  if (found == nullptr) return 0;
  if (found->kind == SqliteKind::null) return rowid_;
  if (found->kind != SqliteKind::integer) return 0;
  if (found->size == 0) return static_cast<std::int64_t>(found->type - kZeroType);
  ByteCursor cursor(record_.subspan(found->offset, found->size));
  const std::size_t unused = 64 - 8 * found->size;  // bits above the sign
  return static_cast<std::int64_t>(take_big(cursor, found->size) << unused) >> unused;
}

std::span<const std::byte> SqliteRow::bytes(std::size_t column) const {
  const Column* const found = column_at(column);
  if (found == nullptr || (found->kind != SqliteKind::text && found->kind != SqliteKind::blob)) return {};
  return record_.subspan(found->offset, found->size);
}

std::string SqliteRow::text(std::size_t column) const {
  return std::string(text_of(bytes(column)));
}

SqliteFile::SqliteFile(const std::filesystem::path& path, const Limits& limits)
    : file_(path, kSmallestPage), largest_record_(limits.largest_message) {
  constexpr std::size_t kPageSizeAt = 16;
  const std::span<const std::byte> head = file_.peek(kSqliteHead);
  if (head.size() < kSqliteHead)
    throw InputError(path.string(), "breaks off within its head", "a database of rosbag2");
  const auto number = [&](std::size_t at, std::size_t bytes) {
    ByteCursor cursor(head.subspan(at));
    return take_big(cursor, bytes);
  };
  constexpr std::size_t kReservedAt = 20, kChangesAt = 24, kCountAt = 28, kFreeAt = 32, kValidForAt = 92;
  page_size_ = static_cast<std::size_t>(number(kPageSizeAt, 2));
  if (page_size_ == 1) page_size_ = kLargestPage;  // two bytes have no room for it
  const auto reserved = static_cast<std::size_t>(number(kReservedAt, 1));
  if (page_size_ < kSmallestPage || !std::has_single_bit(page_size_) || page_size_ - reserved < kLeastUsable)
    throw InputError(path.string(), fmt::format("says that its pages have {} bytes", page_size_),
                     "a database of rosbag2");
  usable_ = page_size_ - reserved;
  pages_ = static_cast<std::uint32_t>(
      std::min<std::uint64_t>(file_.size() / page_size_, std::numeric_limits<std::uint32_t>::max() - 1));
  // The count is right where the change that it is valid for is the last one.
  if (number(kChangesAt, 4) == number(kValidForAt, 4))
    announced_ = static_cast<std::uint32_t>(number(kCountAt, 4));
  is_cut_ = announced_ > 0 ? pages_ < announced_ : file_.size() % page_size_ != 0;
  first_free_ = static_cast<std::uint32_t>(number(kFreeAt, 4));
  // Twice: of what was a record once and is on a free page now some may be on a page of another record.
  overflows_left_ = 2 * std::uint64_t{pages_};
}

std::span<const std::byte> SqliteFile::look_at(std::uint32_t number) {
  if (number == 0 || number > pages_) return {};
  file_.seek((number - std::uint64_t{1}) * page_size_);
  const std::span<const std::byte> page = file_.peek(page_size_);
  return page.size() == page_size_ ? page : std::span<const std::byte>();
}

std::vector<std::byte> SqliteFile::page(std::uint32_t number) {
  const std::span<const std::byte> bytes = look_at(number);
  return {bytes.begin(), bytes.end()};
}

/// Of a record of `size` bytes, how many are on the leaf.
std::uint64_t SqliteFile::local_size(std::uint64_t size) const {
  const std::uint64_t most = usable_ - 35;
  if (size <= most) return size;
  const std::uint64_t least = (usable_ - 12) * 32 / 255 - 23;
  const std::uint64_t fills_its_last_page = least + (size - least) % (usable_ - 4);
  return fills_its_last_page <= most ? fills_its_last_page : least;
}

std::vector<SqliteCell> SqliteFile::cells_of(std::span<const std::byte> page, std::uint32_t number) const {
  constexpr std::size_t kFreeBlock = 2, kStartAndFragments = 3;
  std::vector<SqliteCell> cells;
  if (page.size() < page_size_) return cells;
  page = page.first(usable_);
  ByteCursor head(page.subspan(page_head(number)));
  if (head.take<std::uint8_t>() != kTableLeaf) return cells;
  head.take_bytes(kFreeBlock);
  const auto count = static_cast<std::size_t>(take_big(head, 2));
  head.take_bytes(kStartAndFragments);
  std::size_t used = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const auto place = static_cast<std::size_t>(take_big(head, 2));
    if (!head.is_good()) break;
    if (place >= page.size()) continue;
    ByteCursor at(page.subspan(place));
    SqliteCell cell;
    cell.size = take_varint(at);
    cell.rowid = static_cast<std::int64_t>(take_varint(at));
    cell.local = at.take_bytes(local_size(cell.size));
    if (cell.local.size() < cell.size) cell.overflow = take_page_number(at);
    if (!at.is_good()) continue;
    used += cell.local.size();
    if (used > page.size()) break;  // cells do not overlap, or a small file would hold ever so much
    cells.push_back(cell);
  }
  return cells;
}

std::optional<std::span<const std::byte>> SqliteFile::record_of(const SqliteCell& cell) {
  if (cell.size > largest_record_) return std::nullopt;
  if (cell.local.size() == cell.size) return cell.local;
  record_.assign(cell.local.begin(), cell.local.end());
  std::uint32_t next = cell.overflow;
  while (record_.size() < cell.size) {
    const std::span<const std::byte> page = look_at(next);
    if (page.empty() || overflows_left_ == 0) return std::nullopt;
    --overflows_left_;
    ByteCursor bytes(page.first(usable_));
    next = take_page_number(bytes);
    const std::size_t most = bytes.rest().size();
    const auto piece = bytes.take_bytes(std::min<std::uint64_t>(cell.size - record_.size(), most));
    record_.insert(record_.end(), piece.begin(), piece.end());
  }
  if (next != 0) return std::nullopt;  // a page of it has become another's
  return record_;
}

std::vector<std::uint32_t> SqliteFile::free_pages() {
  // No more than there are: trunks may be in a circle.
  const std::size_t most = std::min<std::size_t>(pages_, kMostFreePages);
  std::vector<std::uint32_t> free;
  for (std::uint32_t trunk = first_free_; free.size() < most;) {
    const std::span<const std::byte> page = look_at(trunk);
    if (page.empty()) break;
    free.push_back(trunk);
    ByteCursor bytes(page.first(usable_));
    trunk = take_page_number(bytes);
    const auto count = std::min<std::uint64_t>(take_big(bytes, 4), bytes.rest().size() / 4);
    for (std::uint64_t i = 0; i < count && free.size() < most; ++i) free.push_back(take_page_number(bytes));
  }
  std::ranges::sort(free);
  return free;
}

std::optional<std::uint32_t> SqliteFile::root_of(std::string_view table) {
  std::optional<std::uint32_t> root;
  each_row(1, [&](const SqliteRow& row) {
    if (row.text(0) == "table" && row.text(1) == table) root = static_cast<std::uint32_t>(row.integer(3));
  });
  return root;
}

void SqliteFile::each_row(std::uint32_t root, const std::function<void(const SqliteRow&)>& take) {
  // All leaves are equally far from the root: from level to level they come in the order of their rows.
  std::vector<std::uint32_t> numbers = {root};
  std::set<std::uint32_t> seen = {root};
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const std::uint32_t number = numbers[i];
    const std::vector<std::byte> bytes = page(number);
    for (const std::uint32_t child : children_of(bytes, number))
      if (numbers.size() < kMostTablePages && seen.insert(child).second) numbers.push_back(child);
    for (const SqliteCell& cell : cells_of(bytes, number))
      if (const auto record = record_of(cell)) take(SqliteRow(cell.rowid, *record));
  }
}

}  // namespace trundle::logs
