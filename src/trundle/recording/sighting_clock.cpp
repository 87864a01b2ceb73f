#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include <Eigen/Core>

#include "trundle/chassis/rows.hpp"
#include "trundle/recording/detail/offset_search.hpp"
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

/// Where the body is by the sensors on board.
class Path {
 public:
  Path(const AlignedReadings& readings, const Robot& robot, bool with_gyro) {
    const Rows rows = rows_of(robot.chassis, with_gyro);
    time_s_.push_back(readings.start_s);
    poses_.emplace_back();
    for (const Increment& increment : readings.increments) {
      twists_.push_back(twist_of(robot.chassis, rows, increment));
      poses_.push_back(poses_.back() * exp(twists_.back()));
      time_s_.push_back(increment.time_s);
    }
  }

  bool covers(double time_s) const { return time_s >= time_s_.front() && time_s < time_s_.back(); }

  /// At a time that it covers.
  Pose2 at(double time_s) const {
    const auto i = static_cast<std::size_t>(std::ranges::upper_bound(time_s_, time_s) - time_s_.begin()) - 1;
    const double u = (time_s - time_s_[i]) / (time_s_[i + 1] - time_s_[i]);
    return poses_[i] * exp({u * twists_[i].dx, u * twists_[i].dy, u * twists_[i].dtheta});
  }

 private:
  std::vector<double> time_s_;
  std::vector<Pose2> poses_;
  std::vector<Twist2> twists_;
};

/// How much the bearing changes from the first sighting to the second, by how the body moved meanwhile; NaN
/// where that is not known.
double bearing_change(const Pair& pair, const Path& path, const Pose2& body_from_sensor, double offset_s) {
  const double first_s = pair.first->time_s + offset_s;
  const double second_s = pair.second->time_s + offset_s;
  if (!path.covers(first_s) || !path.covers(second_s)) return kNotMeasured;
  const Pose2 world_from_first = path.at(first_s) * body_from_sensor;
  const Pose2 world_from_second = path.at(second_s) * body_from_sensor;
  const Vector2 seen =
      pair.first->range_m * Vector2(std::cos(pair.first->bearing_rad), std::sin(pair.first->bearing_rad));
  const Vector2 then = (world_from_second.inverse() * world_from_first) * seen;
  return wrap_angle(std::atan2(then.y(), then.x()) - pair.first->bearing_rad);
}

}  // namespace

std::optional<TimeOffset> sighting_time_offset(const std::vector<Sighting>& sightings,
                                               const AlignedReadings& readings, const Robot& robot,
                                               const TimeOffsetOptions& options) {
  const bool with_gyro =
      robot.chassis.gyro.has_value() && std::ranges::all_of(readings.increments, &Increment::has_gyro);
  if (!robot.landmark_sensor || readings.increments.empty() ||
      observability(rows_of(robot.chassis, with_gyro)).rank < 3)
    return std::nullopt;
  const std::vector<Pair> pairs = pairs_of(sightings, options.window_s);
  if (pairs.empty()) return std::nullopt;
  const auto n = static_cast<Eigen::Index>(pairs.size());
  const Path path(readings, robot, with_gyro);
  TwoClocks clocks{.by_wheels = {Vector(n)}, .duration_s = Vector(n), .used = {}, .by_other = {}};
  clocks.used.assign(pairs.size(), true);
  std::vector<double> durations;
  for (Eigen::Index i = 0; i < n; ++i) {
    const Pair& pair = pairs[static_cast<std::size_t>(i)];
    clocks.by_wheels[0][i] = wrap_angle(pair.second->bearing_rad - pair.first->bearing_rad);
    clocks.duration_s[i] = pair.duration_s();
    durations.push_back(pair.duration_s());
  }
  clocks.by_other = [&](double offset_s, std::vector<bool>& used) {
    Vector changes(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto p = static_cast<std::size_t>(i);
      changes[i] = bearing_change(pairs[p], path, robot.landmark_sensor->body_from_sensor, offset_s);
      if (!std::isfinite(changes[i])) used[p] = false;
    }
    return std::vector{changes};
  };
  return find_offset(std::move(clocks), {.given_s = robot.landmark_sensor->time_offset_s,
                                         .largest_s = options.largest_s,
                                         .step_s = 0.25 * options.window_s,
                                         .sample_s = median(durations) / 4.0,
                                         .largest_sigma_s = options.largest_sigma_s,
                                         .least_correlation = options.least_correlation});
}

}  // namespace trundle::recording
