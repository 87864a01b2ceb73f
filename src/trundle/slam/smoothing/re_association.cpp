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
LandmarkGrid placed(std::span<const MappedLandmark> map, double max_range_m) {
  LandmarkGrid grid(kCellShare * max_range_m);
  for (std::size_t i = 0; i < map.size(); ++i) grid.put(i, map[i].position);
  return grid;
}

double sigma_of(const MappedLandmark& landmark) {
  return std::sqrt(landmark.covariance.trace());
}

/// Pairs that were seen in one instant: two landmarks.
std::set<LandmarkPair> seen_together(std::span<const ShownObservations> shown) {
  std::set<LandmarkPair> pairs;
  for (const ShownObservations& by_one : shown)
    for (const auto& step : by_one)
      for (const Observation& a : step)
        for (const Observation& b : step)
          if (a.landmark >= 0 && a.landmark < b.landmark) pairs.emplace(a.landmark, b.landmark);
  return pairs;
}

/// At how many instants sensors saw each landmark, and at how many they looked there: eq. 14a.
class Detections {
 public:
  Detections(std::span<const ShownFromPath> robots, std::span<const MappedLandmark> map)
      : counts_(map.size()) {
    for (const ShownFromPath& robot : robots) count(robot, map);
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

  void count(const ShownFromPath& robot, std::span<const MappedLandmark> map) {
    Visibility view(robot.sensor.max_range_m);
    for (const auto& step : robot.shown)
      for (const Observation& observation : step)
        if (is_valid(observation)) view.add_seen(observation.range_m, observation.bearing_rad);
    const LandmarkGrid grid = placed(map, robot.sensor.max_range_m);
    std::vector<std::size_t> near;
    for (std::size_t k = 0; k < robot.shown.size(); ++k) {
      const std::vector<Observation>& step = robot.shown[k];
      if (step.empty()) continue;
      const Pose2& pose = robot.path.poses[k].pose;
      grid.near((pose * robot.sensor.body_from_sensor).translation(), view.reach_m(), map.size(), near);
      for (const std::size_t i : near) {
        const ExpectedReading there = expected_reading(pose, robot.sensor.body_from_sensor, map[i].position);
        if (!view.covers(there.range_m, there.bearing_rad)) continue;
        const bool seen = std::ranges::find(step, map[i].id, &Observation::landmark) != step.end();
        (seen ? counts_[i].seen : counts_[i].missed) += 1.0;
      }
    }
  }

  std::vector<Count> counts_;  ///< of each landmark of the map
};

/// What a sighting of a robot may show, from its smoothed pose.
class Candidates {
 public:
  Candidates(const ShownFromPath& robot, std::span<const MappedLandmark> map, const Detections& detections)
      : robot_(robot),
        landmarks_(map),
        detections_(detections),
        R_(reading_covariance(robot.sensor)),
        map_(placed(map, robot.sensor.max_range_m)) {}

  std::vector<Fit> fits(std::size_t step, const Observation& observation) {
    const Pose2& pose = robot_.path.poses[step].pose;
    const Pose2& body_from_sensor = robot_.sensor.body_from_sensor;
    const SightedLandmark there = sighted_landmark(pose, body_from_sensor, observation);
    const Matrix2 spread = there.spread(R_);
    map_.near(there.in_world, kSigmas * std::sqrt(spread.trace()), kMostShown, near_);
    std::vector<Fit> fits;
    for (const std::size_t i : near_) {
      const MappedLandmark& m = landmarks_[i];
      const ExpectedReading expected = expected_reading(pose, body_from_sensor, m.position);
      const Vector2 innovation = innovation_of(observation, expected);
      const double nis = innovation.dot(R_.inverse() * innovation);
      fits.push_back({m.id, nis, nis + cost_at_peak(R_) + detections_.cost_of_seeing(i)});
    }
    return fits;
  }

 private:
  const ShownFromPath& robot_;
  std::span<const MappedLandmark> landmarks_;
  const Detections& detections_;
  Matrix2 R_;
  LandmarkGrid map_;
  std::vector<std::size_t> near_;
};

/// By one of the robots.
ShownObservations reassociated(const SlamInput& input, const ShownFromPath& robot, Candidates candidates) {
  const LandmarkSensor& sensor = robot.sensor;
  ShownObservations shown = robot.shown;
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

}  // namespace

// Eq. 14.
double cost_of_explaining(std::span<const ShownFromPath> robots, std::span<const MappedLandmark> map) {
  std::set<LandmarkId> landmarks;
  double cost = Detections(robots, map).cost();
  for (const ShownFromPath& robot : robots) {
    const double none = cost_of_none(robot.sensor);
    const double density = cost_at_peak(reading_covariance(robot.sensor));
    for (const auto& step : robot.shown)
      for (const Observation& observation : step) {
        if (!is_valid(observation)) continue;
        const bool is_first = observation.landmark >= 0 && landmarks.insert(observation.landmark).second;
        cost += observation.landmark < 0 || is_first ? none : density;
      }
  }
  return cost;
}

// Eq. 15.
std::vector<LandmarkPair> duplicates_in(std::span<const ShownObservations> shown,
                                        std::span<const MappedLandmark> map, double max_range_m,
                                        LandmarkId first_unidentified,
                                        const DifferenceCovariance& covariance) {
  const std::set<LandmarkPair> different = seen_together(shown);
  const double gate = AssociationOptions{}.gate;
  const double anywhere = cost_of_any_place(max_range_m);
  const LandmarkGrid grid = placed(map, max_range_m);
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
std::vector<ShownObservations> reassociated(std::span<const SlamInput* const> inputs,
                                            std::span<const ShownFromPath> robots,
                                            std::span<const MappedLandmark> map) {
  const Detections detections(robots, map);
  std::vector<ShownObservations> shown;
  for (std::size_t i = 0; i < robots.size(); ++i)
    shown.push_back(reassociated(*inputs[i], robots[i], Candidates(robots[i], map, detections)));
  return shown;
}

bool are_same_associations(const ShownObservations& a, const ShownObservations& b) {
  return std::ranges::equal(a, b, [](const auto& one, const auto& other) {
    return std::ranges::equal(one, other, {}, &Observation::landmark, &Observation::landmark);
  });
}

}  // namespace trundle::slam
