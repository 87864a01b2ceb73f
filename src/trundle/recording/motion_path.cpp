#include "trundle/recording/detail/motion_path.hpp"

#include <algorithm>
#include <utility>

#include "trundle/chassis/rows.hpp"

namespace trundle::recording {
namespace {

/// The interval in which a time lies.
std::size_t interval_at(const std::vector<double>& bounds, double time) {
  return static_cast<std::size_t>(std::ranges::upper_bound(bounds, time) - bounds.begin()) - 1;
}

}  // namespace

bool MotionPath::covers(double start_s, double end_s) const {
  if (start_s < time_s.front() || end_s >= time_s.back()) return false;
  for (std::size_t i = interval_at(time_s, start_s); i < bridged.size() && time_s[i] < end_s; ++i)
    if (bridged[i]) return false;
  return true;
}

Pose2 MotionPath::at(double time) const {
  const std::size_t i = interval_at(time_s, time);
  const double u = (time - time_s[i]) / (time_s[i + 1] - time_s[i]);
  return poses[i] * exp({u * twists[i].dx, u * twists[i].dy, u * twists[i].dtheta});
}

std::optional<MotionPath> motion_path(const AlignedReadings& readings, std::vector<Twist2> twists,
                                      std::vector<bool> lost) {
  if (twists.empty()) return std::nullopt;
  MotionPath path{.time_s = {readings.start_s},
                  .poses = {Pose2{}},
                  .twists = std::move(twists),
                  .bridged = std::move(lost)};
  path.time_s.reserve(path.twists.size() + 1);
  path.poses.reserve(path.twists.size() + 1);
  for (std::size_t i = 0; i < path.twists.size(); ++i) {
    path.poses.push_back(path.poses.back() * exp(path.twists[i]));
    path.time_s.push_back(readings.increments[i].time_s);
  }
  return path;
}

std::optional<MotionPath> motion_path(const AlignedReadings& readings, const Robot& robot) {
  const bool with_gyro = observability(rows_of(robot.chassis, false)).rank < 3;
  const Rows rows = rows_of(robot.chassis, with_gyro);
  if (observability(rows).rank < 3) return std::nullopt;
  std::vector<Twist2> twists;
  std::vector<bool> lost;
  twists.reserve(readings.increments.size());
  for (std::size_t i = 0; i < readings.increments.size(); ++i) {
    const Increment& increment = readings.increments[i];
    twists.push_back(twist_of(robot.chassis, rows, increment));
    lost.push_back(readings.bridged[i] || (with_gyro && !increment.has_gyro));
  }
  return motion_path(readings, std::move(twists), std::move(lost));
}

std::optional<MotionPath> motion_path(const Trajectory& world_from_body, double longest_gap_s) {
  if (world_from_body.poses.size() < 2) return std::nullopt;
  MotionPath path;
  for (const auto& [time_s, pose] : world_from_body.poses) {
    if (!path.poses.empty()) {
      path.twists.push_back(log(path.poses.back().inverse() * pose));
      path.bridged.push_back(time_s - path.time_s.back() > longest_gap_s);
    }
    path.time_s.push_back(time_s);
    path.poses.push_back(pose);
  }
  return path;
}

MotionPath smoothed(const MotionPath& path, double over_s) {
  if (over_s <= 0.0) return path;
  const std::vector<double>& t = path.time_s;
  // What the twists sum up to at each time, and its integral: a mean over a stretch is a difference of that.
  std::vector<Vector3> sum{Vector3::Zero()}, integral{Vector3::Zero()};
  for (std::size_t i = 0; i + 1 < t.size(); ++i) {
    sum.push_back(sum.back() + path.twists[i].vector());
    integral.push_back(integral.back() + 0.5 * (t[i + 1] - t[i]) * (sum[i] + sum[i + 1]));
  }
  const auto integral_to = [&](double time) -> Vector3 {
    const double within_s = std::clamp(time, t.front(), t.back());  // rounding may lead out of it
    const std::size_t i = std::min(interval_at(t, within_s), t.size() - 2);
    const double ahead_s = within_s - t[i];
    return integral[i] + ahead_s * sum[i] +
           0.5 * ahead_s * ahead_s / (t[i + 1] - t[i]) * path.twists[i].vector();
  };
  // Between which of them nothing is bridged.
  std::vector<double> since_s = t, until_s = t;
  for (std::size_t i = 1; i < t.size(); ++i)
    if (!path.bridged[i - 1]) since_s[i] = since_s[i - 1];
  for (std::size_t i = t.size() - 1; i-- > 0;)
    if (!path.bridged[i]) until_s[i] = until_s[i + 1];
  const auto mean_at = [&](std::size_t i) -> Vector3 {
    const double half_s =
        std::min({0.5 * over_s, t[i] - since_s[i], until_s[i] - t[i]});  // as long on both sides
    if (!(half_s > 0.0)) return sum[i];
    return (integral_to(t[i] + half_s) - integral_to(t[i] - half_s)) / (2.0 * half_s);
  };
  MotionPath smooth{.time_s = t, .poses = {path.poses.front()}, .twists = {}, .bridged = path.bridged};
  Vector3 before = mean_at(0);
  for (std::size_t i = 1; i < t.size(); ++i) {
    const Vector3 now = mean_at(i);
    smooth.twists.push_back(Twist2::from(now - before));
    smooth.poses.push_back(smooth.poses.back() * exp(smooth.twists.back()));
    before = now;
  }
  return smooth;
}

}  // namespace trundle::recording
