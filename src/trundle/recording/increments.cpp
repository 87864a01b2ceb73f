#include "trundle/recording/increments.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>
#include <span>

#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/recording/csv/detail/table.hpp"
#include "trundle/recording/detail/courses.hpp"

namespace trundle {
namespace {

std::vector<double> shifted(std::vector<double> time_s, double offset_s) {
  for (double& time : time_s) time += offset_s;
  return time_s;
}

/// Rows whose step was not measured for one of the courses.
std::vector<bool> broken_rows(std::span<const Course> courses, std::size_t rows) {
  std::vector<bool> broken(rows);
  for (const Course& course : courses)
    for (const std::size_t row : course.broken) broken[row] = true;
  return broken;
}

/// Increments between the rows of the time base where every course is known.
AlignedReadings increments_between(const std::vector<double>& time_s, std::span<const Course> courses,
                                   double longest_s) {
  const std::vector<bool> is_broken = broken_rows(courses, time_s.size());
  AlignedReadings aligned;
  aligned.increments.reserve(time_s.size());
  std::size_t previous = time_s.size();
  bool broken = false;
  for (std::size_t row = 0; row < time_s.size(); ++row) {
    broken = broken || is_broken[row];
    if (std::any_of(courses.begin(), courses.end(),
                    [&](const Course& c) { return std::isnan(c.value[row]); }))
      continue;
    if (previous == time_s.size()) {
      aligned.start_s = time_s[row];
    } else {
      Increment& increment = aligned.increments.emplace_back();
      increment.time_s = time_s[row];
      increment.duration_s = time_s[row] - time_s[previous];
      for (std::size_t i = 0; i < courses.size(); ++i)
        increment.turned[i] =
            (courses[i].value[row] - courses[i].value[previous]) / courses[i].units_per_turn;
      aligned.bridged.push_back(broken || increment.duration_s > longest_s);
    }
    previous = row;
    broken = false;
  }
  return aligned;
}

AlignedReadings align_wheels(const Recording& recording, const Robot& robot) {
  const std::vector<double> time_s = shifted(recording.wheels.time_s, robot.chassis.wheels_time_offset_s);
  const double longest_s = longest_step(time_s);
  std::vector<Course> courses;
  std::vector<Finding> problems;
  for (std::size_t i = 0; i < robot.wheel_names.size(); ++i)
    courses.push_back(course_of_wheel(recording, robot, i, longest_s, problems));
  AlignedReadings aligned = increments_between(time_s, courses, longest_s);
  aligned.problems = std::move(problems);
  return aligned;
}

AlignedReadings align_velocity(const Recording& recording, const Robot& robot) {
  const std::vector<double> time_s = shifted(recording.velocity.time_s, robot.chassis.wheels_time_offset_s);
  const double longest_s = longest_step(time_s);
  const std::vector<Course> courses = {course_of_rate(time_s, recording.velocity.forward_m_s),
                                       course_of_rate(time_s, recording.velocity.yaw_rate_rad_s)};
  return increments_between(time_s, courses, longest_s);
}

/// The integral of the gyro's raw reading, read off at times that only grow.
class GyroIntegral {
 public:
  GyroIntegral(const GyroStream& stream, const Gyro& gyro)
      : time_s_(shifted(stream.time_s, gyro.time_offset_s)) {
    const double longest_s = longest_step(time_s_);
    angle_.resize(time_s_.size());
    lost_.resize(time_s_.size());
    for (std::size_t k = 1; k < time_s_.size(); ++k) {
      const double rate = stream.yaw_rate_rad_s[k];
      const double step_s = time_s_[k] - time_s_[k - 1];
      const bool saturated = std::abs(rate) >= gyro.max_rate_rad_s;
      saturated_ += saturated ? 1 : 0;
      const bool lost = std::isnan(rate) || saturated || step_s > longest_s;
      angle_[k] = angle_[k - 1] + (lost ? 0.0 : rate * step_s);
      lost_[k] = lost_[k - 1] + (lost ? 1 : 0);
    }
    first_rate_ = stream.yaw_rate_rad_s.front();
    last_rate_ = stream.yaw_rate_rad_s.back();
    const auto reach = [&](std::size_t step) {
      const double step_s = time_s_[step] - time_s_[step - 1];
      return step_s > longest_s ? 0.0 : step_s;
    };
    if (time_s_.size() < 2) return;
    before_s_ = reach(1);
    beyond_s_ = reach(time_s_.size() - 1);
  }

