#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "trundle/recording/csv/detail/table.hpp"
#include "trundle/recording/detail/clock_comparison.hpp"
#include "trundle/recording/detail/motion_path.hpp"
#include "trundle/statistics/median.hpp"

namespace trundle::recording {
namespace {

using Vector = Eigen::VectorXd;

// Between two samples that are compared, at most so many windows.
constexpr double kMostWindows = 2.5;
// Times what the robot drives at its fastest: a reference that moves faster has jumped.
constexpr double kFasterThanAnyMotion = 3.0;
// Of the log, searched on either side: two thirds of it are compared.
constexpr double kShareSearched = 1.0 / 6.0;

/// From one sample of the reference to a later one. The samples stay as they are, and what is read off
/// between its rows is the motion on board: interpolation would average the reference's noise, most of all
/// half-way, and that is where the offset would be found.
struct ReferenceStep {
  double start_s = 0.0, end_s = 0.0;
  double way_m = 0.0;  ///< straight from its start to its end
  double turn_rad = 0.0;
};

std::vector<ReferenceStep> steps_of(const ReferenceStream& reference, double window_s, bool with_heading) {
  std::vector<ReferenceStep> steps;
  const auto measured = [&](std::size_t i) {
    return std::isfinite(reference.x_m[i]) && std::isfinite(reference.y_m[i]) &&
           (!with_heading || std::isfinite(reference.heading_rad[i]));
  };
  std::size_t from = 0;
  for (std::size_t i = 1; i < reference.time_s.size(); ++i) {
    const double duration_s = reference.time_s[i] - reference.time_s[from];
    if (duration_s < window_s - 1e-9) continue;
    if (measured(from) && measured(i) && duration_s <= kMostWindows * window_s)
      steps.push_back(
          {.start_s = reference.time_s[from],
           .end_s = reference.time_s[i],
           .way_m =
               std::hypot(reference.x_m[i] - reference.x_m[from], reference.y_m[i] - reference.y_m[from]),
           .turn_rad =
               with_heading ? wrap_angle(reference.heading_rad[i] - reference.heading_rad[from]) : 0.0});
    from = i;
  }
  return steps;
}

/// The same step by the motion on board; NaN where that does not show it.
ReferenceStep step_on_board(const ReferenceStep& step, const MotionPath& path, const Pose2& mount,
                            double offset_s) {
  ReferenceStep moved{.start_s = step.start_s + offset_s,
                      .end_s = step.end_s + offset_s,
                      .way_m = kNotMeasured,
                      .turn_rad = kNotMeasured};
  if (!path.covers(moved.start_s, moved.end_s)) return moved;
  const Pose2 body = path.at(moved.start_s).inverse() * path.at(moved.end_s);
  moved.way_m = (mount.inverse() * body * mount).translation().norm();
  moved.turn_rad = wrap_angle(body.heading);
  return moved;
}

Vector channel(const std::vector<ReferenceStep>& steps, double ReferenceStep::*member) {
  Vector values(static_cast<Eigen::Index>(steps.size()));
  for (std::size_t i = 0; i < steps.size(); ++i) values[static_cast<Eigen::Index>(i)] = steps[i].*member;
  return values;
}

template <typename Values>
std::vector<Values> channels_of(const std::vector<ReferenceStep>& steps, bool with_heading) {
  std::vector<Values> channels{channel(steps, &ReferenceStep::way_m)};
  if (with_heading) channels.push_back(channel(steps, &ReferenceStep::turn_rad));
  return channels;
}

/// Beyond it a step of the reference is a jump: by its way over that on board in the median step in which the
/// robot clearly moves, whatever unit either has.
double longest_way(const std::vector<ReferenceStep>& seen, const std::vector<ReferenceStep>& on_board) {
  double farthest_m = 0.0;
  for (const ReferenceStep& step : on_board)
    if (step.way_m > farthest_m) farthest_m = step.way_m;
  std::vector<double> ratios;
  for (std::size_t i = 0; i < seen.size(); ++i)
    if (on_board[i].way_m > 0.25 * farthest_m) ratios.push_back(seen[i].way_m / on_board[i].way_m);
  return ratios.empty() ? 0.0 : kFasterThanAnyMotion * median(ratios) * farthest_m;
}

bool shows_motion(const ReferenceStream& reference) {
  return reference.time_s.size() >= 2 && reference.has_positions();
}

/// One log, ready to be compared at any offset.
struct LogOnTwoClocks {
  MotionPath path;
  Pose2 mount;
  std::vector<ReferenceStep> seen;
  double first_s = 0.0, last_s = 0.0;  ///< of the reference's stamps, that the motion on board covers
  bool has_heading = false;
  double sample_s = 0.0;  ///< usual step of the reference
  double row_s = 0.0;     ///< usual step of the motion on board
  double window_s = 0.0;

