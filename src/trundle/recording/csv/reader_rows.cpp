#include <algorithm>
#include <cstring>

#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/recording/csv/detail/cells.hpp"
#include "trundle/recording/csv/number.hpp"

namespace trundle::recording {
namespace {

enum class Use { skip, number, time, text };

/// What becomes of one column's cells.
struct Plan {
  Use use = Use::skip;
  std::size_t target = 0;
  TimeScale time;
};

/// A line that does not have the cells it should; `cells` counted up to where it broke off.
struct WrongLine {
  std::size_t column = 0;
  std::string_view cell;
  enum { too_few, too_many, not_a_number } what = too_few;
};

/// A number as it is written where the decimal point is another sign.
std::string with_point(std::string_view cell, char decimal) {
  std::string pointed(cell);
  std::ranges::replace(pointed, decimal, '.');
  return pointed;
}

/// Reads the rows of a table. Numbers pass through a block of rows that stays in the cache.
class RowReader {
 public:
  RowReader(const CsvFormat& format, std::size_t columns, std::span<const CsvColumn> wanted)
      : scanner_(format),
        delimiter_(format.delimiter),
        comment_(format.comment),
        decimal_(format.decimal),
        plans_(columns) {
    rows_.numbers.resize(wanted.size());
    rows_.texts.resize(wanted.size());
    block_rows_ = std::max<std::size_t>(1, kBlockCells / std::max<std::size_t>(1, wanted.size()));
    block_.resize(wanted.size() * block_rows_);
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      constexpr std::array kUses = {Use::number, Use::time, Use::text};
      Plan& plan = plans_.at(wanted[i].index);
      plan = {kUses[static_cast<std::size_t>(wanted[i].kind)], i, wanted[i].time};
      if (plan.use == Use::time && plan.time.unit_exponent == 0 && plan.time.origin_s == 0)
        plan.use = Use::number;
    }
  }

  void reserve(std::size_t rows) {
    for (const Plan& plan : plans_)
      if (plan.use == Use::number || plan.use == Use::time) rows_.numbers[plan.target].reserve(rows);
  }

  /// Reads lines, each ended by '\n'. Throws WrongLine; line() is then the line.
  void read(std::string_view text, std::size_t first_line) {
    line_ = first_line;
    const char* p = text.data();
    for (const char* const end = p + text.size(); p != end; ++line_) p = read_line(p, end);
    flush();
  }

  std::size_t line() const { return line_; }
  CsvRows& rows() { return rows_; }
  void flush();

 private:
  static constexpr std::size_t kBlockCells = 4096;  // 32 KiB: a first-level cache

  bool may_be_skipped(const char* p) const;
  const char* read_line(const char* p, const char* end);
  const char* read_plain_line(const char* p);
  void read_any_line(std::string_view line);
  void read_cell(std::string_view cell, std::size_t column);
  double& slot(const Plan& plan) { return block_[plan.target * block_rows_ + in_block_]; }
  void finish_row();

