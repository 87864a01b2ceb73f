#include "trundle/recording/csv/detail/csv_file.hpp"

#include <algorithm>

namespace trundle::recording {

CsvFile::CsvFile(const std::filesystem::path& path, const CsvFormat& format) : path_(path), pieces_(path) {
  std::size_t looked_through = 0;  // not at each piece of a long preamble
  for (std::string_view piece = next(); !piece.empty(); piece = next()) {
    head_ += piece;
    if (head_.size() < 2 * looked_through) continue;
    if (CsvTable::has_head(head_, path.string(), format)) break;
    looked_through = head_.size();
  }
}

CsvRest CsvFile::rest() {
  const std::size_t size = std::max<std::size_t>(pieces_.size(), head_.size()) - head_.size();
  return {[this] { return next(); }, size};
}

InputFile CsvFile::input() {
  return {path_.string(), sha_.hex()};
}

std::string_view CsvFile::next() {
  const std::string_view piece = pieces_.next();
  sha_.add(piece);
  return piece;
}

}  // namespace trundle::recording