  std::vector<ReferenceStep> on_board(double offset_s) const {
    std::vector<ReferenceStep> steps;
    for (const ReferenceStep& step : seen) steps.push_back(step_on_board(step, path, mount, offset_s));
    return steps;
  }
};

std::optional<LogOnTwoClocks> on_two_clocks(const ReferenceStream& reference, std::optional<MotionPath> path,
                                            const Robot& robot, double shortest_window_s) {
  if (!path) return std::nullopt;
  LogOnTwoClocks result{.path = *std::move(path), .mount = robot.body_from_reference, .seen = {}};
  result.sample_s = median_step(reference.time_s);
  result.row_s = median_step(result.path.time_s);
  result.window_s = std::max(shortest_window_s, result.sample_s);
  result.has_heading = reference.has_headings();
  result.seen = steps_of(reference, result.window_s, result.has_heading);
  if (result.seen.empty()) return std::nullopt;
  const double given_s = robot.reference_time_offset_s;
  result.first_s = std::max(result.path.time_s.front() - given_s, result.seen.front().start_s);
  result.last_s = std::min(result.path.time_s.back() - given_s, result.seen.back().end_s);
  return result;
}

/// The steps that are compared whatever the offset: no jumps, and not near the ends of their log.
std::vector<bool> compared(const LogOnTwoClocks& log, double given_s, double largest_s) {
  const double longest_m = longest_way(log.seen, log.on_board(given_s));
  std::vector<bool> used;
  for (const ReferenceStep& step : log.seen)
    used.push_back(step.way_m <= longest_m && step.start_s >= log.first_s + largest_s &&
                   step.end_s <= log.last_s - largest_s);
  return used;
}

ReferenceStream stream_of(const Trajectory& trajectory) {
  ReferenceStream stream;
  for (const auto& [time_s, pose] : trajectory.poses) {
    stream.time_s.push_back(time_s);
    stream.x_m.push_back(pose.x);
    stream.y_m.push_back(pose.y);
    stream.heading_rad.push_back(pose.heading);
  }
  return stream;
}

std::optional<ClockComparison> comparison_of(std::vector<LogOnTwoClocks> logs, const Robot& robot,
                                             const TimeOffsetOptions& options) {
  if (logs.empty()) return std::nullopt;
  const auto most = [&](double LogOnTwoClocks::*member) {
    return std::ranges::max(logs, {}, member).*member;
  };
  const double window_s = most(&LogOnTwoClocks::window_s), row_s = most(&LogOnTwoClocks::row_s);
  std::vector<double> lengths_s;
  for (const LogOnTwoClocks& log : logs) lengths_s.push_back(log.last_s - log.first_s);
  const double given_s = robot.reference_time_offset_s;
  const double largest_s = std::min(options.largest_s, kShareSearched * median(lengths_s));
  if (!(largest_s > window_s)) return std::nullopt;

  ClockComparison comparison{
      .clocks = {},
      .search = {.given_s = given_s,
                 .largest_s = largest_s,
                 .step_s = 0.5 * window_s,
                 .change_s = row_s,
                 .least_sigma_s = std::max(most(&LogOnTwoClocks::sample_s), row_s) / 20.0,
                 .largest_sigma_s = options.largest_sigma_s,
                 .least_correlation = options.least_correlation}};
  TwoClocks& clocks = comparison.clocks;
  std::vector<ReferenceStep> seen;
  for (const LogOnTwoClocks& log : logs) {
    seen.insert(seen.end(), log.seen.begin(), log.seen.end());
    const std::vector<bool> used = compared(log, given_s, largest_s);
    clocks.used.insert(clocks.used.end(), used.begin(), used.end());
  }
  const bool with_heading = std::ranges::all_of(logs, &LogOnTwoClocks::has_heading);
  clocks.fixed = channels_of<Vector>(seen, with_heading);
  clocks.duration_s = channel(seen, &ReferenceStep::end_s) - channel(seen, &ReferenceStep::start_s);
  clocks.moved = [logs = std::move(logs), with_heading](double offset_s, std::vector<bool>& used) {
    std::vector<ReferenceStep> steps;
    for (const LogOnTwoClocks& log : logs)
      std::ranges::copy(log.on_board(offset_s), std::back_inserter(steps));
    for (std::size_t i = 0; i < steps.size(); ++i)
      if (!std::isfinite(steps[i].way_m)) used[i] = false;
    return channels_of<Eigen::MatrixXd>(steps, with_heading);
  };
  return comparison;
}

}  // namespace

std::optional<JointClocks> sensor_and_reference_clocks(MotionOnTwoClocks motion,
                                                       const ReferenceStream& reference, const Robot& robot,
                                                       const TimeOffsetOptions& options) {
  if (!shows_motion(reference) || !reference.has_headings()) return std::nullopt;
  auto log = on_two_clocks(reference, motion.path_at(0.0), robot, kReferenceClock.window_s);
  if (!log) return std::nullopt;
  const double row_s = std::max(log->row_s, motion.sensor_step_s), window_s = log->window_s;
  std::vector<LogOnTwoClocks> logs{*std::move(log)};
  auto alone = comparison_of(logs, robot, kReferenceClock);
  if (!alone) return std::nullopt;
  JointClocks clocks{.fixed = std::move(alone->clocks.fixed),
                     .duration_s = std::move(alone->clocks.duration_s),
                     .used = std::move(alone->clocks.used),
                     .moved = {},
                     .search = {OffsetSearch{.largest_s = options.largest_s,
                                             .step_s = 0.5 * window_s,
                                             .change_s = row_s,
                                             .least_sigma_s = row_s / 20.0,
                                             .largest_sigma_s = options.largest_sigma_s,
                                             .least_correlation = kReferenceClock.least_correlation},
                                alone->search}};
  clocks.moved = [motion = std::move(motion), log = std::move(logs.front()), at_s = 0.0](
                     const Eigen::Vector2d& offsets_s, std::vector<bool>& used) mutable {
    if (offsets_s[0] != std::exchange(at_s, offsets_s[0])) log.path = motion.path_at(offsets_s[0]).value();
    std::vector<ReferenceStep> steps = log.on_board(offsets_s[1]);
    for (std::size_t i = 0; i < steps.size(); ++i)
      if (!std::isfinite(steps[i].way_m)) {
        used[i] = false;
        steps[i].way_m = steps[i].turn_rad = 0.0;
      }
    auto channels = channels_of<Eigen::MatrixXd>(steps, true);
    if (motion.turns_by_way) {
      channels[1].conservativeResize(Eigen::NoChange, 2);
      channels[1].col(1) = channels[0];
    }
    return channels;
  };
  return clocks;
}

std::optional<ClockComparison> reference_clocks(std::span<const ReferenceLog> given, const Robot& robot,
                                                const TimeOffsetOptions& options) {
  std::vector<LogOnTwoClocks> logs;
  for (const ReferenceLog& log : given) {
    if (!shows_motion(log.reference)) continue;  // a path is as large as the log
    if (auto ready = on_two_clocks(log.reference, motion_path(log.readings, robot), robot, options.window_s))
      logs.push_back(*std::move(ready));
  }
  return comparison_of(std::move(logs), robot, options);
}

std::optional<TimeOffset> reference_time_offset(std::span<const ReferenceLog> logs, const Robot& robot,
                                                const TimeOffsetOptions& options) {
  std::optional<ClockComparison> comparison = reference_clocks(logs, robot, options);
  return comparison ? find_offset(*std::move(comparison)) : std::nullopt;
}

std::optional<TimeOffset> reference_time_offset(const ReferenceStream& reference,
                                                const AlignedReadings& readings, const Robot& robot,
                                                const TimeOffsetOptions& options) {
  const ReferenceLog log{reference, readings};
  auto found = reference_time_offset(std::span(&log, 1), robot, options);
  // A stamp says when a row was written, not when it was measured.
  if (found) found->least_s = median_step(reference.time_s) + usual_interval_s(readings.increments);
  return found;
}

std::optional<TimeOffset> reference_time_offset(const Trajectory& reference,
                                                const Trajectory& world_from_body, double longest_gap_s,
                                                const Robot& robot, const TimeOffsetOptions& options) {
  const ReferenceStream stream = stream_of(reference);
  if (!shows_motion(stream)) return std::nullopt;
  auto log = on_two_clocks(stream, motion_path(world_from_body, longest_gap_s), robot, options.window_s);
  if (!log) return std::nullopt;
  const double least_s = log->sample_s + log->row_s;
  std::vector<LogOnTwoClocks> logs;
  logs.push_back(*std::move(log));
  auto comparison = comparison_of(std::move(logs), robot, options);
  auto found = comparison ? find_offset(*std::move(comparison)) : std::nullopt;
  if (found) found->least_s = least_s;
  return found;
}

void move_stamps(double step_s, ReferenceStream& reference) {
  for (double& time_s : reference.time_s) time_s += step_s;
}

std::optional<TimeOffset> set_reference_clock(const std::optional<TimeOffset>& found, const Robot& robot,
                                              ReferenceStream& reference) {
  if (!found || !is_off(*found, robot.reference_time_offset_s)) return std::nullopt;
  move_stamps(found->offset_s - robot.reference_time_offset_s, reference);
  return found;
}

}  // namespace trundle::recording
