#include "trundle/slam/smoothing/re_association.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include <Eigen/LU>

#include "trundle/slam/association/association.hpp"
#include "trundle/slam/association/existence.hpp"
#include "trundle/slam/association/landmark_grid.hpp"

namespace trundle::slam {
namespace {

// Further away no landmark is a candidate: at NIS 25 a match costs more than none (eq. 16) for every sensor
// with max_range / (range_sigma · bearing_sigma) below e^12.5 = 3e5 /rad.
constexpr double kSigmas = 5.0;

/// −2 log of the density of a reading that shows nothing of the map.
double cost_of_none(const LandmarkSensor& sensor) {
  return cost_of_new({.max_range_m = sensor.max_range_m});
}

/// A map in a grid.
LandmarkGrid placed(std::span<const MappedLandmark> map, const LandmarkSensor& sensor) {
  LandmarkGrid grid(kCellShare * sensor.max_range_m);
  for (std::size_t i = 0; i < map.size(); ++i) grid.put(i, map[i].position);
  return grid;
}

double sigma_of(const MappedLandmark& landmark) {
  return std::sqrt(landmark.covariance.trace());
}

/// Pairs that were seen in one instant: two landmarks.
std::set<LandmarkPair> seen_together(const ShownObservations& shown) {
  std::set<LandmarkPair> pairs;
  for (const auto& step : shown)
    for (const Observation& a : step)
      for (const Observation& b : step)
        if (a.landmark >= 0 && a.landmark < b.landmark) pairs.emplace(a.landmark, b.landmark);
  return pairs;
}

/// At how many instants the sensor saw each landmark, and at how many it looked there: eq. 14a.
class Detections {
 public:
  Detections(const ShownObservations& shown, const SmoothedSlam& smoothed, const LandmarkSensor& sensor)
      : counts_(smoothed.map.size()) {
    Visibility view(sensor.max_range_m);
    for (const auto& step : shown)
      for (const Observation& observation : step)
        if (is_valid(observation)) view.add_seen(observation.range_m, observation.bearing_rad);
    const LandmarkGrid map = placed(smoothed.map, sensor);
    std::vector<std::size_t> near;
    for (std::size_t k = 0; k < shown.size(); ++k) {
      if (shown[k].empty()) continue;
      const Pose2& pose = smoothed.trajectory.poses[k].pose;
      map.near((pose * sensor.body_from_sensor).translation(), view.reach_m(), smoothed.map.size(), near);
      for (const std::size_t i : near) {
        const MappedLandmark& landmark = smoothed.map[i];
        const ExpectedReading there = expected_reading(pose, sensor.body_from_sensor, landmark.position);
        if (!view.covers(there.range_m, there.bearing_rad)) continue;
        const bool seen = std::ranges::find(shown[k], landmark.id, &Observation::landmark) != shown[k].end();
        (seen ? counts_[i].seen : counts_[i].missed) += 1.0;
      }
    }
  }

  /// −2 log of how probable the numbers are, any rate of detection being as probable as another.
  [[nodiscard]] double cost() const {
    double cost = 0.0;
    for (const Count& count : counts_)
      cost += 2.0 * (std::lgamma(count.seen + count.missed + 2.0) - std::lgamma(count.seen + 1.0) -
                     std::lgamma(count.missed + 1.0));
    return cost;
  }
  /// −2 log of the odds of seeing that one of the map.
  [[nodiscard]] double cost_of_seeing(std::size_t landmark) const {
    return -2.0 * std::log((counts_[landmark].seen + 1.0) / (counts_[landmark].missed + 1.0));
  }

 private:
  struct Count {
    double seen = 0.0;
    double missed = 0.0;
  };
  std::vector<Count> counts_;  ///< of each landmark of the map
};

/// What a sighting may show, from a smoothed pose.
class Candidates {
 public:
  Candidates(const ShownObservations& shown, const SmoothedSlam& smoothed, const LandmarkSensor& sensor)
      : smoothed_(smoothed),
        sensor_(sensor),
        R_(reading_covariance(sensor)),
        map_(placed(smoothed.map, sensor)),
        detections_(shown, smoothed, sensor) {}

  std::vector<Fit> fits(std::size_t step, const Observation& observation) {
    const Pose2& pose = smoothed_.trajectory.poses[step].pose;
    const SightedLandmark there = sighted_landmark(pose, sensor_.body_from_sensor, observation);
    const Matrix2 spread = there.spread(R_);
    map_.near(there.in_world, kSigmas * std::sqrt(spread.trace()), kMostShown, near_);
    std::vector<Fit> fits;
    for (const std::size_t i : near_) {
      const MappedLandmark& m = smoothed_.map[i];
      const ExpectedReading expected = expected_reading(pose, sensor_.body_from_sensor, m.position);
      const Vector2 innovation = innovation_of(observation, expected);
      const double nis = innovation.dot(R_.inverse() * innovation);
      fits.push_back({m.id, nis, nis + cost_at_peak(R_) + detections_.cost_of_seeing(i)});
    }
    return fits;
  }

