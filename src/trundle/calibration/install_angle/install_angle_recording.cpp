#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "trundle/calibration/install_angle/install_angle.hpp"
#include "trundle/calibration/likelihood/run_likelihood.hpp"
#include "trundle/calibration/problem/run.hpp"
#include "trundle/io/error.hpp"

namespace trundle::calibration {
namespace {

constexpr double kLargestTurn = radians(1.0);
constexpr double kLargestBoth = 0.2;  // share of the way on which both pods may roll

/// Which wheel rolls along body x, which across it, and with which sign.
struct Pods {
  std::size_t ahead = 0;
  std::size_t across = 1;
  double ahead_sign = 1.0;
  double across_sign = 1.0;
};

Pods pods_of(const Robot& robot) {
  const auto wheels = robot.chassis.wheels();
  const auto refuse = [&](const std::string& fact) {
    throw InputError(place_of(robot), fact, "two passive wheels, one rolling along body x and one across it");
  };
  if (wheels.size() != 2) refuse(fmt::format("has {} wheels", wheels.size()));
  Pods pods;
  if (std::abs(std::cos(wheels[0].direction_rad)) < std::abs(std::cos(wheels[1].direction_rad)))
    std::swap(pods.ahead, pods.across);
  const double c = std::cos(wheels[pods.ahead].direction_rad);
  const double s = std::sin(wheels[pods.across].direction_rad);
  if (std::min(std::abs(c), std::abs(s)) < std::sqrt(0.5))
    refuse(fmt::format("has wheels at {:.1f}° and {:.1f}°", degrees(wheels[0].direction_rad),
                       degrees(wheels[1].direction_rad)));
  pods.ahead_sign = std::copysign(1.0, c);
  pods.across_sign = std::copysign(1.0, s);
  return pods;
}

/// What the two pods read: ways in all, the first part of them, and the way on which both rolled.
struct Ways {
  double ahead = 0.0;
  double across = 0.0;
  double across_first = 0.0;  ///< on the first half of all the way
  double both = 0.0;
  double all = 0.0;
  double turned_rad = 0.0;  ///< by the gyro
};

Ways ways_of(const Run& run, const Robot& robot, const Pods& pods) {
  Ways ways;
  const auto travel = [&](const Increment& increment, std::size_t wheel) {
    return kPi * robot.chassis.wheels()[wheel].diameter_m * increment.turned[wheel];
  };
  for (const Increment& increment : run.readings.increments)
    ways.all += std::abs(travel(increment, pods.ahead)) + std::abs(travel(increment, pods.across));
  double done = 0.0;
  for (const Increment& increment : run.readings.increments) {
    const double ahead = pods.ahead_sign * travel(increment, pods.ahead);
    const double across = pods.across_sign * travel(increment, pods.across);
    ways.ahead += ahead;
    ways.across += across;
    done += std::abs(ahead) + std::abs(across);
    if (done < 0.5 * ways.all) ways.across_first += std::abs(across);
    ways.both += 2.0 * std::min(std::abs(ahead), std::abs(across));
    if (increment.has_gyro)
      ways.turned_rad += (increment.gyro_rad - robot.chassis.gyro->bias_rad_s * increment.duration_s) *
                         robot.chassis.gyro->scale;
  }
  return ways;
}

void refuse_what_is_no_l(const Ways& ways, const Robot& robot, const Pods& pods, const std::string& run) {
  const std::string& ahead = robot.wheel_names[pods.ahead];
  const std::string& across = robot.wheel_names[pods.across];
  if (ways.all == 0.0) throw CannotAnswer(run + ": the pods never roll");
  if (ways.both > kLargestBoth * ways.all)
    throw CannotAnswer(
        fmt::format("{}: no L-shaped run: '{}' and '{}' roll at the same time over {:.0f} % of the way", run,
                    ahead, across, 100.0 * ways.both / ways.all));
  if (ways.across_first > 0.25 * ways.all)
    throw CannotAnswer(
        fmt::format("{}: '{}', which should roll across, rolls first: the ports of '{}' and '{}' are "
                    "swapped, or the run began "
                    "sideways",
                    run, across, ahead, across));
  if (std::abs(ways.turned_rad) > kLargestTurn)
    throw CannotAnswer(fmt::format("{}: the robot turned by {:.1f}°: hold its heading on both legs", run,
                                   degrees(ways.turned_rad)));
}

/// The end of the body in the frame of its start.
Vector2 end_of(const Recording& recording, const Run& run, const Robot& robot) {
  const auto lacks = [&](const char* what) {
    throw CannotAnswer(fmt::format("{}: where the run ended was not measured: {}", recording.name, what));
  };
  const PartialReference& partial = run.partial;
  const Vector2 mount = robot.body_from_reference.translation();
  if (partial.end_x_m && partial.end_y_m)  // in the sensor's frame, which does not turn
    return rotation(robot.body_from_reference.heading) *
           Vector2(partial.end_x_m->value, partial.end_y_m->value);
  if (run.epochs.empty())
    lacks("add reference.csv, or end_x_m and end_y_m under [reference] in recording.toml");
  const ReferenceSample start =
      sample_reference(run.reference, run.epoch_time(0) - robot.reference_time_offset_s);
  const ReferenceSample end =
      sample_reference(run.reference, run.epoch_time(run.epochs.size() - 1) - robot.reference_time_offset_s);
  if (!start.has_heading()) lacks("the reference has no heading at the start");
  if (!start.has_position() || !end.has_position())
    lacks("the reference has no position at the start or at the end");
  const Pose2 world_from_start = body_at(run, 0, robot);
  const Vector2 sensor = world_from_start.inverse() * end.value.head<2>();
  return sensor - mount;
}

void refuse_reversed(const std::string& run, const std::string& pod, double seen, double measured) {
  if (seen * measured >= 0.0) return;
  throw CannotAnswer(
      fmt::format("{}: '{}' reads {:.3f} m where the robot moved {:.3f} m that way: it counts backwards", run,
                  pod, seen, measured));
}

}  // namespace

LRun l_run_of(const Recording& recording, const Robot& robot) {
  const Pods pods = pods_of(robot);
  const Run run = prepare_run(recording, robot);
  const Ways ways = ways_of(run, robot, pods);
  refuse_what_is_no_l(ways, robot, pods, recording.name);
  const Vector2 end = end_of(recording, run, robot);
  refuse_reversed(recording.name, robot.wheel_names[pods.ahead], ways.ahead, end.x());
  refuse_reversed(recording.name, robot.wheel_names[pods.across], ways.across, end.y());
  return {.side_m = std::abs(ways.ahead),
          .end_x_m = end.x(),
          .end_y_m = end.y(),
          .leg_ratio = std::abs(ways.across / ways.ahead)};
}

}  // namespace trundle::calibration
