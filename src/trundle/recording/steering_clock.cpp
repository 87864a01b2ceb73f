#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "trundle/chassis/rows.hpp"
#include "trundle/chassis/without_wheel.hpp"
#include "trundle/recording/csv/detail/table.hpp"
#include "trundle/recording/detail/clock_comparison.hpp"
#include "trundle/recording/detail/steered_motion.hpp"
#include "trundle/recording/detail/turn_windows.hpp"
#include "trundle/recording/time_offset.hpp"

namespace trundle::recording {
namespace {

/// What the steering makes of the way, its clock being moved: the turn, and the way itself, of which a
/// steering whose zero is off turns the body by a multiple.
class TurnsBySteering {
 public:
  explicit TurnsBySteering(SteeredMotion motion) : motion_(std::move(motion)) { move_to(0.0); }

  /// Regressors of the windows, whose stamps are moved by `offset_s`.
  Eigen::MatrixXd in(const Windows& windows, double later_s, double offset_s, std::vector<bool>& used) {
    if (later_s != later_s_) move_to(later_s);
    Eigen::MatrixXd regressors(static_cast<Eigen::Index>(windows.count), 2);
    regressors << turns_in(windows, *turn_, -offset_s, used), turns_in(windows, *way_, -offset_s, used);
    return regressors;
  }
  double first_s() const { return turn_->first_s(); }
  double last_s() const { return turn_->last_s(); }

 private:
  void move_to(double later_s) {
    const SteeredMotion::Twists by = motion_.twists(later_s);
    Turns turn, way;
    Stamps ends_s({});
    for (std::size_t i = 0; i < by.twist.size(); ++i) {
      if (by.lost[i]) turn.lost.push_back(i);
      turn.turn_rad.push_back(by.twist[i].dtheta);
      way.turn_rad.push_back(by.twist[i].dx);
      ends_s.push_back(motion_.readings().increments[i].time_s);
    }
    way.lost = turn.lost;
    turn_.emplace(ends_s, std::move(turn));
    way_.emplace(std::move(ends_s), std::move(way));
    later_s_ = later_s;
  }

