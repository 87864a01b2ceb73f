#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "trundle/namespaces.hpp"

namespace trundle::statistics {

/// The one of `count` values, none of them NaN, that `n` come before in order; `value`: a function of the
/// index, asked four times for each. Nothing is copied: digit by digit of its bits, which are ordered as the
/// values are, all those are counted that share the digits found so far.
template <class Value>
[[nodiscard]] double nth_smallest(std::size_t count, std::size_t n, const Value& value) {
  constexpr int kBits = 64, kDigit = 16;
  constexpr std::uint64_t kSign = 1ULL << (kBits - 1);
  std::uint64_t found = 0;
  std::vector<std::size_t> with(1 << kDigit);
  for (int shift = kBits - kDigit; shift >= 0; shift -= kDigit) {
    with.assign(with.size(), 0);
    const auto known = [&](std::uint64_t bits) {
      return shift + kDigit == kBits ? 0 : bits >> (shift + kDigit);
    };
    for (std::size_t i = 0; i < count; ++i) {
      const auto bits = std::bit_cast<std::uint64_t>(static_cast<double>(value(i)));
      const std::uint64_t ordered = (bits & kSign) != 0 ? ~bits : bits | kSign;
      if (known(ordered) == known(found)) ++with[(ordered >> shift) % with.size()];
    }
    std::size_t digit = 0;
    for (; n >= with[digit]; ++digit) n -= with[digit];
    found |= static_cast<std::uint64_t>(digit) << shift;
  }
  return std::bit_cast<double>((found & kSign) != 0 ? found & ~kSign : ~found);
}

}  // namespace trundle::statistics
