#include "trundle/slam/localization/sighted_pairs.hpp"

#include <algorithm>
#include <cmath>

namespace trundle::slam {
namespace {

// A baseline of fewer sigmas says too little of where two points lie to each other: the heading that follows
// from it is unsure by more than 1/5 rad, beyond which the linearised fit is none.
constexpr double kLeastBaseline = 5.0;  // [σ]

struct RatedPair {
  SightedPair pair;
  double work;  ///< what is left to try
};

bool are_one_landmark(const SightedPoint& a, const SightedPoint& b) {
  return a.landmark != kUnknownLandmark && a.landmark == b.landmark;
}

/// In how many ways the map may have a pair.
double ways(const SightedPair& pair, const LocalMap& seen, const KnownMap& map) {
  const auto has_name = [&](std::size_t i) { return seen.points()[i].landmark != kUnknownLandmark; };
  if (has_name(pair.first) && has_name(pair.second)) return 1.0;
  const double both_ways = 2.0 * static_cast<double>(map.pairs(pair.low_m, pair.high_m).size());
  const bool is_one_known = has_name(pair.first) || has_name(pair.second);
  return is_one_known ? both_ways / static_cast<double>(map.size()) : both_ways;
}

/// Eq. 47a: what the baseline is unsure of grows with the distance of the others over its length.
double work_of(const SightedPair& pair, const LocalMap& seen, const KnownMap& map) {
  const auto points = seen.points();
  const Vector2 middle = 0.5 * (points[pair.first].in_body + points[pair.second].in_body);
  double squares = 0.0;
  for (const SightedPoint& point : points) squares += (point.in_body - middle).squaredNorm();
  const double distance2 = squares / static_cast<double>(points.size());
  return ways(pair, seen, map) * (1.0 + distance2 / (pair.baseline_m * pair.baseline_m));
}

SightedPair pair_of(std::size_t first, std::size_t second, const LocalMap& seen, const KnownMap& map,
                    const MapSightOptions& options) {
  const SightedPoint& a = seen.points()[first];
  const SightedPoint& b = seen.points()[second];
  const Vector2 apart = b.in_body - a.in_body;
  SightedPair pair{.first = first, .second = second, .baseline_m = apart.norm()};
  const Vector2 along = apart.normalized();
  pair.first_variance = along.dot(a.covariance * along);
  pair.second_variance = along.dot(b.covariance * along);
  const double reach = std::sqrt(options.gate * pair.variance()) + 2.0 * std::sqrt(map.largest_variance());
  pair.low_m = pair.baseline_m - reach;
  pair.high_m = pair.baseline_m + reach;
  return pair;
}

}  // namespace

std::vector<SightedPair> rarest_pairs(const LocalMap& seen, const KnownMap& map,
                                      const MapSightOptions& options) {
  const auto points = seen.points();
  std::vector<RatedPair> rated;
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t j = i + 1; j < points.size(); ++j) {
      if (points[j].step != seen.now() || are_one_landmark(points[i], points[j])) continue;
      if (!is_usable(points[i], map) || !is_usable(points[j], map)) continue;
      const SightedPair pair = pair_of(i, j, seen, map, options);
      if (pair.baseline_m > kLeastBaseline * std::sqrt(pair.variance()))
        rated.push_back({pair, work_of(pair, seen, map)});
    }
  std::ranges::stable_sort(rated, {}, &RatedPair::work);

  std::vector<SightedPair> apart;
  std::vector<SightedPair> others;
  std::vector<bool> is_taken(points.size(), false);
  for (const auto& [pair, work] : rated) {
    if (is_taken[pair.first] || is_taken[pair.second]) {
      others.push_back(pair);
      continue;
    }
    apart.push_back(pair);
    is_taken[pair.first] = is_taken[pair.second] = true;
  }
  apart.insert(apart.end(), others.begin(), others.end());
  if (apart.size() > options.most_pairs) apart.resize(options.most_pairs);
  return apart;
}

}  // namespace trundle::slam
