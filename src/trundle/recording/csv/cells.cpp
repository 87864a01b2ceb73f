#include "trundle/recording/csv/detail/cells.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "trundle/recording/csv/number.hpp"

namespace trundle::recording {
namespace {

constexpr double kEmpty = std::numeric_limits<double>::quiet_NaN();

bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\r';
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

bool means_not_measured(std::string_view cell) {
  constexpr std::array<std::string_view, 6> kWords = {"", "nan", "null", "na", "n/a", "none"};
  std::string lower(cell);
  std::transform(lower.begin(), lower.end(), lower.begin(), [](unsigned char c) { return std::tolower(c); });
  return std::find(kWords.begin(), kWords.end(), lower) != kWords.end();
}

/// Past the quote that ends the cell; a doubled one is part of it.
std::size_t end_of_quoted(std::string_view line, std::size_t begin) {
  std::size_t end = begin + 1;
  while (end < line.size() && (line[end] != '"' || line.substr(end + 1, 1) == "\""))
    end += line[end] == '"' ? 2 : 1;
  return std::min(end + 1, line.size());
}

}  // namespace

bool CellScanner::is_skipped(std::string_view line) const {
  const std::string_view content = trimmed(line);
  return content.empty() || (format_.comment != '\0' && content.front() == format_.comment);
}

std::string_view CellScanner::take(std::string_view& line) const {
  const bool spaces = format_.delimiter == ' ';
  const auto is_delimiter = [&](char c) { return spaces ? c == ' ' || c == '\t' : c == format_.delimiter; };
  std::size_t begin = 0;
  while (begin < line.size() && is_blank(line[begin]) && (spaces || !is_delimiter(line[begin]))) ++begin;
  std::size_t end = begin;
  const bool quoted = begin < line.size() && line[begin] == '"';
  if (quoted) end = end_of_quoted(line, begin);
  end = static_cast<std::size_t>(
      std::find_if(line.begin() + static_cast<std::ptrdiff_t>(end), line.end(), is_delimiter) - line.begin());
  std::string_view cell = trimmed(line.substr(begin, end - begin));
  if (quoted && cell.size() >= 2 && cell.back() == '"') cell = trimmed(cell.substr(1, cell.size() - 2));
  std::string_view rest = line.substr(std::min(end, line.size()));
  if (spaces) rest = trimmed(rest);
  const bool more = !rest.empty();
  if (more && !spaces) rest.remove_prefix(1);
  line = more ? rest : std::string_view();
  return cell;
}

std::string text_in(std::string_view cell) {
  std::string text;
  for (std::size_t i = 0; i < cell.size(); ++i) {
    text += cell[i];
    if (cell.substr(i, 2) == "\"\"") ++i;
  }
  return text;
}

std::vector<std::string> CellScanner::cells(std::string_view line) const {
  std::vector<std::string> cells;
  while (line.data() != nullptr) cells.push_back(text_in(take(line)));
  return cells;
}

std::optional<double> number_in(std::string_view cell) {
  if (means_not_measured(cell)) return kEmpty;
  double value = 0.0;
  const char* const end = cell.data() + cell.size();
  if (read_any_number(cell.data(), end, value) != end) return std::nullopt;
  return std::isfinite(value) ? value : kEmpty;
}

namespace {

__extension__ using Wide = __int128;

/// difference · 10^−places, rounded once.
double in_seconds(Wide difference, int places) {
  const bool negative = difference < 0;
  const Wide magnitude = negative ? -difference : difference;
  const Decimal decimal{static_cast<std::uint64_t>(magnitude), places, negative};
  if (magnitude <= Wide{1} << 53U && is_one_division(decimal)) return value_of(decimal);
  double value = static_cast<double>(magnitude) / kExactPowerOfTen[static_cast<std::size_t>(places)];
  if (magnitude == Wide{decimal.mantissa}) {
    const std::string text = fmt::format("{}e-{}", decimal.mantissa, places);
    read_any_number(text.data(), text.data() + text.size(), value);
  }
  return negative ? -value : value;
}

}  // namespace

double seconds_of(std::int64_t nanoseconds, std::int64_t origin_s) {
  constexpr int kPlaces = 9;  // of nanoseconds in a second
  return in_seconds(Wide{nanoseconds} - Wide{origin_s} * 1'000'000'000, kPlaces);
}

std::optional<double> stamp_in(std::string_view cell, const TimeScale& scale) {
  if (means_not_measured(cell)) return kEmpty;
  // Exactly, in integers: mantissa − origin · 10^places, places = digits after the point once in seconds.
  constexpr int kMostPlaces = 18;
  const std::string text = std::string(cell) + '\n';
  Decimal stamp;
  const char* const end = read_decimal(text.c_str(), stamp);
  const int places = stamp.fraction - scale.unit_exponent;
  if (end == text.c_str() + cell.size() && places <= kMostPlaces) {
    Wide power = 1;
    for (int i = 0; i < places; ++i) power *= 10;
    const Wide mantissa = stamp.mantissa;
    return in_seconds((stamp.negative ? -mantissa : mantissa) - power * scale.origin_s, places);
  }
  const std::optional<double> value = number_in(cell);
  if (!value) return value;
  const double unit = kExactPowerOfTen[static_cast<std::size_t>(-scale.unit_exponent)];
  return *value / unit - static_cast<double>(scale.origin_s);
}

}  // namespace trundle::recording
