#pragma once

#include <array>
#include <cstdint>

#include "trundle/namespaces.hpp"

namespace trundle::recording {

/// A decimal number as it is written: ±mantissa · 10^−fraction, exactly.
struct Decimal {
  std::uint64_t mantissa = 0;
  int fraction = 0;  ///< digits after the point
  bool negative = false;
};

/// Powers of ten that a double holds exactly.
inline constexpr std::array<double, 23> kExactPowerOfTen = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                                            1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                                            1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

/// Reads an optional minus sign, digits, and an optional point with digits. `first` must be followed by a
/// character that is neither digit nor point before the end of the memory (a line end). Returns where it
/// stopped; nullptr when there is no digit, or more digits than a mantissa surely holds.
inline const char* read_decimal(const char* first, Decimal& decimal) {
  constexpr int kMostDigits = 19;
  decimal.negative = *first == '-';
  const char* p = first + (decimal.negative ? 1 : 0);
  const char* const digits = p;
  std::uint64_t mantissa = 0;
  const auto take_digits = [&] {
    for (unsigned digit; (digit = static_cast<unsigned>(*p - '0')) < 10; ++p)
      mantissa = mantissa * 10 + digit;
  };
  take_digits();
  auto count = p - digits;
  decimal.fraction = 0;
  if (*p == '.') {
    const char* const fraction = ++p;
    take_digits();
    decimal.fraction = static_cast<int>(p - fraction);
    count += p - fraction;
  }
  decimal.mantissa = mantissa;
  return count > 0 && count <= kMostDigits ? p : nullptr;
}

/// Whether one division gives the double nearest to the decimal: both operands are exact and IEEE 754 rounds
/// once.
inline bool is_one_division(const Decimal& decimal) {
  constexpr std::uint64_t kExactIntegers = std::uint64_t{1} << 53;
  return decimal.mantissa <= kExactIntegers && decimal.fraction < static_cast<int>(kExactPowerOfTen.size());
}

/// The nearest double; the decimal must be_one_division().
inline double value_of(const Decimal& decimal) {
  const double magnitude =
      static_cast<double>(decimal.mantissa) / kExactPowerOfTen[static_cast<std::size_t>(decimal.fraction)];
  return decimal.negative ? -magnitude : magnitude;
}

/// Any decimal floating-point text, the same bits as strtod: signs, exponents, any number of digits,
/// denormals, inf and nan. Returns where it stopped, `first` when there is no number.
const char* read_any_number(const char* first, const char* last, double& value);

}  // namespace trundle::recording
