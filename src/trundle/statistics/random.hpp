#pragma once

#include <array>
#include <cstdint>

#include "trundle/namespaces.hpp"

namespace trundle::statistics {

/// Random numbers that are the same everywhere: xoshiro256++ [Blackman & Vigna 2021] seeded by splitmix64,
/// and a normal transform of our own, so nothing depends on the standard library's distributions. A copy
/// continues independently; equal (seed, stream) give equal numbers, different streams are unrelated.
class Random {
 public:
  explicit Random(std::uint64_t seed, std::uint64_t stream = 0);

  std::uint64_t bits();
  /// Uniform in [0, 1), all 53 bits.
  double uniform();
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  /// Uniform in 0 ... count − 1; count > 0.
  std::uint64_t below(std::uint64_t count);
  /// Standard normal, by inversion: one draw of bits() for each number.
  double normal();
  double normal(double sigma) { return sigma == 0.0 ? 0.0 : sigma * normal(); }

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.state_);
  }

 private:
  std::array<std::uint64_t, 4> state_{};
};

/// The z with P(N(0, 1) < z) = p, 0 < p < 1, to 1e-15 relative [Wichura 1988, AS 241].
[[nodiscard]] double normal_quantile(double p);

}  // namespace trundle::statistics
