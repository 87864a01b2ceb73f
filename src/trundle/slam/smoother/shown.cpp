#include "trundle/slam/smoother/shown.hpp"

namespace trundle {
namespace {

/// Numbers of the landmarks that the filter's map still has.
std::vector<bool> mapped_by(const SlamResult& filtered) {
  std::vector<bool> mapped;
  for (const MappedLandmark& landmark : filtered.map) {
    const auto id = static_cast<std::size_t>(landmark.id);
    if (id >= mapped.size()) mapped.resize(id + 1, false);
    mapped[id] = true;
  }
  return mapped;
}

LandmarkId shown_by(const Observation& observation, const ObservationReport& report,
                    const std::vector<bool>& mapped) {
  if (observation.landmark >= 0 || report.landmark < 0) return observation.landmark;
  const auto id = static_cast<std::size_t>(report.landmark);
  return id < mapped.size() && mapped[id] ? report.landmark : kUnknownLandmark;
}

}  // namespace

ShownObservations shown_observations(const SlamInput& input, const SlamResult& filtered) {
  const std::vector<bool> mapped = mapped_by(filtered);
  ShownObservations shown;
  for (std::size_t k = 0; k < input.steps.size(); ++k) {
    shown.push_back(input.steps[k].observations);
    for (std::size_t i = 0; i < shown.back().size(); ++i)
      shown.back()[i].landmark = shown_by(shown.back()[i], filtered.reports[k].observations[i], mapped);
  }
  return shown;
}

}  // namespace trundle
