#include "trundle/recording/alignment/replay.hpp"

#include <algorithm>
#include <limits>

#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/io/interruption.hpp"
#include "trundle/io/words.hpp"
#include "trundle/recording/lengths.hpp"

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

}  // namespace

const WheelSeries& steering_of(const Recording& recording, const std::string& wheel) {
  const auto& steering = recording.wheels.steering;
  const auto found = std::ranges::find(steering, wheel, &WheelSeries::wheel);
  if (found != steering.end()) return *found;
  const std::string& file = recording.wheels.origin.file;
  throw InputError(file.empty() ? recording.name : file,
                   fmt::format("has no column of the steering of '{}'", wheel),
                   fmt::format("{0}_steering_rad or {0}_steering_ticks", wheel));
}

WheelReadings Replay::MotionStream::at(std::size_t row) const {
  WheelReadings readings{.time_s = (*time_s)[row]};
  for (std::size_t i = 0; i < columns.size(); ++i) readings.value[i] = (*columns[i])[row];
  for (std::size_t i = 0; i < steering.size(); ++i)
    if (steering[i] != nullptr) readings.steering[i] = (*steering[i])[row];
  return readings;
}

Replay::MotionStream Replay::motion_of(const Recording& recording, const Robot& robot) {
  if (robot.chassis.wheel_count == 0) {
    const VelocityStream& velocity = recording.velocity;
    if (velocity.time_s.empty())
      throw InputError(recording.name,
                       "says nothing of how the robot moved: the robot file has no wheels, and there is no "
                       "velocity stream",
                       "wheels in both, or velocity.csv, [velocity] of recording.toml");
    return {&velocity.time_s, {&velocity.forward_m_s, &velocity.yaw_rate_rad_s}, {}, {}, {}};
  }
  if (recording.wheels.time_s.empty())
    throw InputError(recording.name, "has no wheels.csv", "a stream of the robot's wheels");
  MotionStream motion{&recording.wheels.time_s, {}, {}, {}, {}};
  for (std::size_t i = 0; i < robot.wheel_names.size(); ++i) {
    const WheelSeries& series = series_of(recording, robot.wheel_names[i]);
    motion.columns.push_back(&series.value);
    motion.units[i] = series.unit;
  }
  for (std::size_t i = 0; i < robot.chassis.all_wheels().size(); ++i) {
    if (!robot.chassis.all_wheels()[i].steering) continue;
    const WheelSeries& series = steering_of(recording, wheel_name(robot, i));
    motion.steering[i] = &series.value;
    motion.steering_units[i] = series.unit;
  }
  return motion;
}

void Replay::CounterEvents::add(const CounterFinding& finding) {
  if (finding.event == CounterEvent::wrap) wraps.add(finding.reading);
  if (finding.event == CounterEvent::reset) resets.add(finding.reading);
  if (finding.event == CounterEvent::jump) jumps.add(finding.reading);
}

Replay::Replay(const Recording& recording, const Robot& robot)
    : recording_(recording),
      wheel_names_(robot.wheel_names),
      gyro_(robot.chassis.gyro),
      wheels_offset_s_(robot.chassis.wheels_time_offset_s),
      motion_(motion_of(recording, robot)),
      aligner_(robot),
      counters_(robot.wheel_names.size()) {
  require_equal_lengths(recording);
  aligner_.set_units(motion_.units, motion_.steering_units);
}

std::optional<AlignedInterval> Replay::next() {
  check_interruption();
  do {
    if (std::optional<AlignedInterval> interval = aligner_.next()) {
      note(*interval);
      return interval;
    }
  } while (add_reading());
  return std::nullopt;
}

/// The next one of all streams by the robot's clock; of equal stamps the wheels' comes last. False after the
/// last.
bool Replay::add_reading() {
  const bool has_motion = motion_row_ < motion_.time_s->size();
  const double until_s = has_motion ? (*motion_.time_s)[motion_row_] + wheels_offset_s_
                                    : std::numeric_limits<double>::infinity();
  const GyroStream& gyro = recording_.gyro;
  const double gyro_offset_s = gyro_ ? gyro_->time_offset_s : 0.0;
  if (gyro_row_ < gyro.time_s.size() && gyro.time_s[gyro_row_] + gyro_offset_s <= until_s) {
    aligner_.add(GyroReading{gyro.time_s[gyro_row_], gyro.yaw_rate_rad_s[gyro_row_]});
    ++gyro_row_;
    return true;
  }
  const AccelStream& accel = recording_.accel;
  for (; accel_row_ < accel.time_s.size() && accel.time_s[accel_row_] <= until_s; ++accel_row_)
    aligner_.add(AccelReading{accel.time_s[accel_row_], accel.x_m_s2[accel_row_], accel.y_m_s2[accel_row_]});
  if (has_motion) {
    aligner_.add(motion_.at(motion_row_++));
    return true;
  }
  if (finished_) return false;
  aligner_.finish();
  finished_ = true;
  return true;
}

void Replay::note(const AlignedInterval& interval) {
  const double start_s = intervals_++ == 0 ? aligner_.start_s().value_or(0.0) : end_s_;
  end_s_ = interval.increment.time_s;
  for (std::size_t i = 0; i < counters_.size(); ++i) counters_[i].add(interval.counters[i]);
  if (interval.increment.has_gyro || recording_.gyro.time_s.empty() || !gyro_) return;
  const bool ran = start_s >= recording_.gyro.time_s.front() + gyro_->time_offset_s &&
                   end_s_ <= recording_.gyro.time_s.back() + gyro_->time_offset_s;
  ++(ran ? missing_gyro_ : beyond_gyro_);
}

/// Intervals without the gyro, by whether it was running at all.
void Replay::report_gyro(std::vector<Finding>& findings) const {
  const GyroStream& stream = recording_.gyro;
  const auto report = [&](Severity severity, FindingCode code, std::size_t count, const Payload& payload) {
    if (count > 0)
      findings.push_back({severity, code, stream.origin.place_of(stream.time_s.size()), count, {}, payload});
  };
  report(Severity::warning, FindingCode::gyro_saturated, aligner_.saturated_gyro_samples(), {});
  report(Severity::warning, FindingCode::gyro_missing, missing_gyro_, {});
  report(2 * beyond_gyro_ > intervals_ ? Severity::warning : Severity::note, FindingCode::gyro_missing,
         beyond_gyro_,
         payload::Spans{stream.time_s.front() + gyro_->time_offset_s,
                        stream.time_s.back() + gyro_->time_offset_s, start_s(), end_s_});
}

std::vector<Finding> Replay::findings() const {
  std::vector<Finding> findings;
  for (std::size_t i = 0; i < counters_.size(); ++i) {
    const auto report = [&](Severity severity, FindingCode code, const CounterRows& rows) {
      if (rows.count > 0)
        findings.push_back(
            {severity, code, recording_.wheels.origin.place_of(rows.first), rows.count, {wheel_names_[i]}});
    };
    report(Severity::note, FindingCode::wrap, counters_[i].wraps);
    report(Severity::warning, FindingCode::counter_reset, counters_[i].resets);
    report(Severity::warning, FindingCode::counter_jump, counters_[i].jumps);
  }
  if (gyro_ && !recording_.gyro.time_s.empty() && intervals_ > 0) report_gyro(findings);
  return findings;
}

}  // namespace trundle::recording
