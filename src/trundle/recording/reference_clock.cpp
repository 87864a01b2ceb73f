#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Core>

#include "trundle/chassis/rows.hpp"
#include "trundle/recording/csv/detail/table.hpp"
#include "trundle/recording/detail/offset_search.hpp"
#include "trundle/statistics/median.hpp"

namespace trundle::recording {
namespace {

using Vector = Eigen::VectorXd;

// Nothing is interpolated across a longer one.
constexpr double kLongestGap_s = 0.5;
// Times what the robot drives at its fastest: a reference that moves faster has jumped.
constexpr double kFasterThanAnyMotion = 3.0;
// Of the log, searched on either side: two thirds of it are compared.
constexpr double kShareSearched = 1.0 / 6.0;

/// How a body moved in one window.
struct WindowStep {
  double way_m = 0.0;  ///< straight from its start to its end
  double turn_rad = 0.0;
};

/// Of the reference sensor, by the sensors on board.
struct MotionWindows {
  std::vector<double> bounds_s;  ///< the start of each window, and the end of the last
  std::vector<WindowStep> steps;
  std::vector<bool> whole;  ///< no gap was bridged

  Vector channel(double WindowStep::*member) const {
    Vector values(static_cast<Eigen::Index>(steps.size()));
    for (std::size_t w = 0; w < steps.size(); ++w) values[static_cast<Eigen::Index>(w)] = steps[w].*member;
    return values;
  }
};

MotionWindows motion_windows_of(const AlignedReadings& readings, const Robot& robot, bool with_gyro,
                                double window_s) {
  MotionWindows windows{.bounds_s = {readings.start_s}, .steps = {}, .whole = {}};
  const Rows rows = rows_of(robot.chassis, with_gyro);
  const Pose2& mount = robot.body_from_reference;
  Pose2 moved;
  bool whole = true;
  for (std::size_t i = 0; i < readings.increments.size(); ++i) {
    const Increment& increment = readings.increments[i];
    whole = whole && !readings.bridged[i] && (increment.has_gyro || !with_gyro);
    moved = moved * exp(twist_of(robot.chassis, rows, increment));
    if (increment.time_s - windows.bounds_s.back() < window_s - 1e-9) continue;
    const Pose2 step = mount.inverse() * moved * mount;
    windows.bounds_s.push_back(increment.time_s);
    windows.steps.push_back({step.translation().norm(), moved.heading});
    windows.whole.push_back(whole);
    moved = {};
    whole = true;
  }
  return windows;
}

/// A reference as it is read off at rising times.
class ReferenceReader {
 public:
  explicit ReferenceReader(const ReferenceStream& reference) : reference_(reference) {}

  /// x, y, heading by linear interpolation; NaN outside, across a gap and where nothing was measured.
  Vector3 at(double time_s) {
    const std::vector<double>& t = reference_.time_s;
    while (next_ < t.size() && t[next_] < time_s) ++next_;
    if (next_ == 0 || next_ == t.size() || t[next_] - t[next_ - 1] > kLongestGap_s)
      return Vector3::Constant(kNotMeasured);
    const double u = (time_s - t[next_ - 1]) / (t[next_] - t[next_ - 1]);
    const auto between = [&](const std::vector<double>& values) {
      return values.empty() ? kNotMeasured : values[next_ - 1] + u * (values[next_] - values[next_ - 1]);
    };
    return {between(reference_.x_m), between(reference_.y_m), between(reference_.heading_rad)};
  }

