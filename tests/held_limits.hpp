#pragma once

#include <utility>

#include <boost/math/distributions/binomial.hpp>

namespace trundle::test {

/// Least and largest share of 95 % intervals that hold the truth: 93 to 97 % over a thousand; of fewer, what
/// the binomial itself goes beyond as rarely as 3σ (of three calibrations it is far from a normal
/// distribution).
inline std::pair<double, double> held_limits(int times) {
  using boost::math::binomial, boost::math::complement, boost::math::quantile;
  if (times >= 1000) return {0.93, 0.97};
  constexpr double kBeyond = 0.00135;
  const binomial held(times, 0.95);
  // Boost rounds outwards: as few as the first are already too rare.
  return {(quantile(held, kBeyond) + 1.0) / times, quantile(complement(held, kBeyond)) / times};
}

}  // namespace trundle::test
