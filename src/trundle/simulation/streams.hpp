#pragma once

#include <cstdint>

#include "trundle/statistics/random.hpp"

namespace trundle::simulation {

/// Streams of random numbers of one simulated run: one for each cause, so that causes do not disturb each
/// other.
enum class RandomStream : std::uint64_t {
  wheels = 1,
  lateral,
  slips,
  gyro,
  gyro_bias,
  reference,
  partial,
  sightings,
  steering
};

inline Random random_for(std::uint64_t seed, RandomStream stream) {
  return Random(seed, static_cast<std::uint64_t>(stream));
}

}  // namespace trundle::simulation
