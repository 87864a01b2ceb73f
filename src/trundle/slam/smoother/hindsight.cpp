#include "trundle/slam/smoother/hindsight.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include <Eigen/LU>

#include "trundle/slam/association/association.hpp"
#include "trundle/slam/association/landmark_grid.hpp"

namespace trundle {
namespace {

constexpr double kCellShare = 0.25;         // of the sensor's range: cells of the grid
constexpr double kSigmas = 4.0;             // further away nothing is looked for
constexpr std::size_t kMostCandidates = 8;  // landmarks that one sighting may show

/// −2 log of a normal density where it is highest.
double cost_at_peak(const Matrix2& S) {
  return 2.0 * std::log(2.0 * kPi) + std::log(S.determinant());
}

/// −2 log of the density of a reading that shows nothing of the map.
double cost_of_none(const LandmarkSensor& sensor) {
  return cost_of_new({.max_range_m = sensor.max_range_m});
}

/// A map in a grid.
class PlacedMap {
 public:
  PlacedMap(std::span<const MappedLandmark> map, const LandmarkSensor& sensor)
      : grid_(kCellShare * sensor.max_range_m) {
    for (std::size_t i = 0; i < map.size(); ++i) {
      grid_.put(i, map[i].position);
      widest_m_ = std::max(widest_m_, std::sqrt(map[i].covariance.trace()));
    }
    count_ = map.size();
  }
  /// Landmarks within some sigmas of a place that is known to one of them.
  const std::vector<std::size_t>& near(const Vector2& place, double sigma_m, std::size_t most) {
    grid_.near(place, kSigmas * std::hypot(sigma_m, widest_m_), std::min(most, count_), found_);
    return found_;
  }

 private:
  LandmarkGrid grid_;
  double widest_m_ = 0.0;
  std::size_t count_ = 0;
  std::vector<std::size_t> found_;
};

/// Pairs that were seen in one instant: two landmarks.
std::set<LandmarkPair> seen_together(const ShownObservations& shown) {
  std::set<LandmarkPair> pairs;
  for (const auto& step : shown)
    for (const Observation& a : step)
      for (const Observation& b : step)
        if (a.landmark >= 0 && a.landmark < b.landmark) pairs.emplace(a.landmark, b.landmark);
  return pairs;
}

/// What a sighting may show, from a pose with its covariance.
class Looker {
 public:
  Looker(const SmoothedSlam& smoothed, const LandmarkSensor& sensor)
      : smoothed_(smoothed), sensor_(sensor), R_(reading_covariance(sensor)), map_(smoothed.map, sensor) {}

  std::vector<Fit> fits(std::size_t step, const Observation& observation) {
    const Pose2& pose = smoothed_.trajectory.poses[step].pose;
    const Matrix3& P = smoothed_.trajectory.covariances[step];
    const SightedLandmark there = sighted_landmark(pose, sensor_.body_from_sensor, observation);
    const Matrix2 spread =
        there.by_pose * P * there.by_pose.transpose() + there.by_reading * R_ * there.by_reading.transpose();
    std::vector<Fit> fits;
    for (const std::size_t i : map_.near(there.in_world, std::sqrt(spread.trace()), kMostCandidates)) {
      const MappedLandmark& m = smoothed_.map[i];
      const ExpectedReading expected = expected_reading(pose, sensor_.body_from_sensor, m.position);
      const Vector2 innovation = innovation_of(observation, expected);
      const double nis = innovation.dot(R_.inverse() * innovation);
      fits.push_back({m.id, nis, nis + cost_at_peak(R_)});
    }
    return fits;
  }

 private:
  const SmoothedSlam& smoothed_;
  const LandmarkSensor& sensor_;
  Matrix2 R_;
  PlacedMap map_;
};

}  // namespace

// Eq. 14.
double cost_of_explaining(const ShownObservations& shown, const LandmarkSensor& sensor) {
  const double none = cost_of_none(sensor);
  const double density = cost_at_peak(reading_covariance(sensor));
  std::set<LandmarkId> landmarks;
  double cost = 0.0;
  for (const auto& step : shown)
    for (const Observation& observation : step) {
      if (!is_valid(observation)) continue;
      const bool is_first = observation.landmark >= 0 && landmarks.insert(observation.landmark).second;
      cost += observation.landmark < 0 || is_first ? none : density;
    }
  return cost;
}

// Eq. 15.
std::vector<LandmarkPair> twins_in(const ShownObservations& shown, std::span<const MappedLandmark> map,
                                   const LandmarkSensor& sensor, const DifferenceCovariance& covariance) {
  const std::set<LandmarkPair> different = seen_together(shown);
  const double anywhere = 2.0 * std::log(kPi * sensor.max_range_m * sensor.max_range_m);
  PlacedMap places(map, sensor);
  std::vector<std::pair<double, LandmarkPair>> alike;
  for (const MappedLandmark& a : map) {
    const std::vector<std::size_t> near =
        places.near(a.position, std::sqrt(a.covariance.trace()), map.size());
    for (const std::size_t j : near) {
      const MappedLandmark& b = map[j];
      if (b.id <= a.id || different.contains({a.id, b.id})) continue;
      const Matrix2 C = covariance(a.id, b.id);
      const Vector2 apart = b.position - a.position;
      const double squared = apart.dot(C.inverse() * apart);
      const double cost = squared + cost_at_peak(C);
      if (squared <= UnknownIdOptions{}.gate && cost < anywhere) alike.push_back({cost, {a.id, b.id}});
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
ShownObservations explained_again(ShownObservations shown, const SmoothedSlam& smoothed,
                                  const LandmarkSensor& sensor) {
  Looker looker(smoothed, sensor);
  const AssociationOptions options{.gate = cost_of_none(sensor) - cost_at_peak(reading_covariance(sensor)),
                                   .max_range_m = sensor.max_range_m};
  for (std::size_t k = 0; k < shown.size(); ++k) {
    std::vector<Observation*> valid;
    std::vector<std::vector<Fit>> fits;
    for (Observation& observation : shown[k])
      if (is_valid(observation)) {
        valid.push_back(&observation);
        fits.push_back(looker.fits(k, observation));
      }
    const std::vector<Associated> found = associate(fits, options);
    for (std::size_t i = 0; i < valid.size(); ++i) valid[i]->landmark = found[i].landmark;
  }
  return shown;
}

bool say_the_same(const ShownObservations& a, const ShownObservations& b) {
  return std::ranges::equal(a, b, [](const auto& one, const auto& other) {
    return std::ranges::equal(one, other, {}, &Observation::landmark, &Observation::landmark);
  });
}

}  // namespace trundle