 private:
  const ReferenceStream& reference_;
  std::size_t next_ = 0;
};

/// What the reference did in each window, its stamps moved by `offset_s`; NaN where it did not measure.
std::vector<WindowStep> steps_by(const ReferenceStream& reference, const std::vector<double>& bounds_s,
                                 double offset_s) {
  ReferenceReader reader(reference);
  std::vector<WindowStep> steps;
  Vector3 before = reader.at(bounds_s.front() - offset_s);
  for (std::size_t w = 1; w < bounds_s.size(); ++w) {
    const Vector3 after = reader.at(bounds_s[w] - offset_s);
    const Vector3 step = after - before;
    steps.push_back({step.head<2>().norm(), step.z()});
    before = after;
  }
  return steps;
}

/// Way over way where both sensors moved: that of the median window, whatever unit either has.
double usual_ratio(const std::vector<WindowStep>& by_reference, const MotionWindows& windows,
                   double fastest_m) {
  std::vector<double> ratios;
  for (std::size_t w = 0; w < by_reference.size(); ++w)
    if (windows.steps[w].way_m > 0.25 * fastest_m && std::isfinite(by_reference[w].way_m))
      ratios.push_back(by_reference[w].way_m / windows.steps[w].way_m);
  return ratios.empty() ? 0.0 : median(ratios);
}

bool any_finite(const std::vector<double>& values) {
  return std::ranges::any_of(values, [](double v) { return std::isfinite(v); });
}

}  // namespace

std::optional<TimeOffset> reference_time_offset(const ReferenceStream& reference,
                                                const AlignedReadings& readings, const Robot& robot,
                                                const TimeOffsetOptions& options) {
  const bool with_gyro = observability(rows_of(robot.chassis, false)).rank < 3;
  if (reference.time_s.size() < 2 || readings.increments.empty() || !any_finite(reference.x_m) ||
      observability(rows_of(robot.chassis, with_gyro)).rank < 3)
    return std::nullopt;
  const double sample_s = median_step(reference.time_s);
  const double window_s = std::max(options.window_s, 2.0 * sample_s);
  const MotionWindows windows = motion_windows_of(readings, robot, with_gyro, window_s);
  if (windows.steps.empty()) return std::nullopt;

  const double given_s = robot.reference_time_offset_s;
  const double first_s = std::max(windows.bounds_s.front(), reference.time_s.front() + given_s);
  const double last_s = std::min(windows.bounds_s.back(), reference.time_s.back() + given_s);
  const double largest_s = std::min(options.largest_s, kShareSearched * (last_s - first_s));
  if (!(largest_s > window_s)) return std::nullopt;
  std::vector<bool> used = windows.whole;
  for (std::size_t w = 0; w < used.size(); ++w)
    if (windows.bounds_s[w] < first_s + largest_s || windows.bounds_s[w + 1] > last_s - largest_s)
      used[w] = false;

  const double fastest_m = std::ranges::max(windows.steps, {}, &WindowStep::way_m).way_m;
  const double ratio = usual_ratio(steps_by(reference, windows.bounds_s, given_s), windows, fastest_m);
  const double farthest_m = kFasterThanAnyMotion * ratio * fastest_m;
  const bool with_heading = any_finite(reference.heading_rad);
  TwoClocks clocks{
      .by_wheels = {windows.channel(&WindowStep::way_m)}, .duration_s = {}, .used = used, .by_other = {}};
  if (with_heading) clocks.by_wheels.push_back(windows.channel(&WindowStep::turn_rad));
  clocks.duration_s.resize(static_cast<Eigen::Index>(used.size()));
  for (std::size_t w = 0; w < used.size(); ++w)
    clocks.duration_s[static_cast<Eigen::Index>(w)] = windows.bounds_s[w + 1] - windows.bounds_s[w];
  clocks.by_other = [&](double offset_s, std::vector<bool>& still_used) {
    MotionWindows seen{.bounds_s = {}, .steps = steps_by(reference, windows.bounds_s, offset_s), .whole = {}};
    for (std::size_t w = 0; w < seen.steps.size(); ++w) {
      const WindowStep& step = seen.steps[w];
      if (!(step.way_m <= farthest_m) || (with_heading && !std::isfinite(step.turn_rad)))
        still_used[w] = false;
    }
    std::vector<Vector> channels{seen.channel(&WindowStep::way_m)};
    if (with_heading) channels.push_back(seen.channel(&WindowStep::turn_rad));
    return channels;
  };
  return find_offset(std::move(clocks), {.given_s = given_s,
                                         .largest_s = largest_s,
                                         .step_s = 0.25 * window_s,
                                         .sample_s = sample_s,
                                         .largest_sigma_s = options.largest_sigma_s,
                                         .least_correlation = options.least_correlation});
}

std::optional<TimeOffset> set_reference_clock(const AlignedReadings& readings, const Robot& robot,
                                              ReferenceStream& reference) {
  const auto found = reference_time_offset(reference, readings, robot);
  if (!found || !is_off(*found, robot.reference_time_offset_s)) return std::nullopt;
  for (double& time_s : reference.time_s) time_s += found->offset_s - robot.reference_time_offset_s;
  return found;
}

}  // namespace trundle::recording
