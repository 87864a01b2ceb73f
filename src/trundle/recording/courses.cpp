#include "trundle/recording/detail/courses.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "trundle/io/error.hpp"

namespace trundle {
namespace {

/// One step of a counter between neighbouring rows that have a count.
struct Step {
  std::size_t row = 0;  ///< where it ends
  double duration_s = 0.0;
  double travel = 0.0;
  bool measured = true;

  double speed() const { return travel / duration_s; }
};

/// The difference of two counts of a counter that wraps at 2^bits: the representative nearest to zero.
double unwrapped(double difference, int bits) {
  if (bits == 0) return difference;
  const double range = std::ldexp(1.0, bits);
  return difference - range * std::round(difference / range);
}

std::vector<Step> steps_of(std::span<const double> time_s, std::span<const double> count, int bits,
                           std::vector<std::size_t>& wraps) {
  std::vector<Step> steps;
  steps.reserve(count.size());
  std::size_t previous = count.size();
  for (std::size_t row = 0; row < count.size(); ++row) {
    if (std::isnan(count[row])) continue;
    if (previous != count.size()) {
      const double difference = count[row] - count[previous];
      const double travel = unwrapped(difference, bits);
      if (travel != difference) wraps.push_back(row);
      steps.push_back({row, time_s[row] - time_s[previous], travel});
    }
    previous = row;
  }
  return steps;
}

/// The speed that one in fifty of the moving steps exceeds, and at least two of them: breaks are no speeds.
double usual_top_speed(const std::vector<Step>& steps) {
  std::vector<double> speeds;
  for (const Step& step : steps)
    if (step.travel != 0.0) speeds.push_back(std::abs(step.speed()));
  if (speeds.empty()) return 0.0;
  const std::size_t faster = std::max(speeds.size() / 50, std::min<std::size_t>(2, speeds.size() / 4));
  const auto at = speeds.end() - 1 - static_cast<std::ptrdiff_t>(faster);
  std::nth_element(speeds.begin(), at, speeds.end());
  return *at;
}

/// The smallest difference that the reading shows: 1 for counts.
double resolution_of(const std::vector<Step>& steps) {
  double smallest = 0.0;
  for (const Step& step : steps)
    if (step.travel != 0.0 && (smallest == 0.0 || std::abs(step.travel) < smallest))
      smallest = std::abs(step.travel);
  return smallest;
}

/// Whether a step next to it goes the same way at a fourth of its speed or more: a wheel that drives, a
/// burst.
bool is_sustained(const std::vector<Step>& steps, std::size_t index) {
  const double speed = steps[index].speed();
  for (const std::size_t neighbour : {index - 1, index + 1})
    if (neighbour < steps.size() && steps[neighbour].speed() / speed >= 0.25) return true;
  return false;
}

/// Steps that are no travel. A robot of top speed v covers about v·Δt: five times that and landing near zero
/// is a reset, twenty times that is a jump; a few counts are always allowed, and so is what neighbouring
/// steps bear out.
void find_breaks(std::vector<Step>& steps, std::span<const double> count, CounterFindings& findings) {
  const double top_speed = usual_top_speed(steps);
  const double slack = resolution_of(steps);
  for (std::size_t i = 0; i < steps.size(); ++i) {
    Step& step = steps[i];
    const double plausible = top_speed * step.duration_s;
    const bool near_zero = std::abs(count[step.row]) <= 2.0 * plausible + 3.0 * slack;
    const bool reset = near_zero && std::abs(step.travel) > 5.0 * plausible + 10.0 * slack;
    const bool jump = std::abs(step.travel) > 20.0 * plausible + 100.0 * slack;
    if ((!reset && !jump) || is_sustained(steps, i)) continue;
    step.measured = false;
    (reset ? findings.resets : findings.jumps).push_back(step.row);
  }
}

/// The travel of a step that was not measured: at the mean of the speeds around it, none across a gap.
double travel_across(const std::vector<Step>& steps, std::size_t index, double longest_step_s) {
  const Step& step = steps[index];
  if (step.duration_s > longest_step_s) return 0.0;
  double sum = 0.0;
  int speeds = 0;
  for (const std::size_t neighbour : {index - 1, index + 1}) {
    if (neighbour >= steps.size() || !steps[neighbour].measured) continue;
    sum += steps[neighbour].speed();
    ++speeds;
  }
  return speeds == 0 ? 0.0 : sum / speeds * step.duration_s;
}

void fill_between(std::span<const double> time_s, std::size_t first, std::size_t last,
                  std::vector<double>& value) {
  const double slope = (value[last] - value[first]) / (time_s[last] - time_s[first]);
  for (std::size_t row = first + 1; row < last; ++row)
    value[row] = value[first] + slope * (time_s[row] - time_s[first]);
}

const WheelSeries& series_of(const Recording& recording, const std::string& wheel) {
  const auto& series = recording.wheels.series;
  const auto found =
      std::find_if(series.begin(), series.end(), [&](const WheelSeries& s) { return s.wheel == wheel; });
  if (found != series.end()) return *found;
  std::vector<std::string> others;
  for (const WheelSeries& other : series) others.push_back(other.wheel);
  const std::string nearest = nearest_name(wheel, others);
  const std::string& file = recording.wheels.origin.file;
  throw InputError(
      file.empty() ? recording.name : file, fmt::format("has no column of the wheel '{}'", wheel),
      nearest.empty() ? fmt::format("{0}_ticks, {0}_m or {0}_rad_s", wheel)
                      : fmt::format("'{}' in place of '{}', or the robot file's [[wheel]] named '{}'", wheel,
                                    nearest, nearest));
}

double units_per_turn(const WheelSeries& series, const Robot& robot, std::size_t index) {
  const Wheel& wheel = robot.chassis.wheels()[index];
  if (series.unit == WheelUnit::metres)
    return kPi * (wheel.recorded_diameter_m > 0.0 ? wheel.recorded_diameter_m : wheel.diameter_m);
  if (series.unit != WheelUnit::ticks) return 2.0 * kPi;
  if (wheel.ticks_per_revolution != 0.0) return wheel.ticks_per_revolution;
  throw InputError(place_of_wheel(robot, index),
                   fmt::format("the wheel '{}' has no ticks_per_revolution", series.wheel),
                   "ticks_per_revolution: the recording gives counts");
}

}  // namespace

Course course_of_counter(std::span<const double> time_s, std::span<const double> count, int bits,
                         double longest_step_s, CounterFindings& findings) {
  std::vector<Step> steps = steps_of(time_s, count, bits, findings.wraps);
  find_breaks(steps, count, findings);
  Course course;
  course.value.assign(count.size(), kNotMeasured);
  const auto first = std::find_if(count.begin(), count.end(), [](double c) { return !std::isnan(c); });
  if (first == count.end()) return course;
  auto previous = static_cast<std::size_t>(first - count.begin());
  double sum = 0.0;
  course.value[previous] = sum;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const Step& step = steps[i];
    sum += step.measured ? step.travel : travel_across(steps, i, longest_step_s);
    course.value[step.row] = sum;
    if (!step.measured) course.broken.push_back(step.row);
    if (step.row > previous + 1 && step.duration_s <= longest_step_s)
      fill_between(time_s, previous, step.row, course.value);
    previous = step.row;
  }
  return course;
}

