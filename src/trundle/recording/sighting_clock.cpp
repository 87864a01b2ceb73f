#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include <Eigen/Core>

#include "trundle/recording/csv/detail/table.hpp"
#include "trundle/recording/detail/clock_comparison.hpp"
#include "trundle/recording/detail/motion_path.hpp"
#include "trundle/statistics/median.hpp"

namespace trundle::recording {
namespace {

using Vector = Eigen::VectorXd;

// Between two sightings of one landmark that are compared, at most so many windows.
constexpr double kWindowsApart = 5.0;

/// One landmark seen twice.
struct Pair {
  const Sighting* first = nullptr;
  const Sighting* second = nullptr;

  double duration_s() const { return second->time_s - first->time_s; }
};

/// Each sighting of a landmark that has a name with the next one at least a window later, in time order.
std::vector<Pair> pairs_of(const std::vector<Sighting>& sightings, double window_s) {
  std::map<std::string, std::vector<const Sighting*>> of_landmark;
  for (const Sighting& sighting : sightings)
    if (!sighting.landmark.empty()) of_landmark[sighting.landmark].push_back(&sighting);
  std::vector<Pair> pairs;
  for (auto& [name, seen] : of_landmark) {
    std::ranges::stable_sort(seen, {}, &Sighting::time_s);
    std::size_t j = 0;
    for (std::size_t i = 0; i < seen.size(); i = std::max(i + 1, j)) {
      j = i + 1;
      while (j < seen.size() && seen[j]->time_s - seen[i]->time_s < window_s) ++j;
      if (j < seen.size() && seen[j]->time_s - seen[i]->time_s <= kWindowsApart * window_s)
        pairs.push_back({seen[i], seen[j]});
    }
  }
  std::ranges::stable_sort(pairs, {}, [](const Pair& pair) { return pair.first->time_s; });
  return pairs;
}

/// How much the bearing changes from the first sighting to the second, by how the body moved meanwhile; NaN
/// where that is not known.
double bearing_change(const Pair& pair, const MotionPath& path, const Pose2& body_from_sensor,
                      double offset_s) {
  const double first_s = pair.first->time_s + offset_s;
  const double second_s = pair.second->time_s + offset_s;
  if (!path.covers(first_s, second_s)) return kNotMeasured;
  const Pose2 world_from_first = path.at(first_s) * body_from_sensor;
  const Pose2 world_from_second = path.at(second_s) * body_from_sensor;
  const Vector2 seen =
      pair.first->range_m * Vector2(std::cos(pair.first->bearing_rad), std::sin(pair.first->bearing_rad));
  const Vector2 then = (world_from_second.inverse() * world_from_first) * seen;
  return wrap_angle(std::atan2(then.y(), then.x()) - pair.first->bearing_rad);
}

}  // namespace

std::optional<ClockComparison> sighting_clocks(const std::vector<Sighting>& sightings,
                                               const AlignedReadings& readings, const Robot& robot,
                                               const TimeOffsetOptions& options, double smoothed_over_s) {
  std::optional<MotionPath> path = motion_path(readings, robot);
  if (!robot.landmark_sensor || !path) return std::nullopt;
  path = smoothed(*path, smoothed_over_s);
  std::vector<Pair> pairs = pairs_of(sightings, options.window_s);
  if (pairs.empty()) return std::nullopt;
  const auto n = static_cast<Eigen::Index>(pairs.size());
  ClockComparison comparison{
      .clocks = {.fixed = {Vector(n)}, .duration_s = Vector(n), .used = {}, .moved = {}}, .search = {}};
  TwoClocks& clocks = comparison.clocks;
  clocks.used.assign(pairs.size(), true);
  std::vector<double> durations;
  for (Eigen::Index i = 0; i < n; ++i) {
    const Pair& pair = pairs[static_cast<std::size_t>(i)];
    clocks.fixed[0][i] = wrap_angle(pair.second->bearing_rad - pair.first->bearing_rad);
    clocks.duration_s[i] = pair.duration_s();
    clocks.times.push_back(static_cast<std::int64_t>(std::floor(pair.first->time_s / options.window_s)));
    durations.push_back(pair.duration_s());
  }
  comparison.search = {.given_s = robot.landmark_sensor->time_offset_s,
                       .largest_s = options.largest_s,
                       .step_s = 0.25 * options.window_s,
                       .change_s = median(durations) / 4.0,
                       .least_sigma_s = median_step(path->time_s) / 20.0,
                       .largest_sigma_s = options.largest_sigma_s,
                       .least_correlation = options.least_correlation};
  clocks.moved = [n, pairs = std::move(pairs), path = *std::move(path),
                  mount = robot.landmark_sensor->body_from_sensor](double offset_s, std::vector<bool>& used) {
    Vector changes(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto p = static_cast<std::size_t>(i);
      changes[i] = bearing_change(pairs[p], path, mount, offset_s);
      if (!std::isfinite(changes[i])) used[p] = false;
    }
    return std::vector<Eigen::MatrixXd>{changes};
  };
  return comparison;
}

std::optional<TimeOffset> sighting_time_offset(const std::vector<Sighting>& sightings,
                                               const AlignedReadings& readings, const Robot& robot,
                                               const TimeOffsetOptions& options) {
  return find_offset_of_noisy(
      [&](double over_s) { return sighting_clocks(sightings, readings, robot, options, over_s); });
}

}  // namespace trundle::recording
