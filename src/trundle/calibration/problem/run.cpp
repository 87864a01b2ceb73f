#include "trundle/calibration/problem/run.hpp"

#include <algorithm>
#include <cmath>

#include "trundle/odometry/odometer.hpp"
#include "trundle/statistics/median.hpp"

namespace trundle::calibration {
namespace {

// The errors of a reference (body wobble, tracking) are alike for a second or so.
constexpr double kShortestEpochSpacing_s = 1.0;
// Bounds the time that a long run takes: its epochs lie farther apart.
constexpr std::size_t kMostEpochs = 400;
// Over which the reference is interpolated: at 1 m/s² a line misses an arc by a²/8 = 3 cm.
constexpr double kLongestGap_s = 0.5;
// Over which it is where all its samples lie so far apart (GPS at 1 Hz): right beside one of them, which is
// where epochs then are.
constexpr double kLongestStep_s = 2.0;
constexpr double kLikeItsNeighbours = 1.5;  // times the shorter of the steps beside it: no gap
// Over which to both sides its rate is taken: between neighbouring samples noise would pass for motion.
constexpr double kHalfRateWindow_s = 0.1;
// A jump is so many times the usual disagreement of reference and nominal odometry from epoch to epoch, and
// at least this.
constexpr double kJump = 15.0;
constexpr double kSmallestJump_m = 0.1;     // the least that is called one
constexpr double kSmallestJump_rad = 0.35;  // 20°
// Ten intervals between epochs, as for the growth of differences (noise/growth.cpp): with fewer, what goes as
// the time and what goes as its root are alike.
constexpr double kShortestForBias_s = 10.0 * kShortestEpochSpacing_s;
// For a median of what is usual.
constexpr std::size_t kFewestEpochsForJumps = 10;

/// Whether nothing may be interpolated from the sample before to this one.
bool is_gap(const std::vector<double>& t, std::size_t after) {
  const double step_s = t[after] - t[after - 1];
  if (step_s <= kLongestGap_s) return step_s <= 0.0;
  double beside_s = kLongestStep_s;
  if (after > 1) beside_s = std::min(beside_s, t[after - 1] - t[after - 2]);
  if (after + 1 < t.size()) beside_s = std::min(beside_s, t[after + 1] - t[after]);
  return step_s > kLongestStep_s || step_s > kLikeItsNeighbours * beside_s;
}

/// A value between two samples, by the cubic through them whose slopes are those of their neighbours
/// (Catmull–Rom) where these are near: a chord cuts every bend short, always to the same side.
double interpolated(const std::vector<double>& t, const std::vector<double>& values, std::size_t after,
                    double time_s, bool is_angle) {
  const auto step = [&](std::size_t to) {
    const double difference = values[to] - values[to - 1];
    return is_angle ? wrap_angle(difference) : difference;
  };
  const auto slope = [&](std::size_t to) {  // of the interval that ends there; NaN across gaps
    return is_gap(t, to) ? kNotMeasured : step(to) / (t[to] - t[to - 1]);
  };
  const double gap = t[after] - t[after - 1];
  const double u = (time_s - t[after - 1]) / gap, v = 1.0 - u;
  const double chord = values[after - 1] + u * step(after);
  if (after < 2 || after + 1 >= t.size()) return chord;
  const double here = slope(after), before = slope(after - 1), next = slope(after + 1);
  const double bend = 0.5 * gap * u * v * (v * (before - here) - u * (next - here));
  return std::isfinite(bend) ? chord + bend : chord;
}

/// x, y and heading; NaN where not measured, and across gaps.
Vector3 value_at(const ReferenceStream& reference, double time_s) {
  Vector3 value = Vector3::Constant(kNotMeasured);
  const auto& t = reference.time_s;
  const auto after = std::ranges::lower_bound(t, time_s);
  const bool at_start = after == t.begin() && after != t.end() && *after - time_s < 1e-9;
  if (after == t.end() || (after == t.begin() && !at_start) || t.size() < 2) {
    // The last stamp may lie a rounding error before the time that is asked for.
    if (t.size() < 2 || after != t.end() || time_s - t.back() > 1e-9) return value;
  }
  const auto j = std::clamp<std::size_t>(static_cast<std::size_t>(after - t.begin()), 1, t.size() - 1);
  if (is_gap(t, j)) return value;
  if (!reference.x_m.empty()) value.x() = interpolated(t, reference.x_m, j, time_s, false);
  if (!reference.y_m.empty()) value.y() = interpolated(t, reference.y_m, j, time_s, false);
  if (!reference.heading_rad.empty()) value.z() = interpolated(t, reference.heading_rad, j, time_s, true);
  return value;
}

std::vector<std::size_t> choose_epochs(const Run& run, double time_offset_s) {
  std::vector<std::size_t> epochs;
  const auto& increments = run.readings.increments;
  if (increments.empty() || run.reference.time_s.empty()) return epochs;
  const double duration = increments.back().time_s - run.readings.start_s;
  const double spacing = std::max(kShortestEpochSpacing_s, duration / static_cast<double>(kMostEpochs));
  double next = run.readings.start_s;
  for (std::size_t n = 0; n <= increments.size(); ++n) {
    const double time = n == 0 ? run.readings.start_s : increments.time_s(n - 1);
    const bool last = n == increments.size();
    if (!last && time < next - 1e-9) continue;
    if (!is_seen(run.reference, time - time_offset_s, n == 0 ? 0.0 : increments.duration_s(n - 1))) continue;
    if (sample_reference(run.reference, time - time_offset_s).empty()) continue;
    epochs.push_back(n);
    next = time + spacing;
  }
  return epochs;
}

/// By how much the motion from each epoch to the next differs between reference and nominal odometry.
struct Disagreement {
  std::vector<double> distance_m;
  std::vector<double> turn_rad;
};

Disagreement disagreement(const Run& run, const Robot& robot) {
  Disagreement result;
  Odometer odometer(robot, {.with_covariance = false});
  const Pose2& mount = robot.body_from_reference;
  ReferenceSample before = sample_reference(run.reference, run.epoch_time(0) - robot.reference_time_offset_s);
  for (std::size_t epoch = 1; epoch < run.epochs.size(); ++epoch) {
    const Pose2 from = odometer.pose();
    for (std::size_t i = run.epochs[epoch - 1]; i < run.epochs[epoch]; ++i)
      odometer.step(run.readings.increments[i]);
    const Pose2 moved = mount.inverse() * (from.inverse() * odometer.pose()) * mount;  // the sensor
    const ReferenceSample after =
        sample_reference(run.reference, run.epoch_time(epoch) - robot.reference_time_offset_s);
    const Vector3 seen = after.value - before.value;
    const double distance = seen.head<2>().norm() - moved.translation().norm();
    const double turn = wrap_angle(seen.z() - moved.heading);
    result.distance_m.push_back(std::isfinite(distance) ? std::abs(distance) : 0.0);
    result.turn_rad.push_back(std::isfinite(turn) ? std::abs(turn) : 0.0);
    before = after;
  }
  return result;
}

std::vector<std::size_t> find_jumps(const Run& run, const Robot& robot) {
  std::vector<std::size_t> jumps;
  if (run.epochs.size() < kFewestEpochsForJumps || observability(rows_of(robot.chassis, true)).rank < 3)
    return jumps;
  const Disagreement d = disagreement(run, robot);
  const double distance_limit = std::max(kJump * median(d.distance_m), kSmallestJump_m);
  const double turn_limit = std::max(kJump * median(d.turn_rad), kSmallestJump_rad);
  for (std::size_t i = 0; i < d.distance_m.size(); ++i)
    if (d.distance_m[i] > distance_limit || d.turn_rad[i] > turn_limit) jumps.push_back(i + 1);
  return jumps;
}

/// An epoch that both its neighbours contradict is no place where the robot was. Returns whether there was
/// one, which is left out.
bool leave_out_lone_epochs(Run& run) {
  const auto starts_piece = [&](std::size_t epoch) {
    return epoch == 0 || epoch == run.epochs.size() || std::ranges::binary_search(run.jumps, epoch);
  };
  std::vector<std::size_t> kept;
  for (std::size_t epoch = 0; epoch < run.epochs.size(); ++epoch)
    if (!starts_piece(epoch) || !starts_piece(epoch + 1)) kept.push_back(run.epochs[epoch]);
  if (kept.size() == run.epochs.size() || kept.size() < 2) return false;
  run.epochs = std::move(kept);
  return true;
}

}  // namespace

bool is_seen(const ReferenceStream& reference, double time_s, double row_s) {
  const auto& t = reference.time_s;
  const auto after = std::ranges::lower_bound(t, time_s);
  if (after == t.end() || after == t.begin() || *after - *(after - 1) <= kLongestGap_s) return true;
  return std::min(*after - time_s, time_s - *(after - 1)) <= 0.5 * row_s + 1e-9;
}

ReferenceSample sample_reference(const ReferenceStream& reference, double time_s) {
  ReferenceSample sample{.value = value_at(reference, time_s)};
  if (sample.empty()) return sample;
  const Vector3 before = value_at(reference, time_s - kHalfRateWindow_s);
  const Vector3 after = value_at(reference, time_s + kHalfRateWindow_s);
  for (int i = 0; i < 3; ++i) {
    // At the ends, and beside gaps, of one side alone.
    const double from = std::isfinite(before[i]) ? before[i] : sample.value[i];
    const double to = std::isfinite(after[i]) ? after[i] : sample.value[i];
    const int sides = (std::isfinite(before[i]) ? 1 : 0) + (std::isfinite(after[i]) ? 1 : 0);
    const double step = i == 2 ? wrap_angle(to - from) : to - from;
    if (sides > 0 && std::isfinite(step)) sample.rate[i] = step / (sides * kHalfRateWindow_s);
  }
  return sample;
}

bool Run::measures_length() const {
  return reference.has_positions() || !relative_motions.empty() || partial.distance_m || partial.end_x_m ||
         partial.end_y_m;
}

bool Run::measures_anything() const {
  return !epochs.empty() || !relative_motions.empty() || !partial.empty();
}

bool Run::shows_gyro_bias() const {
  const Increments& increments = readings.increments;
  return !increments.empty() && increments.back().time_s - readings.start_s >= kShortestForBias_s &&
         std::ranges::any_of(increments, &Increment::has_gyro);
}

Increment step_along(const Run& run, std::size_t interval, Odometer& odometer) {
  const Increment increment = run.readings.increments[interval];
  if (run.readings.bridged[interval])
    odometer.step_across_gap(increment);
  else
    odometer.step(increment);
  return increment;
}

std::optional<Pose2> body_by_reference(const Run& run, std::size_t increments, const Robot& robot) {
  const double time_s =
      increments == 0 ? run.readings.start_s : run.readings.increments.time_s(increments - 1);
  const ReferenceSample sample = sample_reference(run.reference, time_s - robot.reference_time_offset_s);
  if (!sample.has_position() || !sample.has_heading()) return std::nullopt;
  return Pose2{sample.value.x(), sample.value.y(), sample.value.z()} * robot.body_from_reference.inverse();
}

std::vector<bool> poses_about_reference(const Run& run, const Robot& robot) {
  const Increments& increments = run.readings.increments;
  std::vector<bool> about(increments.size() + 1);
  const auto time_of = [&](std::size_t pose) {
    return pose == 0 ? run.readings.start_s : increments.time_s(pose - 1);
  };
  std::size_t after = 0;
  for (const double time_s : run.reference.time_s) {
    while (after < about.size() && time_of(after) < time_s + robot.reference_time_offset_s) ++after;
    for (std::size_t pose = after - std::min<std::size_t>(after, 2); pose < std::min(after + 2, about.size());
         ++pose)
      about[pose] = true;
  }
  return about;
}

void set_gyro_clock(const Robot& robot, Run& run) {
  add_gyro(run.gyro, robot, run.readings);
  centre_gyro_changes(run.readings);
}

Run prepare_run(const Recording& recording, const Robot& robot) {
  return prepare_run(recording, robot, align(recording, robot));
}

Run prepare_run(const Recording& recording, const Robot& robot, AlignedReadings readings) {
  Run run{.name = recording.name,
          .session = recording.session,
          .readings = std::move(readings),
          .gyro = recording.gyro,
          .reference = recording.reference,
          .reference_clock = {},
          .seen_reference_clock = {},
          .partial = recording.partial,
          .relative_motions = recording.relative_motions,
          .epochs = {},
          .jumps = {}};
  centre_gyro_changes(run.readings);
  if (robot.chassis.wheel_count > 0)
    add_speeds(robot.chassis, run.readings);  // whether they matter is asked of each run
  if (run.shows_gyro_bias() && robot.chassis.gyro) {
    run.gyro_walk =
        bias_walk_of(*robot.chassis.gyro, run.readings.start_s, run.readings.increments.back().time_s);
    run.gyro_walk_moved.setZero(run.gyro_walk.harmonics);
  }
  run.seen_reference_clock = reference_time_offset(run.reference, run.readings, robot);
  run.reference_clock = set_reference_clock(run.seen_reference_clock, robot, run.reference);
  run.epochs = choose_epochs(run, robot.reference_time_offset_s);
  if (run.epochs.size() < 2) run.epochs.clear();
  run.jumps = find_jumps(run, robot);
  if (leave_out_lone_epochs(run)) run.jumps = find_jumps(run, robot);
  return run;
}

}  // namespace trundle::calibration
