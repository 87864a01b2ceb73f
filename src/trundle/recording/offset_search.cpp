#include "trundle/recording/detail/offset_search.hpp"

#include <algorithm>
#include <cmath>

namespace trundle::recording {

std::vector<TimeOffset> offsets_of(std::span<const Recording> recordings, const OffsetOf& offset_of) {
  std::vector<TimeOffset> offsets;
  for (const Recording& recording : recordings)
    if (const auto offset = offset_of(recording)) offsets.push_back(*offset);
  return offsets;
}

std::optional<TimeOffset> mean_of(std::span<const TimeOffset> offsets) {
  if (offsets.empty()) return std::nullopt;
  double weights = 0.0;
  double sum = 0.0;
  for (const TimeOffset& offset : offsets) {
    const double weight = 1.0 / (offset.sigma_s * offset.sigma_s);
    weights += weight;
    sum += weight * offset.offset_s;
  }
  return TimeOffset{.offset_s = sum / weights, .sigma_s = 1.0 / std::sqrt(weights)};
}

bool is_off(const TimeOffset& found, double given_s) {
  return std::abs(found.offset_s - given_s) > std::max(found.least_s, kSignificant * found.sigma_s);
}

std::optional<TimeOffset> find_offset(ClockComparison comparison) {
  const OffsetSearch& search = comparison.search;
  Comparer compare(std::move(comparison.clocks));
  const std::optional<double> offset = settled_offset(compare, search);
  if (!offset) return std::nullopt;
  const Comparison here = compare.at(*offset);
  const Comparison before = compare.at(*offset - search.change_s),
                   after = compare.at(*offset + search.change_s);
  const double sigma = std::hypot(sigma_of({before, here, after, search.change_s}), search.least_sigma_s);
  const bool told = speak_of_one_motion(here, search) && sigma <= search.largest_sigma_s &&
                    std::abs(*offset - search.given_s) <= search.largest_s;
  if (!told) return std::nullopt;
  return TimeOffset{*offset, sigma, here.correlation()};
}

}  // namespace trundle::recording