 private:
  const SmoothedSlam& smoothed_;
  const LandmarkSensor& sensor_;
  Matrix2 R_;
  LandmarkGrid map_;
  Detections detections_;
  std::vector<std::size_t> near_;
};

}  // namespace

// Eq. 14.
double cost_of_explaining(const ShownObservations& shown, const SmoothedSlam& smoothed,
                          const LandmarkSensor& sensor) {
  const double none = cost_of_none(sensor);
  const double density = cost_at_peak(reading_covariance(sensor));
  std::set<LandmarkId> landmarks;
  double cost = Detections(shown, smoothed, sensor).cost();
  for (const auto& step : shown)
    for (const Observation& observation : step) {
      if (!is_valid(observation)) continue;
      const bool is_first = observation.landmark >= 0 && landmarks.insert(observation.landmark).second;
      cost += observation.landmark < 0 || is_first ? none : density;
    }
  return cost;
}

// Eq. 15.
std::vector<LandmarkPair> duplicates_in(const ShownObservations& shown, std::span<const MappedLandmark> map,
                                        const LandmarkSensor& sensor, LandmarkId first_unidentified,
                                        const DifferenceCovariance& covariance) {
  const std::set<LandmarkPair> different = seen_together(shown);
  const double gate = AssociationOptions{}.gate;
  const double anywhere = cost_of_any_place(sensor.max_range_m);
  LandmarkGrid grid = placed(map, sensor);
  std::vector<std::pair<double, LandmarkPair>> alike;
  std::vector<std::size_t> near;
  for (const MappedLandmark& a : map) {
    const double sigma_m = sigma_of(a);
    grid.near(a.position, kDuplicateSigmas * sigma_m, map.size(), near);
    for (const std::size_t j : near) {
      const MappedLandmark& b = map[j];
      const bool is_surer = std::pair(sigma_of(b), b.id) < std::pair(sigma_m, a.id);
      const LandmarkPair pair = std::minmax(a.id, b.id);
      if (!is_surer || pair.second < first_unidentified || different.contains(pair)) continue;
      const Vector2 apart = b.position - a.position;
      const Matrix2 most = 2.0 * (a.covariance + b.covariance);  // C is no larger, however they correlate
      if (apart.dot(most.inverse() * apart) > gate) continue;
      const Matrix2 C = covariance(a.id, b.id);
      const double squared = apart.dot(C.inverse() * apart);
      const double cost = squared + cost_at_peak(C);
      if (squared <= gate && cost < anywhere) alike.push_back({cost, pair});
    }
  }
  std::ranges::sort(alike);
  std::set<LandmarkId> taken;
  std::vector<LandmarkPair> pairs;
  for (const auto& [cost, pair] : alike) {
    if (taken.contains(pair.first) || taken.contains(pair.second)) continue;
    taken.insert({pair.first, pair.second});
    pairs.push_back(pair);
  }
  return pairs;
}

ShownObservations with_merged(ShownObservations shown, std::span<const LandmarkPair> pairs) {
  for (auto& step : shown)
    for (Observation& observation : step) {
      const auto pair = std::ranges::find(pairs, observation.landmark, &LandmarkPair::second);
      if (pair != pairs.end()) observation.landmark = pair->first;
    }
  return shown;
}

// Eq. 16.
ShownObservations reassociated(ShownObservations shown, const SlamInput& input, const SmoothedSlam& smoothed,
                               const LandmarkSensor& sensor) {
  Candidates candidates(shown, smoothed, sensor);
  const AssociationOptions options{.gate = cost_of_none(sensor) - cost_at_peak(reading_covariance(sensor)),
                                   .max_range_m = sensor.max_range_m};
  for (std::size_t k = 0; k < shown.size(); ++k) {
    const std::vector<Observation>& seen = input.steps[k].observations;
    std::vector<Observation*> unidentified;
    std::vector<std::vector<Fit>> fits;
    for (std::size_t i = 0; i < seen.size(); ++i) {
      if (!is_valid(seen[i]) || seen[i].landmark >= 0) continue;
      unidentified.push_back(&shown[k][i]);
      fits.push_back(candidates.fits(k, seen[i]));
      std::erase_if(fits.back(), [&](const Fit& fit) {
        return std::ranges::find(seen, fit.landmark, &Observation::landmark) != seen.end();
      });
    }
    const std::vector<Associated> found = associate(fits, options);
    for (std::size_t i = 0; i < unidentified.size(); ++i) unidentified[i]->landmark = found[i].landmark;
  }
  return shown;
}

bool are_same_associations(const ShownObservations& a, const ShownObservations& b) {
  return std::ranges::equal(a, b, [](const auto& one, const auto& other) {
    return std::ranges::equal(one, other, {}, &Observation::landmark, &Observation::landmark);
  });
}

}  // namespace trundle::slam