  /// The turn between two times in order; nothing where the gyro has a gap or was saturated.
  std::optional<double> between(double start_s, double end_s) {
    const Reading start = at(start_s);
    const Reading end = at(end_s);
    if (!(std::abs(end.angle - start.angle) < kUnknown) || end.lost_after != start.lost_before)
      return std::nullopt;
    return end.angle - start.angle;
  }
  std::size_t saturated() const { return saturated_; }

 private:
  static constexpr double kUnknown = std::numeric_limits<double>::infinity();
  struct Reading {
    double angle = kNotMeasured;
    std::size_t lost_before = 0;  // lost steps up to the sample before the time, or at it
    std::size_t lost_after = 0;   // and up to the sample after it, or at it
  };

  /// Beyond its ends the stream holds for a step, its first or last: samples of two sensors never start and
  /// end together.
  Reading at(double time_s) {
    while (cursor_ + 1 < time_s_.size() && time_s_[cursor_] < time_s) ++cursor_;
    const std::size_t after = cursor_;
    const double ahead_s = time_s_[after] - time_s;
    if (ahead_s < 0.0)  // after the last sample
      return -ahead_s <= beyond_s_ ? Reading{angle_[after] - last_rate_ * ahead_s, lost_[after], lost_[after]}
                                   : Reading{};
    if (ahead_s == 0.0) return {angle_[after], lost_[after], lost_[after]};
    if (after == 0) return ahead_s <= before_s_ ? Reading{-first_rate_ * ahead_s, 0, 0} : Reading{};
    const double u = 1.0 - ahead_s / (time_s_[after] - time_s_[after - 1]);
    return {angle_[after - 1] + u * (angle_[after] - angle_[after - 1]), lost_[after - 1], lost_[after]};
  }

  std::vector<double> time_s_;
  double before_s_ = 0.0;
  double beyond_s_ = 0.0;
  std::vector<double> angle_;
  std::vector<std::size_t> lost_;  // steps without a usable rate up to this sample
  double first_rate_ = 0.0;
  double last_rate_ = 0.0;
  std::size_t saturated_ = 0;
  std::size_t cursor_ = 0;
};

constexpr double kRateOver_s = 0.1;  // on either side of an instant: a single sample's rate is mostly noise

/// What the gyro turned in at least so long, from an increment on, forwards or backwards; nothing across
/// gaps.
struct Turned {
  double gyro_rad = 0.0;
  double duration_s = 0.0;

