#pragma once

#include <algorithm>
#include <cstdlib>

namespace trundle::test {

/// How many trials a statistical test makes: `full`, times $TRUNDLE_TEST_SCALE where it is set (0 < scale <=
/// 1; the preset `asan` sets 0.005, because sanitizers slow the arithmetic down), but never fewer than
/// `least`. Limits must be derived from the number that this returns.
inline int trials(int full, int least = 20) {
  const char* scale = std::getenv("TRUNDLE_TEST_SCALE");
  return scale == nullptr ? full : std::max(least, static_cast<int>(full * std::atof(scale)));
}

}  // namespace trundle::test

/// Skips the test, and says so, where trials are scaled down: a long calculation that nothing scales, of code
/// that other tests bring to the sanitizers.
#define TRUNDLE_NEEDS_ALL_TRIALS()     \
  if (trundle::test::trials(2, 1) < 2) \
  GTEST_SKIP() << "TRUNDLE_TEST_SCALE is set: this test takes long and nothing in it scales"
