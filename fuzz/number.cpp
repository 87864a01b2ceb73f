// A number as text, by the fast path and by the tolerant one: what is read has the bits of strtod.
#include "trundle/recording/csv/number.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "input.hpp"

namespace {

constexpr std::size_t kLongest = 64;  // characters of a number

/// The input as a line at the very end of the memory: what reads beyond it is found.
using Line = std::array<char, kLongest + 1>;

/// Digits for the bytes that are not ASCII: else few inputs are numbers of more than some digits.
char* write_line(std::string_view text, Line& line) {
  line.back() = '\n';
  return &*std::transform(text.rbegin(), text.rend(), line.rbegin() + 1, [](char c) {
             const auto byte = static_cast<unsigned char>(c);
             return byte < 128 ? c : static_cast<char>('0' + byte % 10);
           }).base();
}

/// `value` was read from what stands between.
void require_bits_of_strtod(char* first, char* last, double value) {
  const char next = std::exchange(*last, '\0');
  char* end = nullptr;
  const double expected = std::strtod(first, &end);
  *last = next;
  trundle::fuzz::require(end == last);
  trundle::fuzz::require(std::isnan(expected)
                             ? std::isnan(value)
                             : std::bit_cast<std::uint64_t>(value) == std::bit_cast<std::uint64_t>(expected));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace trundle::recording;
  Line line;
  char* const first = write_line(trundle::fuzz::text_of(data, std::min(size, kLongest)), line);
  const auto writable = [&](const char* p) { return first + (p - first); };
  Decimal decimal;
  if (const char* const end = read_decimal(first, decimal); end != nullptr && is_one_division(decimal))
    require_bits_of_strtod(first, writable(end), value_of(decimal));
  double value = 0.0;
  if (const char* const end = read_any_number(first, &line.back(), value); end != first)
    require_bits_of_strtod(first, writable(end), value);
  return 0;
}
