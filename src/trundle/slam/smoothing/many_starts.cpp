#include "trundle/slam/smoothing/many_starts.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <tuple>
#include <vector>

#include "trundle/io/error.hpp"
#include "trundle/slam/smoothing/re_association.hpp"

namespace trundle::slam {
namespace {

/// Which landmark of another run is which of `filtered`, if it is any: the one that most of its sightings
/// were taken for there.
std::map<LandmarkId, LandmarkId> numbers_of(const ShownObservations& shown, const SlamResult& filtered,
                                            LandmarkId first_unidentified) {
  std::map<std::pair<LandmarkId, LandmarkId>, std::size_t> sightings;  // (number, as filtered)
  for (std::size_t k = 0; k < shown.size(); ++k)
    for (std::size_t i = 0; i < shown[k].size(); ++i) {
      const LandmarkId number = shown[k][i].landmark;
      const LandmarkId filtered_as = filtered.reports[k].observations[i].landmark;
      if (number >= first_unidentified && filtered_as >= first_unidentified)
        ++sightings[{number, filtered_as}];
    }
  std::vector<std::tuple<std::size_t, LandmarkId, LandmarkId>> most_first;
  for (const auto& [pair, count] : sightings) most_first.emplace_back(count, pair.first, pair.second);
  std::ranges::sort(most_first, std::greater<>());
  std::map<LandmarkId, LandmarkId> numbers, taken;
  for (const auto& [count, number, filtered_as] : most_first)
    if (!numbers.contains(number) && taken.try_emplace(filtered_as, number).second)
      numbers[number] = filtered_as;
  return numbers;
}

void number_as(const SlamResult& filtered, LandmarkId first_unidentified, SmoothedSlam& smoothed) {
  std::map<LandmarkId, LandmarkId> numbers = numbers_of(smoothed.shown, filtered, first_unidentified);
  LandmarkId next = std::max(filtered.last_landmark() + 1, first_unidentified);
  const auto renumber = [&](LandmarkId& landmark) {
    if (landmark < first_unidentified) return;
    const auto [number, is_new] = numbers.try_emplace(landmark, next);
    next += is_new ? 1 : 0;
    landmark = number->second;
  };
  for (MappedLandmark& landmark : smoothed.map) renumber(landmark.id);
  for (auto& step : smoothed.shown)
    for (Observation& observation : step) renumber(observation.landmark);
}

/// Nothing where it finds nothing that could be smoothed.
std::optional<SmoothedSlam> smoothed_run(const SlamInput& input, const LandmarkSensor& sensor,
                                         const SlamOptions& filter, const SmootherOptions& options) {
  const SlamResult filtered = slam(input, sensor, filter);
  if (filtered.map.empty()) return std::nullopt;
  try {
    return smooth(input, sensor, filtered, options);
  } catch (const CannotAnswer&) {
    return std::nullopt;
  }
}

}  // namespace

SmoothedSlam smooth_from_many(const SlamInput& input, const LandmarkSensor& sensor,
                              const SlamResult& filtered, const SlamOptions& filter, std::size_t runs,
                              const SmootherOptions& options) {
  const auto cost_of = [&](const SmoothedSlam& smoothed) {
    const ShownFromPath robot{smoothed.shown, smoothed.trajectory, sensor};
    return smoothed.counts.cost + cost_of_explaining({&robot, 1}, smoothed.map);
  };
  SmoothedSlam best = smooth(input, sensor, filtered, options);
  if (!input.has_unidentified()) return best;
  SlamOptions other = filter;
  other.method = SlamMethod::fastslam2;
  other.keep_paths = true;
  std::size_t starts = best.counts.starts;
  for (std::size_t run = 1; run < runs; ++run) {
    other.seed = filter.seed + run;
    std::optional<SmoothedSlam> found = smoothed_run(input, sensor, other, options);
    if (!found) continue;
    starts += found->counts.starts;
    if (cost_of(*found) >= cost_of(best)) continue;
    best = std::move(*found);
    number_as(filtered, filter.first_unidentified, best);
  }
  best.counts.starts = starts;
  return best;
}

}  // namespace trundle::slam
