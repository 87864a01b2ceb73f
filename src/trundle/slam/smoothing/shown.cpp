#include "trundle/slam/smoothing/shown.hpp"

#include <map>
#include <set>

namespace trundle::slam {
namespace {

std::set<LandmarkId> mapped_by(const SlamResult& filtered) {
  std::set<LandmarkId> mapped;
  for (const MappedLandmark& landmark : filtered.map) mapped.insert(landmark.id);
  return mapped;
}

}  // namespace

ShownObservations shown_observations(const SlamInput& input, const SlamResult& filtered) {
  const std::set<LandmarkId> mapped = mapped_by(filtered);
  ShownObservations shown;
  for (std::size_t k = 0; k < input.steps.size(); ++k) {
    shown.push_back(input.steps[k].observations);
    for (std::size_t i = 0; i < shown.back().size(); ++i) {
      LandmarkId& landmark = shown.back()[i].landmark;
      const LandmarkId taken_for = filtered.reports[k].observations[i].landmark;
      if (landmark < 0 && mapped.contains(taken_for)) landmark = taken_for;
    }
  }
  return shown;
}

void number_unidentified(LandmarkId named, LandmarkId& next, ShownObservations& shown) {
  std::map<LandmarkId, LandmarkId> numbers;
  for (auto& step : shown)
    for (Observation& observation : step) {
      if (observation.landmark < named) continue;
      const auto [at, is_new] = numbers.try_emplace(observation.landmark, next);
      next += is_new ? 1 : 0;
      observation.landmark = at->second;
    }
}

}  // namespace trundle::slam
