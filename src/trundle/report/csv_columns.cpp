#include "trundle/report/csv_columns.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/io/file.hpp"
#include "trundle/recording/csv/reader.hpp"

namespace trundle::report {
namespace {

/// Where `name` stands; its place in `names` when it is missing there is names.size().
std::size_t index_of(const std::vector<std::string>& names, std::string_view name) {
  return static_cast<std::size_t>(std::ranges::find(names, name) - names.begin());
}

}  // namespace

CsvColumns::CsvColumns(const std::filesystem::path& path, std::vector<std::string> numbers,
                       std::vector<std::string> texts, std::vector<std::string> optional) {
  const std::string text = read_file(path);
  const CsvTable table(text, path.string(), {});
  std::vector<CsvColumn> wanted;
  const auto want = [&](const std::vector<std::string>& names, CellKind kind, bool required,
                        std::vector<std::string>& found) {
    for (const std::string& name : names) {
      const auto column = table.column_named(name);
      if (!column && required)
        throw InputError(place(path.string(), table.header_line()), fmt::format("no column '{}'", name),
                         fmt::format("columns {}", fmt::join(names, ", ")));
      if (!column) continue;
      wanted.push_back({.index = *column, .kind = kind});
      found.push_back(name);
    }
  };
  want(numbers, CellKind::number, true, number_names_);
  want(optional, CellKind::number, false, number_names_);
  want(texts, CellKind::text, true, text_names_);
  CsvRows rows = table.read(wanted);
  count_ = rows.count();
  const auto split = static_cast<std::ptrdiff_t>(number_names_.size());
  numbers_.assign(std::make_move_iterator(rows.numbers.begin()),
                  std::make_move_iterator(rows.numbers.begin() + split));
  texts_.assign(std::make_move_iterator(rows.texts.begin() + split),
                std::make_move_iterator(rows.texts.end()));
}

bool CsvColumns::has(std::string_view name) const {
  return index_of(number_names_, name) < number_names_.size();
}

const std::vector<double>& CsvColumns::numbers(std::string_view name) const {
  static const std::vector<double> kNone;
  const std::size_t index = index_of(number_names_, name);
  return index < numbers_.size() ? numbers_[index] : kNone;
}

const std::vector<std::string>& CsvColumns::texts(std::string_view name) const {
  static const std::vector<std::string> kNone;
  const std::size_t index = index_of(text_names_, name);
  return index < texts_.size() ? texts_[index] : kNone;
}

}  // namespace trundle::report
