#pragma once

#include <algorithm>
#include <concepts>
#include <iterator>
#include <span>
#include <utility>
#include <vector>

#include "trundle/slam/smoothing/re_association.hpp"
#include "trundle/slam/steps.hpp"

namespace trundle::slam {

/// What the sightings of each robot show, and the most probable paths and map if they do; its cost is that of
/// docs/theory/smoother.md, eq. 4, and re-association.md, eq. 14.
template <class E>
concept BatchExplanation = requires(const E& explanation, LandmarkId landmark) {
  { explanation.shown } -> std::convertible_to<std::span<const ShownObservations>>;
  { explanation.cost } -> std::convertible_to<double>;
  { explanation.robots() } -> std::convertible_to<std::vector<ShownFromPath>>;
  { explanation.map() } -> std::convertible_to<std::span<const MappedLandmark>>;
  { explanation.difference_covariance(landmark, landmark) } -> std::convertible_to<Matrix2>;
};

/// Asks again what sightings without names show, as long as that explains them better: first whether
/// landmarks are one and the same, all pairs at once, or else the clearest half of them, and so on; then each
/// instant for itself.
/// `explain(shown, best)` gives the explanation of what sightings are said to show that is near the best.
/// docs/theory/re-association.md.
template <BatchExplanation E, class Explain>
class ReAssociation {
 public:
  ReAssociation(std::span<const SlamInput* const> inputs, const Explain& explain, E first)
      : inputs_(inputs), explain_(explain), best_(std::move(first)) {}

  E improved() {
    const auto most_rounds = kMostRounds * inputs_.size();
    for (std::size_t round = 0; round < most_rounds; ++round) {
      const bool merged = merge_duplicates();
      if (!reassociate() && !merged) break;
    }
    return std::move(best_);
  }

 private:
  using AllShown = std::vector<ShownObservations>;

  /// Each round has lowered the cost; what is still to gain after so many for each robot is not worth another
  /// smoothing.
  static constexpr std::size_t kMostRounds = 5;

  static AllShown merged(AllShown shown, std::span<const LandmarkPair> pairs) {
    for (ShownObservations& by_one : shown) by_one = with_merged(std::move(by_one), pairs);
    return shown;
  }

  bool merge_duplicates() {
    double max_range_m = 0.0;
    for (const ShownFromPath& robot : best_.robots())
      max_range_m = std::max(max_range_m, robot.sensor.max_range_m);
    const std::vector<LandmarkPair> duplicates =
        duplicates_in(best_.shown, best_.map(), max_range_m, inputs_.front()->first_unidentified(),
                      [&](LandmarkId a, LandmarkId b) { return best_.difference_covariance(a, b); });
    for (std::size_t clearest = duplicates.size(); clearest > 0; clearest /= 2)
      if (is_better(merged(best_.shown, std::span(duplicates).first(clearest)))) return true;
    return false;
  }

  bool reassociate() { return is_better(reassociated(inputs_, best_.robots(), best_.map())); }

  /// Then it is the best from now on.
  bool is_better(AllShown shown) {
    if (std::ranges::equal(shown, best_.shown, are_same_associations)) return false;
    E explanation = explain_(std::move(shown), std::as_const(best_));
    if (explanation.cost >= best_.cost) return false;
    best_ = std::move(explanation);
    return true;
  }

  std::span<const SlamInput* const> inputs_;  ///< of each robot
  const Explain& explain_;
  E best_;
};

}  // namespace trundle::slam
