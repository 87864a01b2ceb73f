#include "trundle/calibration/noise/level_search.hpp"

#include <algorithm>
#include <cmath>

#include "trundle/statistics/minimum.hpp"

namespace trundle::calibration {
namespace {

// To which the logarithm of a level is sought: far within the 5 % that 200 residuals tell it to.
constexpr double kFinestLog = 0.02;
// How far from where a round found it the next one looks for its logarithm: levels are little correlated.
constexpr double kNearLog = 1.0;

}  // namespace

double least_log(double low, double high, const std::function<double(double)>& at) {
  return statistics::minimum_within({std::log(low), std::log(high), kFinestLog}, at);
}

double consistent_level(double low, double high, int halvings, const std::function<double(double)>& size) {
  double log_low = std::log(low), log_high = std::log(high);
  for (int i = 0; i < halvings; ++i) {
    const double middle = 0.5 * (log_low + log_high);
    (size(std::exp(middle)) > 1.0 ? log_low : log_high) = middle;
  }
  return std::exp(log_high);
}

void improve(std::span<const FreeLevel> free, int rounds, const Deviance& deviance, NoiseLevels& levels,
             Search first) {
  for (int round = 0; round < rounds; ++round) {
    const bool everywhere = round == 0 && first == Search::everywhere;
    double moved = 0.0;
    for (const FreeLevel& one : free) {
      NoiseLevels candidate = levels;
      double& level = one.of(candidate);
      const double before = one.of(levels), near = std::exp(kNearLog);
      const double low = everywhere ? one.low : std::max(one.low, before / near);
      const double high = everywhere ? one.high : std::min(one.high, before * near);
      if (!(low < high)) continue;
      const double ratio = one.along ? one.along(levels) / before : 0.0;
      one.of(levels) = std::exp(least_log(low, high, [&](double log_level) {
        level = std::exp(log_level);
        if (one.along) one.along(candidate) = ratio * level;
        return deviance(candidate);
      }));
      if (one.along) one.along(levels) = ratio * one.of(levels);
      moved = std::max(moved, std::abs(std::log(one.of(levels) / before)));
    }
    if (!everywhere && moved < 2.0 * kFinestLog) return;
  }
}

}  // namespace trundle::calibration
