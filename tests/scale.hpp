#pragma once

#include <algorithm>
#include <cstdlib>

namespace trundle::test {

/// How many trials a statistical test makes: `full`, times $TRUNDLE_TEST_SCALE where it is set (0 < scale <=
/// 1; 0.25 for ./run test, 0.005 for the preset `asan`, because sanitizers slow the arithmetic down), but
/// never fewer than `least`. Limits must be derived from the number that this returns.
inline int trials(int full, int least = 20) {
  const char* scale = std::getenv("TRUNDLE_TEST_SCALE");
  return scale == nullptr ? full : std::max(least, static_cast<int>(full * std::atof(scale)));
}

/// Under them what is the same arithmetic once more is left out.
#ifdef __SANITIZE_ADDRESS__
constexpr bool kSanitizers = true;
#else
constexpr bool kSanitizers = false;
#endif

}  // namespace trundle::test

/// Skips the test under sanitizers, and says so: a long calculation, of code that other tests bring to them.
#define TRUNDLE_NOT_UNDER_SANITIZERS() \
  if (trundle::test::kSanitizers) GTEST_SKIP() << "this test takes too long under sanitizers"
