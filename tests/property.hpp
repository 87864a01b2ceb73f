#pragma once

#include <cstdint>
#include <cstdlib>

#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

namespace trundle::test {

// Properties run with one seed, the same everywhere; RC_PARAMS in the environment asks for others.
inline const bool kSeeded = ::setenv("RC_PARAMS", "seed=20 max_success=200", 0) == 0;

/// Uniform in [low, high), to full precision.
inline rc::Gen<double> uniform(double low, double high) {
  const auto bits = rc::gen::noShrink(rc::gen::resize(rc::kNominalSize, rc::gen::arbitrary<std::uint64_t>()));
  return rc::gen::map(
      bits, [=](std::uint64_t b) { return low + (high - low) * (static_cast<double>(b >> 11U) * 0x1p-53); });
}

}  // namespace trundle::test