  SteeredMotion motion_;
  double later_s_ = 0.0;
  std::optional<TurnIntegral> turn_, way_;
};

/// By the wheels that are not steered, where they see turns.
std::optional<TurnIntegral> turns_by_unsteered(const AlignedReadings& readings, const Robot& robot) {
  const std::optional<Chassis> others = without_steering(robot.chassis);
  if (!others) return std::nullopt;
  const Rows rows = rows_of(*others, false);
  if (observability(rows).rank < 3) return std::nullopt;
  Turns turns;
  Stamps ends_s({});
  for (std::size_t i = 0; i < readings.increments.size(); ++i) {
    if (readings.bridged[i]) turns.lost.push_back(i);
    turns.turn_rad.push_back(twist_of(*others, rows, readings.increments[i]).dtheta);
    ends_s.push_back(readings.increments[i].time_s);
  }
  return TurnIntegral(std::move(ends_s), std::move(turns));
}

/// Windows of a sensor that the steering reaches wherever the clocks are: it is that far from both ends.
void keep_inner(const TurnsBySteering& steering, double offset_s, double largest_s, OwnTurns& own) {
  for (std::size_t w = 0; w < own.windows.count; ++w)
    own.known[w] = own.known[w] && own.windows.time_s(w) + offset_s >= steering.first_s() + largest_s &&
                   own.windows.time_s(w + 2) + offset_s <= steering.last_s() - largest_s;
}

struct Steps {
  double row_s = 0.0;   ///< of the steering
  double half_s = 0.0;  ///< half a window
};

OffsetSearch search_of(const TimeOffsetOptions& options, const Steps& steps, double given_s) {
  return {.given_s = given_s,
          .largest_s = options.largest_s,
          .step_s = 0.25 * steps.half_s,
          .change_s = 0.25 * steps.half_s,
          .largest_sigma_s = options.largest_sigma_s,
          .least_correlation = options.least_correlation};
}

/// Between its readings the steering turns evenly, as far as is known: a change is known that well.
OffsetSearch search_of_steering(const TimeOffsetOptions& options, const Steps& steps) {
  OffsetSearch search = search_of(options, steps, 0.0);
  search.least_sigma_s = steps.row_s / 20.0;
  return search;
}

SteeringClocks by_unsteered_wheels(const TurnIntegral& wheels, const SteeredMotion& motion,
                                   const Steps& steps, const TimeOffsetOptions& options) {
  const OwnTurns own = own_turns(wheels, steps.half_s);
  const auto smoothed_over = [&](double over_s) -> std::optional<ClockComparison> {
    OwnTurns turns = own;
    TurnsBySteering steering(motion.smoothed(over_s));
    keep_inner(steering, 0.0, options.largest_s, turns);
    const auto count = static_cast<Eigen::Index>(turns.windows.count);
    return ClockComparison{.clocks = {.fixed = {std::move(turns.turns)},
                                      .duration_s = Eigen::VectorXd::Constant(count, steps.half_s),
                                      .used = std::move(turns.known),
                                      .moved =
                                          [steering = std::move(steering), windows = turns.windows](
                                              double later_s, std::vector<bool>& used) mutable {
                                            return std::vector{steering.in(windows, later_s, 0.0, used)};
                                          }},
                           .search = search_of_steering(options, steps)};
  };
  return {.is_possible = true, .by = "wheels", .steering = find_offset_of_noisy(smoothed_over)};
}

SteeringClocks by_gyro(const GyroStream& stream, const Gyro& gyro, TurnsBySteering& steering,
                       const Steps& steps, const TimeOffsetOptions& options) {
  OwnTurns own = own_turns(integral_of_gyro(stream, gyro), steps.half_s);
  keep_inner(steering, gyro.time_offset_s, 2.0 * options.largest_s, own);
  const auto count = static_cast<Eigen::Index>(own.windows.count);
  const JointOffsets found = find_offsets(
      {.fixed = {std::move(own.turns)},
       .duration_s = Eigen::VectorXd::Constant(count, steps.half_s),
       .used = std::move(own.known),
       .moved =
           [&](const Eigen::Vector2d& offsets_s, std::vector<bool>& used) {
             return std::vector{steering.in(own.windows, offsets_s[0], offsets_s[1], used)};
           },
       .search = {search_of_steering(options, steps), search_of(options, steps, gyro.time_offset_s)}});
  SteeringClocks clocks{.is_possible = true, .by = "gyro", .steering = found.each[0]};
  clocks.gyro = found.each[1];
  clocks.apart = found.apart;
  return clocks;
}

SteeringClocks by_reference(const SteeredMotion& motion, const ReferenceStream& reference, const Robot& robot,
                            const TimeOffsetOptions& options) {
  const auto path_at = [&motion](double later_s) {
    SteeredMotion::Twists by = motion.twists(later_s);
    return motion_path(motion.readings(), std::move(by.twist), std::move(by.lost));
  };
  const auto joint = sensor_and_reference_clocks(
      {.path_at = path_at, .turns_by_way = true, .sensor_step_s = motion.steering_step_s()}, reference, robot,
      options);
  const JointOffsets found = joint ? find_offsets(*joint) : JointOffsets{};
  SteeringClocks clocks{.is_possible = true, .by = "reference", .steering = found.each[0]};
  clocks.reference = found.each[1];
  clocks.apart = found.apart;
  return clocks;
}

SteeringClocks clocks_of(const Recording& recording, const Robot& robot, const TimeOffsetOptions& options) {
  const AlignedReadings readings = align(recording, robot);
  if (readings.increments.size() < 2) return {};
  const SteeredMotion motion(recording, readings, robot);
  const double row_s = std::max(usual_interval_s(readings.increments), motion.steering_step_s());
  const std::optional<Gyro>& gyro = robot.chassis.gyro;
  if (const auto wheels = turns_by_unsteered(readings, robot))
    return by_unsteered_wheels(*wheels, motion, {row_s, half_of_a_window(options.window_s, row_s)}, options);
  if (gyro && recording.gyro.time_s.size() >= 2) {
    TurnsBySteering steering(motion);
    const double slower_s = std::max(row_s, median_step(recording.gyro.time_s));
    return by_gyro(recording.gyro, *gyro, steering, {row_s, half_of_a_window(options.window_s, slower_s)},
                   options);
  }
  if (recording.reference.has_headings()) return by_reference(motion, recording.reference, robot, options);
  return {};
}

}  // namespace

SteeringClocks steering_clocks(const Recording& recording, const Robot& robot,
                               const TimeOffsetOptions& options) {
  if (!is_steered(robot.chassis) || robot.chassis.wheel_count == 0 ||
      observability(rows_of(robot.chassis, false)).rank < 3)
    return {};
  SteeringClocks clocks = clocks_of(recording, robot, options);
  if (clocks.steering) clocks.steering->offset_s += steering_time_offset_s(robot.chassis);
  return clocks;
}

double steering_time_offset_s(const Chassis& chassis) {
  for (const Wheel& wheel : chassis.all_wheels())
    if (wheel.steering) return wheel.steering->time_offset_s;
  return 0.0;
}

void move_steering_clock(double by_s, Chassis& chassis) {
  for (Wheel& wheel : chassis.all_wheels())
    if (wheel.steering) wheel.steering->time_offset_s += by_s;
}

}  // namespace trundle::recording
