#pragma once

#include <functional>
#include <span>

#include "trundle/calibration/problem/noise_levels.hpp"

namespace trundle::calibration {

/// A level that is looked for, and between what.
struct FreeLevel {
  double& (*of)(NoiseLevels&);
  double low, high;
  double& (*along)(NoiseLevels&) = nullptr;  ///< one that keeps its ratio to this one meanwhile
};

/// −2 log likelihood of levels.
using Deviance = std::function<double(const NoiseLevels&)>;

/// The logarithm between those of `low` and `high` at which a function of it is least.
[[nodiscard]] double least_log(double low, double high, const std::function<double(double)>& at);

/// The level between two at which `size` of residuals, which falls with it, is 1: by so many halvings of what
/// its logarithm may be; the larger end of what is left.
[[nodiscard]] double consistent_level(double low, double high, int halvings,
                                      const std::function<double(double)>& size);

/// Where levels are looked for at first: wherever they may be, or near where they are.
enum class Search { everywhere, nearby };

/// Makes the deviance least: one level after the other by Brent's method, in so many rounds, or until none
/// moves any more. docs/theory/calibration-noise.md.
void improve(std::span<const FreeLevel> free, int rounds, const Deviance& deviance, NoiseLevels& levels,
             Search first = Search::everywhere);

}  // namespace trundle::calibration