  template <class Iterator>
  static std::optional<Turned> over(Iterator from, Iterator end) {
    Turned turned;
    for (; from != end && from->has_gyro; ++from) {
      turned.gyro_rad += from->gyro_rad;
      turned.duration_s += from->duration_s;
      if (turned.duration_s >= kRateOver_s - 1e-9) return turned;
    }
    return std::nullopt;
  }
};

/// The rate at a stamp is the mean over both its sides. At gaps and ends nothing is said.
void add_changes_of_rate(std::vector<Increment>& increments) {
  double before = kNotMeasured;  // rate at the start of the increment
  for (std::size_t i = 0; i < increments.size(); ++i) {
    const auto next = increments.begin() + static_cast<std::ptrdiff_t>(i + 1);
    const auto later = Turned::over(next, increments.end());
    const auto earlier = Turned::over(std::make_reverse_iterator(next), increments.rend());
    const double after =
        later && earlier ? (later->gyro_rad + earlier->gyro_rad) / (later->duration_s + earlier->duration_s)
                         : kNotMeasured;
    const double change = after - before;
    increments[i].gyro_change_rad_s = std::isnan(change) ? 0.0 : change;
    before = after;
  }
}

/// rms of the accelerometer about its mean over each interval, of both axes together; two samples at least.
void add_shaking(const AccelStream& accel, AlignedReadings& aligned) {
  std::size_t row = 0;
  for (Increment& increment : aligned.increments) {
    const double start_s = increment.time_s - increment.duration_s;
    while (row < accel.time_s.size() && accel.time_s[row] <= start_s) ++row;
    double count = 0.0, x = 0.0, y = 0.0, squares = 0.0;
    for (; row < accel.time_s.size() && accel.time_s[row] <= increment.time_s; ++row) {
      const double ax = accel.x_m_s2[row];
      const double ay = accel.y_m_s2[row];
      if (std::isnan(ax) || std::isnan(ay)) continue;
      count += 1.0;
      const double dx = ax - x;
      const double dy = ay - y;
      x += dx / count;
      y += dy / count;
      squares += dx * (ax - x) + dy * (ay - y);
    }
    if (count >= 2.0) increment.shaking_m_s2 = std::sqrt(squares / (count - 1.0));
  }
}

}  // namespace

void add_gyro(const GyroStream& gyro, const Robot& robot, AlignedReadings& aligned) {
  if (!robot.chassis.gyro || gyro.time_s.empty() || aligned.increments.empty()) return;
  GyroIntegral integral(gyro, *robot.chassis.gyro);
  const double first_s = gyro.time_s.front() + robot.chassis.gyro->time_offset_s;
  const double last_s = gyro.time_s.back() + robot.chassis.gyro->time_offset_s;
  double start_s = aligned.start_s;
  std::size_t beyond = 0, within = 0;
  for (Increment& increment : aligned.increments) {
    const auto turn = integral.between(start_s, increment.time_s);
    increment.gyro_rad = turn.value_or(0.0);
    increment.has_gyro = turn.has_value();
    if (!turn) ++(start_s < first_s || increment.time_s > last_s ? beyond : within);
    start_s = increment.time_s;
  }
  add_changes_of_rate(aligned.increments);
  const auto tell = [&](Severity severity, FindingCode code, std::size_t count, const Payload& payload) {
    if (count > 0)
      aligned.problems.push_back(
          {severity, code, gyro.origin.place_of(gyro.time_s.size()), count, {}, payload});
  };
  tell(Severity::warning, FindingCode::gyro_saturated, integral.saturated(), {});
  tell(Severity::warning, FindingCode::gyro_missing, within, {});
  const bool most = 2 * beyond > aligned.increments.size();
  tell(most ? Severity::warning : Severity::note, FindingCode::gyro_missing, beyond,
       payload::Spans{first_s, last_s, aligned.start_s, aligned.increments.back().time_s});
}

AlignedReadings align(const Recording& recording, const Robot& robot) {
  const bool by_wheels = robot.chassis.wheel_count > 0;
  if (by_wheels && recording.wheels.time_s.empty())
    throw InputError(recording.name, "has no wheels.csv", "a stream of the robot's wheels");
  if (!by_wheels && recording.velocity.time_s.empty())
    throw InputError(recording.name, "has no velocity.csv", "a velocity stream: the robot has no wheels");
  AlignedReadings aligned = by_wheels ? align_wheels(recording, robot) : align_velocity(recording, robot);
  add_gyro(recording.gyro, robot, aligned);
  add_shaking(recording.accel, aligned);
  return aligned;
}

Trajectory reference_trajectory(const Recording& recording) {
  const ReferenceStream& reference = recording.reference;
  Trajectory trajectory;
  for (std::size_t row = 0; row < reference.time_s.size(); ++row) {
    const Pose2 pose{reference.x_m[row], reference.y_m[row], reference.heading_rad[row]};
    if (std::isfinite(pose.x) && std::isfinite(pose.y) && std::isfinite(pose.heading))
      trajectory.poses.push_back({reference.time_s[row], pose});
  }
  return trajectory;
}

}  // namespace trundle
