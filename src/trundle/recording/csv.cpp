#include "trundle/recording/csv.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "trundle/io/error.hpp"
#include "trundle/recording/detail/csv_cells.hpp"

namespace trundle {
namespace {

std::string_view without_byte_order_mark(std::string_view text, const std::string& file) {
  if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF"))
    throw InputError(file, "is UTF-16 text", "UTF-8 or ASCII text");
  return text.starts_with("\xEF\xBB\xBF") ? text.substr(3) : text;
}

}  // namespace

MappedFile::MappedFile(const std::filesystem::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) throw InputError(path.string(), std::strerror(errno), "a readable file");
  struct stat status {};
  ::fstat(descriptor, &status);
  const auto size = static_cast<std::size_t>(status.st_size);
  void* bytes = nullptr;
  if (S_ISREG(status.st_mode) && size > 0)
    bytes = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE | MAP_POPULATE, descriptor, 0);
  ::close(descriptor);
  if (!S_ISREG(status.st_mode)) throw InputError(path.string(), "is not a file", "a readable file");
  if (bytes == MAP_FAILED) throw InputError(path.string(), std::strerror(errno), "a readable file");
  if (bytes != nullptr) text_ = {static_cast<const char*>(bytes), size};
}

MappedFile::~MappedFile() {
  if (!text_.empty()) ::munmap(const_cast<char*>(text_.data()), text_.size());
}

CsvTable::CsvTable(std::string_view text, std::string file, const CsvFormat& format)
    : text_(without_byte_order_mark(text, file)), file_(std::move(file)), format_(format) {
  const CellScanner scanner(format);
  while (body_ < text_.size() && scanner.is_skipped(line_at(text_, body_))) {
    body_ += line_at(text_, body_).size() + 1;
    ++body_line_;
  }
  if (body_ >= text_.size())
    throw InputError(file_, "is empty", format.header ? "a header and rows" : "rows");
  first_line_ = line_at(text_, body_);
  names_ = scanner.cells(first_line_);
  if (!names_.empty() && names_.back().empty()) names_.pop_back();  // a trailing delimiter
  columns_ = names_.size();
  header_line_ = body_line_;
  if (!format.header) {
    names_.clear();
    return;
  }
  body_ = std::min(text_.size(), body_ + first_line_.size() + 1);
  ++body_line_;
  for (std::size_t i = 0; i < names_.size(); ++i)
    if (std::find(names_.begin(), names_.begin() + static_cast<std::ptrdiff_t>(i), names_[i]) !=
        names_.begin() + static_cast<std::ptrdiff_t>(i))
      throw InputError(place(file_, header_line_), fmt::format("names the column '{}' twice", names_[i]),
                       has_numbers_for_names() ? meant() : "every column once");
}

bool CsvTable::has_numbers_for_names() const {
  return !names_.empty() && std::ranges::all_of(names_, [](const std::string& name) {
    const auto value = number_in(name);
    return value && !std::isnan(*value);
  });
}

std::string CsvTable::meant() const {
  constexpr std::array<std::pair<char, std::string_view>, 5> kDelimiters = {
      {{';', ";"}, {'\t', "\\t"}, {',', ","}, {'|', "|"}, {' ', "whitespace"}}};
  for (const auto& [delimiter, word] : kDelimiters) {
    CsvFormat other = format_;
    other.delimiter = delimiter;
    const std::size_t cells = CellScanner(other).cells(first_line_).size();
    if (columns_ == 1 && cells > 1)
      return fmt::format("delimiter = \"{}\" in recording.toml, by which the first line has {} cells", word,
                         cells);
  }
  if (has_numbers_for_names())
    return "header = false in recording.toml and columns by number, as the first line holds numbers";
  return {};
}

std::optional<std::size_t> CsvTable::column_named(std::string_view name) const {
  const auto found = std::find(names_.begin(), names_.end(), name);
  if (found == names_.end()) return std::nullopt;
  return static_cast<std::size_t>(found - names_.begin());
}

}  // namespace trundle
