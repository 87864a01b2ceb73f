#include "trundle/recording/time_offset.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <Eigen/Core>

#include "trundle/chassis/rows.hpp"
#include "trundle/recording/alignment/aligner.hpp"
#include "trundle/recording/csv/detail/table.hpp"
#include "trundle/recording/detail/offset_search.hpp"

namespace trundle::recording {
namespace {

using Vector = Eigen::VectorXd;

/// Windows of contiguous intervals: what the wheels turned, and by which rows.
struct Windows {
  std::vector<double> time_s;      ///< of the rows: one more than there are intervals
  std::vector<std::size_t> first;  ///< interval of each window; the last entry ends the last window
  std::vector<bool> used;
  Vector by_wheels;
  Vector duration_s;

  std::size_t count() const { return used.size(); }
};

/// Windows of the wheels alone; those for which the gyro runs at any offset of the search.
Windows windows_of(const Recording& recording, const AlignedReadings& readings, const Robot& robot,
                   const TimeOffsetOptions& options) {
  Windows windows{.time_s = {readings.start_s}, .first = {0}, .used = {}, .by_wheels = {}, .duration_s = {}};
  const Rows rows = rows_of(robot.chassis, false);
  const double gyro_offset_s = robot.chassis.gyro->time_offset_s;
  const double start_s = recording.gyro.time_s.front() + gyro_offset_s + options.largest_s;
  const double end_s = recording.gyro.time_s.back() + gyro_offset_s - options.largest_s;
  std::vector<double> turns, durations;
  double turn = 0.0, duration_s = 0.0;
  bool whole = true;
  const auto& increments = readings.increments;
  windows.time_s.reserve(increments.size() + 1);
  for (std::size_t i = 0; i < increments.size(); ++i) {
    windows.time_s.push_back(increments[i].time_s);
    turn += twist_of(robot.chassis, rows, increments[i]).dtheta;
    duration_s += increments[i].duration_s;
    whole = whole && !readings.bridged[i];
    if (duration_s < options.window_s - 1e-9) continue;
    const double end = increments[i].time_s;
    windows.used.push_back(whole && end - duration_s >= start_s && end <= end_s);
    windows.first.push_back(i + 1);
    turns.push_back(turn);
    durations.push_back(duration_s);
    turn = duration_s = 0.0;
    whole = true;
  }
  windows.by_wheels = Eigen::Map<const Vector>(turns.data(), static_cast<Eigen::Index>(turns.size()));
  windows.duration_s =
      Eigen::Map<const Vector>(durations.data(), static_cast<Eigen::Index>(durations.size()));
  return windows;
}

/// Samples of a gyro, and which steps between them lost its rate: no offset of its clock changes that.
struct GyroSamples {
  const GyroStream& stream;
  std::vector<bool> is_lost;  ///< the step that ends at each sample
  double before_s = 0.0;      ///< it reaches so far before its first sample
  double beyond_s = 0.0;      ///< and beyond its last

  GyroSamples(const GyroStream& gyro, const Gyro& sensor) : stream(gyro), is_lost(gyro.time_s.size()) {
    UsualStep usual_step(AlignerOptions{}.shortest_gap_s);
    for (std::size_t i = 1; i < is_lost.size(); ++i) {
      const double step_s = gyro.time_s[i] - gyro.time_s[i - 1];
      usual_step.add(step_s);
      const bool gap = step_s > usual_step.longest_s();
      const double rate = gyro.yaw_rate_rad_s[i];
      is_lost[i] = std::isnan(rate) || std::abs(rate) >= sensor.max_rate_rad_s || gap;
      beyond_s = gap ? 0.0 : step_s;
      if (i == 1) before_s = beyond_s;
    }
  }
};

/// A GyroIntegral of which all samples are there: it is read off at growing times, and nothing is kept.
class GyroCursor {
 public:
  GyroCursor(const GyroSamples& samples, double offset_s) : samples_(samples), offset_s_(offset_s) {
    after_.time_s = samples.stream.time_s.front() + offset_s;
  }