Course course_of_rate(std::span<const double> time_s, std::span<const double> rate) {
  Course course;
  course.value.assign(time_s.size(), kNotMeasured);
  double sum = 0.0;
  for (std::size_t row = 0, previous = 0; row < time_s.size(); ++row) {
    if (row > 0 && std::isnan(rate[row])) continue;
    if (row > 0) sum += rate[row] * (time_s[row] - time_s[previous]);
    course.value[row] = sum;
    previous = row;
  }
  return course;
}

Course course_of_wheel(const Recording& recording, const Robot& robot, std::size_t index,
                       double longest_step_s, std::vector<Finding>& problems) {
  const WheelSeries& series = series_of(recording, robot.wheel_names[index]);
  const Wheel& wheel = robot.chassis.wheels()[index];
  const std::vector<double>& time_s = recording.wheels.time_s;
  Course course;
  if (series.unit == WheelUnit::rate) {
    course = course_of_rate(time_s, series.value);
  } else {
    CounterFindings findings;
    const int bits = series.unit == WheelUnit::ticks ? wheel.tick_bits : 0;
    course = course_of_counter(time_s, series.value, bits, longest_step_s, findings);
    report(findings, series.wheel, recording.wheels.origin, problems);
  }
  course.units_per_turn = units_per_turn(series, robot, index);
  return course;
}

void report(const CounterFindings& findings, const std::string& wheel, const StreamOrigin& origin,
            std::vector<Finding>& problems) {
  const auto add = [&](Severity severity, FindingCode code, const std::vector<std::size_t>& rows) {
    if (!rows.empty())
      problems.push_back({severity, code, origin.place_of(rows.front()), rows.size(), {wheel}});
  };
  add(Severity::note, FindingCode::wrap, findings.wraps);
  add(Severity::warning, FindingCode::counter_reset, findings.resets);
  add(Severity::warning, FindingCode::counter_jump, findings.jumps);
}

}  // namespace trundle
