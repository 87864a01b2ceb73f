#include "trundle/recording/alignment/align.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>

#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/io/words.hpp"
#include "trundle/recording/alignment/aligner.hpp"

namespace trundle::recording {
namespace {

const WheelSeries& series_of(const Recording& recording, const std::string& wheel) {
  const auto& series = recording.wheels.series;
  const auto found = std::ranges::find(series, wheel, &WheelSeries::wheel);
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

/// What gives a robot's motion: its wheels' columns, or a velocity.
struct MotionStream {
  const std::vector<double>* time_s = nullptr;
  std::vector<const std::vector<double>*> columns;
  WheelUnits units{};

  WheelReadings at(std::size_t row) const {
    WheelReadings readings{.time_s = (*time_s)[row]};
    for (std::size_t i = 0; i < columns.size(); ++i) readings.value[i] = (*columns[i])[row];
    return readings;
  }
};

MotionStream motion_of(const Recording& recording, const Robot& robot) {
  if (robot.chassis.wheel_count == 0) {
    const VelocityStream& velocity = recording.velocity;
    if (velocity.time_s.empty())
      throw InputError(recording.name, "has no velocity.csv", "a velocity stream: the robot has no wheels");
    return {&velocity.time_s, {&velocity.forward_m_s, &velocity.yaw_rate_rad_s}};
  }
  if (recording.wheels.time_s.empty())
    throw InputError(recording.name, "has no wheels.csv", "a stream of the robot's wheels");
  MotionStream motion{&recording.wheels.time_s, {}};
  for (std::size_t i = 0; i < robot.wheel_names.size(); ++i) {
    const WheelSeries& series = series_of(recording, robot.wheel_names[i]);
    motion.columns.push_back(&series.value);
    motion.units[i] = series.unit;
  }
  return motion;
}

/// Rows where the counter of a wheel did more than count.
struct CounterRows {
  std::vector<std::size_t> wraps, resets, jumps;

  void add(const CounterFinding& finding) {
    if (finding.event == CounterEvent::wrap) wraps.push_back(finding.reading);
    if (finding.event == CounterEvent::reset) resets.push_back(finding.reading);
    if (finding.event == CounterEvent::jump) jumps.push_back(finding.reading);
  }
};

void report(const CounterRows& found, const std::string& wheel, const StreamOrigin& origin,
            std::vector<Finding>& findings) {
  const auto add = [&](Severity severity, FindingCode code, const std::vector<std::size_t>& rows) {
    if (!rows.empty())
      findings.push_back({severity, code, origin.place_of(rows.front()), rows.size(), {wheel}});
  };
  add(Severity::note, FindingCode::wrap, found.wraps);
  add(Severity::warning, FindingCode::counter_reset, found.resets);
  add(Severity::warning, FindingCode::counter_jump, found.jumps);
}

/// Intervals without the gyro, by whether it was running at all.
void report_gyro(const GyroStream& gyro, const Gyro& sensor, std::size_t saturated,
                 AlignedReadings& aligned) {
  const double first_s = gyro.time_s.front() + sensor.time_offset_s;
  const double last_s = gyro.time_s.back() + sensor.time_offset_s;
  std::size_t beyond = 0, within = 0;
  double start_s = aligned.start_s;
  for (const Increment& increment : aligned.increments) {
    if (!increment.has_gyro) ++(start_s < first_s || increment.time_s > last_s ? beyond : within);
    start_s = increment.time_s;
  }
  const auto tell = [&](Severity severity, FindingCode code, std::size_t count, const Payload& payload) {
    if (count > 0)
      aligned.findings.push_back(
          {severity, code, gyro.origin.place_of(gyro.time_s.size()), count, {}, payload});
  };
  tell(Severity::warning, FindingCode::gyro_saturated, saturated, {});
  tell(Severity::warning, FindingCode::gyro_missing, within, {});
  const bool most = 2 * beyond > aligned.increments.size();
  tell(most ? Severity::warning : Severity::note, FindingCode::gyro_missing, beyond,
       payload::Spans{first_s, last_s, aligned.start_s, aligned.increments.back().time_s});
}

/// All streams in the order of their stamps by the robot's clock.
class Replay {
 public:
  Replay(const Recording& recording, const Robot& robot)
      : recording_(recording),
        motion_(motion_of(recording, robot)),
        wheels_offset_s_(robot.chassis.wheels_time_offset_s),
        gyro_offset_s_(robot.chassis.gyro ? robot.chassis.gyro->time_offset_s : 0.0),
        aligner_(robot),
        counters_(robot.wheel_names.size()) {
    aligner_.set_units(motion_.units);
  }

  AlignedReadings aligned() {
    aligned_.increments.reserve(motion_.time_s->size());
    for (std::size_t row = 0; row < motion_.time_s->size(); ++row) {
      const WheelReadings readings = motion_.at(row);
      add_others_until(readings.time_s + wheels_offset_s_);
      aligner_.add(readings);
      take_intervals();
    }
    add_others_until(std::numeric_limits<double>::infinity());
    aligner_.finish();
    take_intervals();
    aligned_.start_s = aligner_.start_s().value_or(0.0);
    return std::move(aligned_);
  }
  const std::vector<CounterRows>& counters() const { return counters_; }
  std::size_t saturated_gyro_samples() const { return aligner_.saturated_gyro_samples(); }

 private:
  void add_others_until(double time_s) {
    const GyroStream& gyro = recording_.gyro;
    for (; gyro_row_ < gyro.time_s.size() && gyro.time_s[gyro_row_] + gyro_offset_s_ <= time_s; ++gyro_row_) {
      aligner_.add(GyroReading{gyro.time_s[gyro_row_], gyro.yaw_rate_rad_s[gyro_row_]});
      take_intervals();
    }
    const AccelStream& accel = recording_.accel;
    for (; accel_row_ < accel.time_s.size() && accel.time_s[accel_row_] <= time_s; ++accel_row_)
      aligner_.add(
          AccelReading{accel.time_s[accel_row_], accel.x_m_s2[accel_row_], accel.y_m_s2[accel_row_]});
  }
  void take_intervals() {
    while (const std::optional<AlignedInterval> interval = aligner_.next()) {
      aligned_.increments.push_back(interval->increment);
      aligned_.bridged.push_back(interval->bridged);
      for (std::size_t i = 0; i < counters_.size(); ++i) counters_[i].add(interval->counters[i]);
    }
  }

  const Recording& recording_;
  MotionStream motion_;
  double wheels_offset_s_;
  double gyro_offset_s_;
  Aligner aligner_;
  std::vector<CounterRows> counters_;
  AlignedReadings aligned_;
  std::size_t gyro_row_ = 0;
  std::size_t accel_row_ = 0;
};

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
      if (turned.duration_s >= GyroIntegral::kRateOver_s - 1e-9) return turned;
    }
    return std::nullopt;
  }
};

}  // namespace

