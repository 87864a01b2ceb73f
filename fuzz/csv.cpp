// A table in memory, in any format. The first two bytes choose the format and the columns that are wanted:
// these are the cells that the table has as text, whatever path read them.
#include <bit>
#include <cmath>

#include "trundle/recording/csv/detail/cells.hpp"

#include "input.hpp"

namespace {

using namespace trundle;
using namespace trundle::recording;

CsvFormat format_of(unsigned choice) {
  constexpr std::string_view kDelimiters = ",; \t";
  return {.delimiter = kDelimiters[choice & 3U],
          .comment = (choice & 4U) != 0 ? '\0' : '#',
          .header = (choice & 8U) == 0,
          .skip_lines = choice >> 4U & 3U,
          .decimal = (choice & 64U) != 0 ? ',' : '.'};
}

/// Each second, third ... column as a number or as a stamp; all of them as text.
std::vector<CsvColumn> columns_of(const CsvTable& table, unsigned choice) {
  std::vector<CsvColumn> columns;
  for (std::size_t i = choice & 3U; i < table.columns(); i += 1 + (choice >> 2U & 3U))
    columns.push_back((choice & 16U) != 0 ? CsvColumn{i, CellKind::time, {-9, 1494449906}} : CsvColumn{i});
  return columns;
}

std::optional<double> value_of_cell(std::string cell, const CsvColumn& column, char decimal) {
  for (char& c : cell)
    if (c == decimal) c = '.';
  return column.kind == CellKind::time ? stamp_in(cell, column.time) : number_in(cell);
}

bool same(double a, double b) {
  return std::isnan(a) ? std::isnan(b) : std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

void require_same_cells(const CsvTable& table, const std::vector<CsvColumn>& wanted, char decimal) {
  const CsvRows rows = table.read(wanted);
  std::vector<CsvColumn> all;
  for (std::size_t i = 0; i < table.columns(); ++i) all.push_back({i, CellKind::text});
  const CsvRows text = table.read(all);
  for (std::size_t i = 0; i < wanted.size(); ++i)
    for (std::size_t row = 0; row < rows.count(); ++row) {
      const auto value = value_of_cell(text.texts[wanted[i].index].at(row), wanted[i], decimal);
      fuzz::require(value && same(*value, rows.numbers[i].at(row)));
      fuzz::require(text.lines.line_of(row) == rows.lines.line_of(row));
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  const CsvFormat format = format_of(data[0]);
  return fuzz::try_to([&] {
    const CsvTable table(fuzz::text_of(data + 2, size - 2), "memory", format);
    (void)table.meant();
    require_same_cells(table, columns_of(table, data[1]), format.decimal);
  });
}
