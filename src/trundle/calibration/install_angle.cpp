#include "trundle/calibration/install_angle.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <fmt/format.h>

#include "trundle/calibration/run.hpp"
#include "trundle/calibration/run_likelihood.hpp"
#include "trundle/io/error.hpp"

namespace trundle {
namespace {

constexpr double kFurthestScale = 2.0;           // X/S beyond this, or below its inverse, is another run
constexpr double kSuspiciousScale = 0.05;        // off 1
constexpr double kLargestAngle = 1.0;            // [rad]: beyond it the pods hardly differ
constexpr double kLargestSigma = radians(10.0);  // the angle's prior sigma
constexpr double kLargestTurn = radians(1.0);
constexpr double kLargestBoth = 0.2;  // share of the way on which both pods may roll

void check(const LRun& run) {
  if (!(run.side_m > 0.0) || !std::isfinite(run.side_m))
    throw InputError("L-shaped run", fmt::format("the side is {} m", run.side_m), "a positive length");
  for (const double end : {run.end_x_m, run.end_y_m})
    if (!std::isfinite(end))
      throw InputError("L-shaped run", fmt::format("an end coordinate is {} m", end), "a finite number");
}

void check(const InstallAngleOptions& options) {
  for (const double sigma : {options.sigma_m, options.sigma_heading_rad})
    if (!(sigma >= 0.0) || !std::isfinite(sigma))
      throw InputError("L-shaped run", fmt::format("a sigma is {}", sigma), "a number not below zero");
}

/// docs/dead-wheels.md, eq. 3; with equal legs it is α = 90° − 2 θ₁.
double alpha_of(const LRun& run) {
  const double direction = std::atan2(std::abs(run.end_y_m), std::abs(run.end_x_m));
  const double alpha =
      run.leg_ratio == 1.0
          ? 0.5 * kPi - 2.0 * direction
          : std::asin(std::clamp(run.leg_ratio * std::cos(direction), -1.0, 1.0)) - direction;
  return run.mirrored() ? -alpha : alpha;
}

void refuse_what_is_no_l(const LRun& run) {
  const double scale = std::abs(run.end_x_m) / run.side_m;
  const double alpha = alpha_of(run);
  if (scale < kFurthestScale && scale > 1.0 / kFurthestScale && std::abs(alpha) <= kLargestAngle) return;
  throw CannotAnswer(fmt::format(
      "the run ends at ({:.3f}, {:.3f}) m, which no L-shaped run of {:.3f} m does: drive the side along "
      "body x, then as far sideways without turning",
      run.end_x_m, run.end_y_m, run.side_m));
}

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double squares_about_mean(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double v : values) sum += (v - mean(values)) * (v - mean(values));
  return sum;
}

/// Variance of the mean over each sense, and over both.
double variance_of_mean(const std::vector<double>& variances) {
  const auto n = static_cast<double>(variances.size());
  return std::accumulate(variances.begin(), variances.end(), 0.0) / (n * n);
}

/// Angles of the runs of one sense, and their variances by the measuring sigmas: eq. 4.
struct Sense {
  std::vector<double> alpha;
  std::vector<double> variance;
};

void average(const Sense& plain, const Sense& mirrored, InstallAngle& result) {
  double squares = 0.0;
  std::size_t freedom = 0;
  std::vector<double> means, variances;
  for (const Sense* sense : {&plain, &mirrored}) {
    if (sense->alpha.empty()) continue;
    means.push_back(mean(sense->alpha));
    variances.push_back(variance_of_mean(sense->variance));
    squares += squares_about_mean(sense->alpha);
    freedom += sense->alpha.size() - 1;
  }
  result.alpha_rad = mean(means);
  result.theta_rad = 0.5 * kPi - result.alpha_rad;
  result.sigma_rad = std::sqrt(variance_of_mean(variances));
  if (freedom > 0) result.scatter_rad = std::sqrt(squares / static_cast<double>(freedom));
  if (means.size() == 2) result.between_senses_rad = 0.5 * (means[1] - means[0]);
}

void add_warnings(double run_sigma_rad, InstallAngle& result) {
  if (std::abs(result.scale - 1.0) > kSuspiciousScale)
    result.warnings.push_back(
        fmt::format("pod 2 rolls {:.3f} m for each metre it reads: its diameter in the robot file is wrong",
                    result.scale));
  if (result.scatter_rad && *result.scatter_rad > 3.0 * run_sigma_rad)
    result.warnings.push_back(
        fmt::format("repeated runs scatter by {:.2f}°, measuring explains {:.2f}°: set the start "
                    "heading with more care",
                    degrees(*result.scatter_rad), degrees(run_sigma_rad)));
  if (result.between_senses_rad && std::abs(*result.between_senses_rad) > 3.0 * result.sigma_rad)
    result.warnings.push_back(fmt::format(
        "runs to the two sides differ by {:.2f}°: pod 1 rolls {:+.1f} % further than pod 2 for what it "
        "reads; that cancels in the angle, not in the robot file",
        2.0 * degrees(std::abs(*result.between_senses_rad)), 100.0 * *result.between_senses_rad));
  if (!result.between_senses_rad)
    result.warnings.emplace_back(
        "all runs go to one side: 1 % between what the pods roll for a metre that they read looks like "
        "0.57°; with a "
        "run to the other side it cancels");
}

// Recordings.

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
  if (run.knots.empty())
    lacks("add reference.csv, or end_x_m and end_y_m under [reference] in recording.toml");
  const ReferenceSample start =
      sample_reference(run.reference, run.knot_time(0) - robot.reference_time_offset_s);
  const ReferenceSample end =
      sample_reference(run.reference, run.knot_time(run.knots.size() - 1) - robot.reference_time_offset_s);
  if (!start.has_heading()) lacks("the reference has no heading at the start");
  if (!start.has_position() || !end.has_position())
    lacks("the reference has no position at the start or at the end");
  const Pose2 world_from_start = body_at_start(run, robot);
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

InstallAngle install_angle(std::span<const LRun> runs, const InstallAngleOptions& options) {
  if (runs.empty()) throw InputError("L-shaped run", "there is none", "one run or more");
  check(options);
  InstallAngle result;
  Sense plain, mirrored;
  double largest = 0.0;
  std::vector<double> scales, scale_variances;
  for (const LRun& run : runs) {
    check(run);
    refuse_what_is_no_l(run);
    const double way = std::hypot(run.end_x_m, run.end_y_m);
    const double sigma = 2.0 * std::hypot(options.sigma_m / way, options.sigma_heading_rad);
    Sense& sense = run.mirrored() ? mirrored : plain;
    sense.alpha.push_back(alpha_of(run));
    sense.variance.push_back(sigma * sigma);
    largest = std::max(largest, sigma);
    result.run_alpha_rad.push_back(sense.alpha.back());
    scales.push_back(std::abs(run.end_x_m) / run.side_m);
    scale_variances.push_back(
        std::pow(std::hypot(options.sigma_m, options.sigma_heading_rad * run.end_y_m) / run.side_m, 2));
  }
  average(plain, mirrored, result);
  result.scale = mean(scales);
  result.scale_sigma = std::sqrt(variance_of_mean(scale_variances));
  if (result.sigma_rad > kLargestSigma)
    throw CannotAnswer(
        fmt::format("the angle is known only to ± {:.0f}°: drive a longer side, or measure better",
                    degrees(result.sigma_rad)));
  add_warnings(largest, result);
  return result;
}

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

}  // namespace trundle
