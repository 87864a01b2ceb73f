#include "trundle/recording/alignment/aligner.hpp"

#include <algorithm>
#include <cmath>

namespace trundle::recording {
namespace {

constexpr double kMemory_s = 5.0;  // for wheels whose readings arrive later than those of the other sensors

}  // namespace

Aligner::Aligner(const Robot& robot, const AlignerOptions& options)
    : wheels_(robot, {.shortest_gap_s = options.shortest_gap_s, .usual_speed_m_s = options.usual_speed_m_s}),
      scrub_gauge_(robot.chassis) {
  if (depends_on_speed(robot)) speed_gauge_.emplace(robot.chassis);
  if (is_steered(robot.chassis)) steering_.emplace(robot);
  if (!robot.chassis.gyro) return;
  gyro_.emplace(*robot.chassis.gyro, options.shortest_gap_s);
  gyro_later_s_ = std::max(0.0, robot.chassis.wheels_time_offset_s - robot.chassis.gyro->time_offset_s);
}

void Aligner::set_units(const WheelUnits& units, const WheelUnits& steering) {
  wheels_.set_units(units);
  if (steering_) steering_->set_units(steering);
}

bool Aligner::add(const WheelReadings& readings) {
  const bool first = !wheels_.last_s();
  if (!wheels_.add(readings)) return false;
  if (steering_) steering_->add(*wheels_.last_s(), readings.steering);
  newest_s_ = first ? *wheels_.last_s() : std::max(newest_s_, *wheels_.last_s());
  return true;
}

bool Aligner::add(const GyroReading& reading) {
  if (!gyro_) return true;
  if (!gyro_->add(reading.time_s, reading.yaw_rate_rad_s)) return false;
  newest_s_ = wheels_.last_s() ? std::max(newest_s_, gyro_->last_s()) : gyro_->last_s();
  gyro_->forget_before(gyro_->last_s() - kMemory_s);
  return true;
}

bool Aligner::add(const AccelReading& reading) {
  if (!accel_.empty() && reading.time_s <= accel_.back().time_s) return false;
  if (!accel_.empty() && accel_.front().time_s < reading.time_s - 2.0 * kMemory_s)
    std::erase_if(accel_, [&](const AccelReading& old) { return old.time_s < reading.time_s - kMemory_s; });
  accel_.push_back(reading);
  return true;
}

void Aligner::finish() {
  finished_ = true;
  wheels_.finish();
}

std::optional<AlignedInterval> Aligner::next() {
  while (wheels_.has_next() && !is_gyro_awaited(wheels_.next().time_s) &&
         !is_steering_awaited(wheels_.next())) {
    const WheelSums::Row row = wheels_.take_next();
    if (end_) return interval_to(row);
    start_at(row);
  }
  return std::nullopt;
}

bool Aligner::is_gyro_awaited(double time_s) const {
  return gyro_ && !finished_ && gyro_->is_awaited(time_s) && !is_gyro_silent();
}

bool Aligner::is_steering_awaited(const WheelSums::Row& row) const {
  return steering_ && end_ && !finished_ &&
         steering_->is_awaited(0.5 * (end_->time_s + row.time_s), *wheels_.last_s(), row.longest_step_s);
}

bool Aligner::is_gyro_silent() const {
  if (gyro_->is_heard()) return newest_s_ > gyro_->last_s() + gyro_->longest_step_s();
  if (!wheels_.has_next()) return true;  // it would have been, by now
  const double until_s = wheels_.next().time_s + gyro_later_s_;
  return end_ ? newest_s_ >= until_s : newest_s_ > until_s;
}

void Aligner::start_at(const WheelSums::Row& row) {
  end_ = row;
  if (!gyro_) return;
  gyro_start_ = gyro_->at(row.time_s, is_gyro_silent());
  rate_start_ = gyro_->rate_before(row.time_s, gyro_start_);
}

AlignedInterval Aligner::interval_to(const WheelSums::Row& row) {
  AlignedInterval interval;
  Increment& increment = interval.increment;
  increment.time_s = row.time_s;
  increment.duration_s = row.time_s - end_->time_s;
  for (std::size_t i = 0; i < wheels_.count(); ++i)
    increment.turned[i] = (row.sum[i] - end_->sum[i]) / wheels_.units_per_turn(i);
  if (scrub_gauge_.applies()) scrub_gauge_.add(scrub_, increment);
  if (speed_gauge_) speed_gauge_->add(speed_, increment);
  if (gyro_) add_gyro_turn(increment);
  increment.shaking_m_s2 = shaking_until(end_->time_s, row.time_s);
  interval.bridged = row.broken || increment.duration_s > row.longest_step_s;
  if (steering_) {
    const double middle_s = 0.5 * (end_->time_s + row.time_s);
    const SteeringAngles::Reading steering = steering_->at(middle_s, row.longest_step_s);
    increment.steering_rad = steering.rad;
    interval.bridged = interval.bridged || !steering.known;
    steering_->forget_before(middle_s);
  }
  interval.counters = row.found;
  end_ = row;
  return interval;
}

void Aligner::add_gyro_turn(Increment& increment) {
  const bool is_silent = is_gyro_silent();
  if (!gyro_start_.known) gyro_start_ = gyro_->at(end_->time_s, is_silent);  // it had not been heard then
  const GyroIntegral::Reading end = gyro_->at(increment.time_s, is_silent);
  const std::optional<double> turn = GyroIntegral::turn(gyro_start_, end);
  increment.has_gyro = turn.has_value();
  increment.gyro_rad = turn.value_or(0.0);
  const double rate = gyro_->rate_before(increment.time_s, end);
  const double change = rate - rate_start_;
  increment.gyro_change_rad_s = std::isnan(change) ? 0.0 : change;
  gyro_start_ = end;
  rate_start_ = rate;
  gyro_->forget_before(increment.time_s);
}

/// rms of the accelerometer about its mean over an interval, of both axes together; NaN where it was read
/// less than twice.
double Aligner::shaking_until(double start_s, double end_s) {
  double count = 0.0, x = 0.0, y = 0.0, squares = 0.0;
  const auto later = std::ranges::upper_bound(accel_, end_s, {}, &AccelReading::time_s);
  for (auto reading = accel_.begin(); reading != later; ++reading) {
    if (reading->time_s <= start_s || std::isnan(reading->x_m_s2) || std::isnan(reading->y_m_s2)) continue;
    count += 1.0;
    const double dx = reading->x_m_s2 - x;
    const double dy = reading->y_m_s2 - y;
    x += dx / count;
    y += dy / count;
    squares += dx * (reading->x_m_s2 - x) + dy * (reading->y_m_s2 - y);
  }
  accel_.erase(accel_.begin(), later);
  return count >= 2.0 ? std::sqrt(squares / (count - 1.0)) : kNotMeasured;
}

}  // namespace trundle::recording
