#include "trundle/recording/detail/offset_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

namespace trundle::recording {
namespace {

constexpr std::array kSmoothedOver_s = {2.0, 1.0, 0.5, 0.0};

/// Two clocks at the offset that leaves least, in windows where no wheel slips.
struct Settled {
  Comparer compare;
  OffsetSearch search;
  std::vector<bool> all;  ///< windows, those with slip too
  double offset_s = 0.0;
};

Settled settle(ClockComparison comparison, double smoothed_over_s) {
  Settled settled{.compare = Comparer(std::move(comparison.clocks)), .search = comparison.search, .all = {}};
  const OffsetSearch& search = settled.search;
  settled.all = settled.compare.windows();
  const double step_s = std::max(search.step_s, 0.25 * smoothed_over_s);
  settled.offset_s = search_from(settled.compare, search.given_s, search.largest_s - step_s, step_s);
  settled.compare.leave_out_slip(settled.offset_s);
  return settled;
}

/// By more than the least of some rough sums is less by chance, in the windows of the first: the other may
/// have left out as slip what it cannot follow.
bool leaves_less(Settled& here, Settled& there) {
  constexpr double kLess = 1.0;  // sigmas
  there.compare.use(here.compare.windows());
  const Comparison other = there.compare.at(there.offset_s);
  here.compare.use(there.compare.windows());
  return leaves_less(here.compare.at(here.offset_s), other, kLess);
}

std::optional<TimeOffset> offset_by(Comparer compare, const OffsetSearch& search) {
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

}  // namespace

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
  return offset_by(Comparer(std::move(comparison.clocks)), comparison.search);
}

std::optional<TimeOffset> find_offset_of_noisy(
    const std::function<std::optional<ClockComparison>(double over_s)>& smoothed_over) {
  std::optional<Settled> best;
  for (const double over_s : kSmoothedOver_s) {
    std::optional<ClockComparison> comparison = smoothed_over(over_s);
    if (!comparison) return std::nullopt;
    Settled settled = settle(*std::move(comparison), over_s);
    if (!best || leaves_less(settled, *best)) best.emplace(std::move(settled));
  }
  best->compare.use(best->all);
  return offset_by(std::move(best->compare), best->search);
}

}  // namespace trundle::recording
