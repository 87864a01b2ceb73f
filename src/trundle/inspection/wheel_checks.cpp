#include "trundle/inspection/wheel_checks.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "trundle/chassis/rows.hpp"
#include "trundle/inspection/inspect.hpp"
#include "trundle/recording/csv/detail/streams.hpp"

namespace trundle::inspection {
namespace {

/// recording.toml where it maps the wheels; empty where they are read from wheels.csv.
std::string map_of_wheels(const Recording& recording) {
  const bool native = std::filesystem::path(recording.wheels.origin.file).filename() == "wheels.csv";
  return native ? std::string() : recording_toml_of(recording);
}

/// Columns of wheels that the robot has not got, where recording.toml asks for them.
void find_stray_wheels(const Recording& recording, const Robot& robot, std::vector<Finding>& problems) {
  const std::string map = map_of_wheels(recording);
  if (map.empty() || robot.wheel_names.empty()) return;
  for (const WheelSeries& series : recording.wheels.series) {
    if (std::ranges::find(robot.wheel_names, series.wheel) != robot.wheel_names.end()) continue;
    const std::string nearest = nearest_name(series.wheel, robot.wheel_names);
    Finding stray{.code = FindingCode::unknown_wheel, .place = map, .subjects = {series.wheel}};
    if (nearest.empty())
      stray.payload = payload::Names{robot.wheel_names};
    else
      stray.subjects.push_back(nearest);
    problems.push_back(stray);
  }
}

/// Angles of wheels that stay where they are by the robot file.
void find_unused_steering(const Recording& recording, const Robot& robot, std::vector<Finding>& problems) {
  const auto wheels = robot.chassis.all_wheels();
  for (const WheelSeries& series : recording.wheels.steering)
    for (std::size_t i = 0; i < wheels.size(); ++i)
      if (!wheels[i].steering && wheel_name(robot, i) == series.wheel)
        problems.push_back({.code = FindingCode::unused_steering,
                            .place = place_of_wheel(robot, i),
                            .subjects = {steering_column_name(series), series.wheel}});
}

/// Counts of wheels of which nothing says what a count is.
void find_unscaled_wheels(const Recording& recording, const Robot& robot, std::vector<Finding>& problems) {
  std::vector<std::string> names;
  std::string place;
  for (std::size_t i = 0; i < robot.wheel_names.size(); ++i) {
    const auto& series = recording.wheels.series;
    const auto mine = std::ranges::find(series, robot.wheel_names[i], &WheelSeries::wheel);
    if (mine == series.end() || mine->unit != WheelUnit::ticks ||
        robot.chassis.wheels()[i].ticks_per_revolution != 0.0)
      continue;
    if (names.empty()) place = place_of_wheel(robot, i);
    names.push_back(robot.wheel_names[i]);
  }
  if (names.empty()) return;
  problems.push_back({.code = FindingCode::ticks_per_revolution, .place = place, .subjects = names});
}

/// How far the robot turns by its gyro or else by the reference, forth and back both counted [rad].
double turning_seen(const Recording& recording, const Overview& overview) {
  const std::vector<double>& heading = recording.reference.heading_rad;
  double seen = 0.0, before = heading.empty() ? kNotMeasured : heading.front();
  for (const double now : heading) {
    if (!std::isnan(now - before)) seen += now - before;
    if (!std::isnan(now)) before = now;
  }
  return std::max(recording.gyro.time_s.empty() ? 0.0 : overview.turned_rad, std::abs(seen));
}

}  // namespace

void find_wrong_columns(const Recording& recording, const Robot& robot, std::vector<Finding>& problems) {
  find_stray_wheels(recording, robot, problems);
  find_unused_steering(recording, robot, problems);
  find_unscaled_wheels(recording, robot, problems);
}

void find_one_column_for_two(const Recording& recording, const Overview& overview, const Robot& robot,
                             std::vector<Finding>& problems) {
  constexpr double kTurned_rad = 3.0;  // far more than the bias of a gyro sums up to
  const auto wheels = robot.chassis.wheels();
  const double turned = turning_seen(recording, overview);
  if (turned < kTurned_rad || std::ranges::all_of(overview.way, [](double way) { return way == 0.0; }))
    return;
  for (std::size_t i = 0; i < wheels.size(); ++i)
    for (std::size_t j = i + 1; j < wheels.size(); ++j) {
      const bool roll_alike = std::abs(rolling_row(wheels[i]).z() - rolling_row(wheels[j]).z()) < 1e-9;
      if (overview.read_alike[i][j] && !roll_alike)
        problems.push_back({.code = FindingCode::indistinguishable_wheels,
                            .place = recording.wheels.origin.file,
                            .subjects = {robot.wheel_names[i], robot.wheel_names[j]},
                            .payload = payload::Amount{turned}});
    }
}

void find_contrary_wheels(const Recording& recording, const Overview& overview, const Robot& robot,
                          std::vector<Finding>& problems) {
  constexpr double kUnexplained =
      0.15;  // real robots 0.03 at most; axles for directions, driving squares, 0.21
  if (overview.unexplained < kUnexplained || is_steered(robot.chassis) || has_skid_wheels(robot.chassis) ||
      has_dead_counts(problems))
    return;
  problems.push_back({.code = FindingCode::contrary_wheels,
                      .place = recording.wheels.origin.file,
                      .payload = payload::Amount{100.0 * overview.unexplained}});
}

}  // namespace trundle::inspection