AlignedReadings align(const Recording& recording, const Robot& robot) {
  Replay replay(recording, robot);
  AlignedReadings aligned = replay.aligned();
  for (std::size_t i = 0; i < robot.wheel_names.size(); ++i)
    report(replay.counters()[i], robot.wheel_names[i], recording.wheels.origin, aligned.findings);
  if (robot.chassis.gyro && !recording.gyro.time_s.empty() && !aligned.increments.empty())
    report_gyro(recording.gyro, *robot.chassis.gyro, replay.saturated_gyro_samples(), aligned);
  return aligned;
}

void add_gyro(const GyroStream& gyro, const Robot& robot, AlignedReadings& aligned) {
  if (!robot.chassis.gyro || gyro.time_s.empty() || aligned.increments.empty()) return;
  GyroIntegral integral(*robot.chassis.gyro, AlignerOptions{}.shortest_gap_s);
  std::size_t row = 0;
  const auto angle_at = [&](double time_s) {
    for (; row < gyro.time_s.size() && integral.is_awaited(time_s); ++row)
      integral.add(gyro.time_s[row], gyro.yaw_rate_rad_s[row]);
    integral.forget_before(time_s);
    return integral.at(time_s);
  };
  GyroIntegral::Reading start = angle_at(aligned.start_s);
  for (Increment& increment : aligned.increments) {
    const GyroIntegral::Reading end = angle_at(increment.time_s);
    const std::optional<double> turn = GyroIntegral::turn(start, end);
    increment.gyro_rad = turn.value_or(0.0);
    increment.has_gyro = turn.has_value();
    start = end;
  }
}

void centre_gyro_changes(AlignedReadings& aligned) {
  std::vector<Increment>& increments = aligned.increments;
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

}  // namespace trundle::recording