  GyroIntegral::Reading at(double time_s) {
    const std::vector<double>& rate = samples_.stream.yaw_rate_rad_s;
    while (next_ < rate.size() && after_.time_s < time_s) advance();
    if (next_ == rate.size()) {
      const double beyond_s = time_s - before_.time_s;
      if (beyond_s > samples_.beyond_s) return {};
      return {!std::isnan(rate.back()), before_.angle + rate.back() * beyond_s, before_.lost, before_.lost};
    }
    const double ahead_s = after_.time_s - time_s;
    if (ahead_s == 0.0) return {true, after_.angle, after_.lost, after_.lost};
    if (next_ == 0) {
      if (ahead_s > samples_.before_s) return {};
      return {!std::isnan(rate.front()), -rate.front() * ahead_s, 0, 0};
    }
    const double u = 1.0 - ahead_s / (after_.time_s - before_.time_s);
    return {true, before_.angle + u * (after_.angle - before_.angle), before_.lost, after_.lost};
  }

 private:
  struct Sample {
    double time_s = 0.0;
    double angle = 0.0;
    std::size_t lost = 0;  ///< steps without a usable rate up to here
  };

  void advance() {
    before_ = after_;
    if (++next_ == samples_.is_lost.size()) return;
    after_.time_s = samples_.stream.time_s[next_] + offset_s_;
    if (samples_.is_lost[next_])
      ++after_.lost;
    else
      after_.angle += samples_.stream.yaw_rate_rad_s[next_] * (after_.time_s - before_.time_s);
  }

  const GyroSamples& samples_;
  double offset_s_;
  std::size_t next_ = 0;  ///< sample that after_ is; beyond the last one there is none
  Sample before_, after_;
};

/// What the gyro turned in each window with its stamps moved by `offset_s`. Windows that it misses are not
/// used any more.
Vector turns_by_gyro(const GyroSamples& samples, double offset_s, const Windows& windows,
                     std::vector<bool>& used) {
  GyroCursor gyro(samples, offset_s);
  Vector turns = Vector::Zero(static_cast<Eigen::Index>(windows.count()));
  GyroIntegral::Reading start = gyro.at(windows.time_s.front());
  for (std::size_t w = 0; w < windows.count(); ++w)
    for (std::size_t i = windows.first[w]; i < windows.first[w + 1]; ++i) {
      const GyroIntegral::Reading end = gyro.at(windows.time_s[i + 1]);
      const std::optional<double> turn = GyroIntegral::turn(start, end);
      if (!turn) used[w] = false;
      turns[static_cast<Eigen::Index>(w)] += turn.value_or(0.0);
      start = end;
    }
  return turns;
}

}  // namespace

std::optional<TimeOffset> gyro_time_offset(const Recording& recording, const Robot& robot,
                                           const TimeOffsetOptions& options) {
  if (!robot.chassis.gyro || recording.gyro.time_s.size() < 2) return std::nullopt;
  return gyro_time_offset(recording, align(recording, robot), robot, options);
}

std::optional<TimeOffset> gyro_time_offset(const Recording& recording, const AlignedReadings& readings,
                                           const Robot& robot, const TimeOffsetOptions& options) {
  if (!robot.chassis.gyro || recording.gyro.time_s.size() < 2) return std::nullopt;
  if (observability(rows_of(robot.chassis, false)).rank < 3) return std::nullopt;
  const double gyro_step_s = median_step(recording.gyro.time_s);
  const Windows windows = windows_of(recording, readings, robot, options);
  const GyroSamples samples(recording.gyro, *robot.chassis.gyro);
  TwoClocks clocks{.fixed = {windows.by_wheels},
                   .duration_s = windows.duration_s,
                   .used = windows.used,
                   .moved = [&](double offset_s, std::vector<bool>& used) {
                     return std::vector{turns_by_gyro(samples, offset_s, windows, used)};
                   }};
  return find_offset(std::move(clocks), {.given_s = robot.chassis.gyro->time_offset_s,
                                         .largest_s = options.largest_s,
                                         .step_s = std::max(0.25 * options.window_s, 0.5 * gyro_step_s),
                                         .sample_s = gyro_step_s,
                                         .least_sigma_s = gyro_step_s / 50.0,
                                         .largest_sigma_s = options.largest_sigma_s,
                                         .least_correlation = options.least_correlation});
}

}  // namespace trundle::recording