  CellScanner scanner_;
  char delimiter_;
  char comment_;
  char decimal_;
  std::vector<Plan> plans_;
  CsvRows rows_;
  std::size_t block_rows_ = 1;
  std::vector<double> block_;
  std::vector<std::string> texts_;
  std::size_t in_block_ = 0;
  std::size_t line_ = 1;
};

void RowReader::flush() {
  for (const Plan& plan : plans_) {
    if (plan.use != Use::number && plan.use != Use::time) continue;
    const double* const first = block_.data() + plan.target * block_rows_;
    rows_.numbers[plan.target].insert(rows_.numbers[plan.target].end(), first, first + in_block_);
  }
  in_block_ = 0;
}

void RowReader::finish_row() {
  rows_.lines.append(line_);
  if (++in_block_ == block_rows_) flush();
}

/// The fast path: every cell is digits with at most a sign and a point, or is skipped. Returns the start of
/// the next line, or nullptr where anything else stands.
const char* RowReader::read_plain_line(const char* p) {
  const std::size_t last = plans_.size() - 1;
  for (std::size_t column = 0; column <= last; ++column) {
    const Plan& plan = plans_[column];
    if (plan.use == Use::number) {
      Decimal decimal;
      p = read_decimal(p, decimal);
      if (p == nullptr || !is_one_division(decimal)) return nullptr;
      slot(plan) = value_of(decimal);
    } else if (plan.use == Use::skip) {
      while (*p != delimiter_ && *p != '\n' && *p != '"') ++p;
    } else {
      return nullptr;
    }
    if (*p != (column == last ? '\n' : delimiter_)) return nullptr;
    ++p;
  }
  return p;
}

/// A line that begins so may be blank or a comment, whose first cell would be passed over like any other that
/// is not wanted.
bool RowReader::may_be_skipped(const char* p) const {
  return *p == ' ' || *p == '\t' || *p == '\r' || *p == comment_;
}

const char* RowReader::read_line(const char* p, const char* end) {
  const bool plain = delimiter_ != ' ' && !may_be_skipped(p);
  if (const char* const next = plain ? read_plain_line(p) : nullptr) {
    finish_row();
    return next;
  }
  const auto* const line_end =
      static_cast<const char*>(std::memchr(p, '\n', static_cast<std::size_t>(end - p)));
  const std::string_view line(p, static_cast<std::size_t>(line_end - p));
  if (!scanner_.is_skipped(line)) {
    read_any_line(line);
    finish_row();
  }
  return line_end + 1;
}

void RowReader::read_cell(std::string_view cell, std::size_t column) {
  const Plan& plan = plans_[column];
  if (plan.use == Use::skip) return;
  if (plan.use == Use::text) {
    texts_.push_back(text_in(cell));
    return;
  }
  const std::string pointed = decimal_ == '.' ? std::string() : with_point(cell, decimal_);
  const std::string_view number = decimal_ == '.' ? cell : pointed;
  const auto value = plan.use == Use::time ? stamp_in(number, plan.time) : number_in(number);
  if (!value) throw WrongLine{column, cell, WrongLine::not_a_number};
  slot(plan) = *value;
}

void RowReader::read_any_line(std::string_view line) {
  texts_.clear();
  std::string_view rest = line;
  std::size_t column = 0;
  for (; column < plans_.size() && rest.data() != nullptr; ++column) read_cell(scanner_.take(rest), column);
  if (column < plans_.size()) throw WrongLine{column, {}, WrongLine::too_few};
  if (rest.data() != nullptr && !scanner_.take(rest).empty())
    throw WrongLine{column, {}, WrongLine::too_many};
  std::size_t text = 0;
  for (const Plan& plan : plans_)
    if (plan.use == Use::text) rows_.texts[plan.target].push_back(std::move(texts_[text++]));
}

/// A cell for a message: short and printable.
std::string shown(std::string_view cell) {
  constexpr std::size_t kLongest = 40;  // half a line of a terminal: the other half is for place and column
  std::string text(cell.substr(0, kLongest));
  for (char& c : text)
    if (static_cast<unsigned char>(c) < ' ' || static_cast<unsigned char>(c) > '~') c = '?';
  return cell.size() > kLongest ? text + "..." : text;
}

/// Whether a last line without its end may have been cut there by a logger that was stopped.
bool may_be_cut(const WrongLine& wrong) {
  return wrong.what == WrongLine::too_few ||
         (wrong.what == WrongLine::not_a_number &&
          wrong.cell.find_first_not_of("+-.0123456789eE") == std::string::npos);
}

/// What should have stood in a cell of a column of numbers.
std::string expected_of(const CsvTable& table, std::size_t line, const WrongLine& wrong) {
  if (number_in(with_point(wrong.cell, ','))) return "a decimal point, or decimal = \",\" in recording.toml";
  if (table.names().empty() && line == table.header_line())
    return "numbers in the first line, or header = true in recording.toml where it names the columns";
  return "a number, or nothing where none was measured";
}

[[noreturn]] void fail(const CsvTable& table, std::size_t line, const WrongLine& wrong) {
  const std::string where = place(table.file(), line);
  const std::string cells =
      fmt::format("{} cells as in the {}", table.columns(), table.names().empty() ? "first row" : "header");
  if (wrong.what == WrongLine::too_few)
    throw InputError(where, fmt::format("has {} cells", wrong.column), cells);
  if (wrong.what == WrongLine::too_many)
    throw InputError(where, fmt::format("has more than {} cells", wrong.column), cells);
  const std::string column =
      table.names().empty() ? std::to_string(wrong.column + 1) : "'" + table.names()[wrong.column] + "'";
  throw InputError(where, fmt::format("column {} holds '{}'", column, shown(wrong.cell)),
                   expected_of(table, line, wrong));
}

}  // namespace

CsvRows CsvTable::read(std::span<const CsvColumn> wanted, const CsvRest& rest) const {
  const std::string_view body = text_.substr(body_);
  RowReader reader(format_, columns_, wanted);
  reader.reserve((body.size() + rest.size) / std::max<std::size_t>(1, line_at(body, 0).size()));
  std::size_t line = body_line_;
  const auto read = [&](std::string_view whole_lines) {
    try {
      reader.read(whole_lines, line);
    } catch (const WrongLine& wrong) {
      fail(*this, reader.line(), wrong);
    }
    line = reader.line();
  };
  const auto next = [&] { return rest.next ? rest.next() : std::string_view(); };
  std::string last_line;  // of which no end has been seen yet
  for (std::string_view piece = body.empty() ? next() : body; !piece.empty(); piece = next()) {
    const std::size_t end = piece.rfind('\n') + 1;
    if (end > 0) {
      const std::size_t first_end = last_line.empty() ? 0 : piece.find('\n') + 1;
      read(last_line.append(piece, 0, first_end));
      last_line.clear();
      read(piece.substr(first_end, end - first_end));
    }
    last_line += piece.substr(end);
  }
  last_line += '\n';
  try {
    reader.read(last_line, line);
  } catch (const WrongLine& wrong) {
    if (!may_be_cut(wrong)) fail(*this, line, wrong);
    reader.rows().truncated_line = line;
    reader.flush();
  }
  return std::move(reader.rows());
}

}  // namespace trundle::recording
