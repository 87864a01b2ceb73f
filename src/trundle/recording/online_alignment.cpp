#include "trundle/recording/online_alignment.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "trundle/io/error.hpp"

namespace trundle {
namespace {

constexpr double kGyroMemory_s = 5.0;  // for wheels whose readings arrive late

double units_per_turn_of(const Wheel& wheel, WheelUnit unit, const std::string& name,
                         const std::string& place) {
  if (unit == WheelUnit::metres)
    return kPi * (wheel.recorded_diameter_m > 0.0 ? wheel.recorded_diameter_m : wheel.diameter_m);
  if (unit != WheelUnit::ticks) return 2.0 * kPi;
  if (wheel.ticks_per_revolution != 0.0) return wheel.ticks_per_revolution;
  throw InputError(place, fmt::format("the wheel '{}' has no ticks_per_revolution", name),
                   "ticks_per_revolution: its readings are counts");
}

}  // namespace

OnlineAlignment::OnlineAlignment(const Robot& robot, const OnlineAlignmentOptions& options)
    : names_(robot.wheel_names),
      wheel_count_(static_cast<std::size_t>(robot.chassis.wheel_count)),
      options_(options),
      sensor_(robot.chassis.gyro),
      wheels_offset_s_(robot.chassis.wheels_time_offset_s) {
  std::ranges::copy(robot.chassis.wheels(), wheel_.begin());
  for (std::size_t i = 0; i < wheel_count_; ++i) places_.push_back(place_of_wheel(robot, i));
}

void OnlineAlignment::set_units(const WheelUnits& units) {
  units_ = units;
  for (std::size_t i = 0; i < wheel_count_; ++i) {
    units_per_turn_[i] = units_per_turn_of(wheel_[i], units[i], names_[i], places_[i]);
    units_per_m_[i] = std::abs(units_per_turn_[i]) / (kPi * wheel_[i].diameter_m);
    const bool wraps = units[i] == WheelUnit::ticks && wheel_[i].tick_bits > 0;
    counter_range_[i] = wraps ? std::ldexp(1.0, wheel_[i].tick_bits) : 0.0;
  }
}

bool OnlineAlignment::add(const WheelReadings& readings) {
  WheelReadings shifted = readings;
  shifted.time_s += wheels_offset_s_;
  const double last_s = pending_.empty() ? wheels_.time_s : pending_.back().time_s;
  if (start_s_ && shifted.time_s <= last_s) return false;
  newest_s_ = start_s_ ? std::max(newest_s_, shifted.time_s) : shifted.time_s;
  if (!start_s_) start_s_ = shifted.time_s;
  pending_.push_back(shifted);
  return true;
}

bool OnlineAlignment::add_gyro(double time_s, double yaw_rate_rad_s) {
  if (!sensor_) return true;
  const double at_s = time_s + sensor_->time_offset_s;
  if (!gyro_.any) {
    gyro_ = {.any = true, .first = {at_s, 0.0, 0}, .before_s = {}};
    first_rate_ = yaw_rate_rad_s;
    samples_.push_back(gyro_.first);
  } else {
    const GyroSample& before = samples_.back();
    const double step_s = at_s - before.time_s;
    if (step_s <= 0.0) return false;
    const bool lost = std::isnan(yaw_rate_rad_s) || std::abs(yaw_rate_rad_s) >= sensor_->max_rate_rad_s ||
                      step_s > options_.longest_step_s;
    samples_.push_back(
        {at_s, before.angle + (lost ? 0.0 : yaw_rate_rad_s * step_s), before.lost + (lost ? 1 : 0)});
    gyro_.beyond_s = step_s > options_.longest_step_s ? 0.0 : step_s;
    if (!gyro_.before_s) gyro_.before_s = gyro_.beyond_s;
  }
  last_rate_ = yaw_rate_rad_s;
  newest_s_ = start_s_ ? std::max(newest_s_, at_s) : at_s;
  forget_samples_before(at_s - kGyroMemory_s);
  return true;
}

std::optional<AlignedInterval> OnlineAlignment::next() {
  while (!pending_.empty() && !gyro_awaited(pending_.front().time_s)) {
    const WheelReadings readings = pending_.front();
    pending_.erase(pending_.begin());
    if (begun_) return interval_to(readings);
    begun_ = true;
    wheels_.time_s = readings.time_s;
    wheels_.count = readings.value;
    gyro_start_ = gyro_at(readings.time_s);
  }
  return std::nullopt;
}

/// Whether what the gyro read up to this time may still come.
bool OnlineAlignment::gyro_awaited(double time_s) const {
  if (!sensor_ || finished_ || gyro_is_silent()) return false;
  const bool before_first = gyro_.any && time_s < gyro_.first.time_s;
  return samples_.empty() || samples_.back().time_s < time_s || (before_first && !gyro_.before_s);
}

bool OnlineAlignment::gyro_is_silent() const {
  if (!gyro_.any) {  // it would have been, by now
    const double later_s = std::max(0.0, wheels_offset_s_ - sensor_->time_offset_s);
    const double until_s = pending_.front().time_s + later_s;
    return begun_ ? newest_s_ >= until_s : newest_s_ > until_s;
  }
  return newest_s_ > samples_.back().time_s + options_.longest_step_s;
}

AlignedInterval OnlineAlignment::interval_to(const WheelReadings& readings) {
  AlignedInterval interval;
  Increment& increment = interval.increment;
  increment.time_s = readings.time_s;
  increment.duration_s = readings.time_s - wheels_.time_s;
  bool anew = false;
  for (std::size_t i = 0; i < wheel_count_; ++i) {
    const double before = wheels_.sum[i];
    wheels_.sum[i] += step_of(i, readings.value[i], increment.duration_s, anew);
    increment.turned[i] = (wheels_.sum[i] - before) / units_per_turn_[i];
  }
  if (!gyro_start_.known) gyro_start_ = gyro_at(wheels_.time_s);  // it had not been heard then
  interval.bridged = anew || increment.duration_s > options_.longest_step_s;
  wheels_.time_s = readings.time_s;
  wheels_.count = readings.value;
  const GyroReading end = gyro_at(readings.time_s);
  increment.has_gyro = gyro_start_.known && end.known && end.lost_after == gyro_start_.lost_before;
  increment.gyro_rad = increment.has_gyro ? end.angle - gyro_start_.angle : 0.0;
  gyro_start_ = end;
  forget_samples_before(readings.time_s);
  return interval;
}

/// What a wheel read over a step, wraps undone; the speed of the step before where its counter starts anew.
double OnlineAlignment::step_of(std::size_t wheel, double value, double duration_s, bool& anew) {
  if (units_[wheel] == WheelUnit::rate) return value * duration_s;
  double step = value - wheels_.count[wheel];
  const double range = counter_range_[wheel];
  if (range > 0.0) step -= range * std::round(step / range);
  if (std::abs(step) > options_.greatest_speed_m_s * units_per_m_[wheel] * duration_s) {
    anew = true;
    return duration_s > options_.longest_step_s ? 0.0 : wheels_.speed[wheel] * duration_s;
  }
  wheels_.speed[wheel] = step / duration_s;
  return step;
}

/// Beyond its ends the gyro holds its rate for a step, its first or last.
OnlineAlignment::GyroReading OnlineAlignment::gyro_at(double time_s) const {
  const auto after = std::ranges::lower_bound(samples_, time_s, {}, &GyroSample::time_s);
  if (after == samples_.end()) {
    if (samples_.empty()) return {};
    const GyroSample& last = samples_.back();
    const double beyond_s = time_s - last.time_s;
    if (beyond_s > gyro_.beyond_s || gyro_is_silent()) return {};
    return {true, last.angle + last_rate_ * beyond_s, last.lost, last.lost};
  }
  const double ahead_s = after->time_s - time_s;
  if (ahead_s == 0.0) return {true, after->angle, after->lost, after->lost};
  if (after == samples_.begin()) {
    if (after->time_s != gyro_.first.time_s || ahead_s > gyro_.before_s.value_or(0.0)) return {};
    return {true, -first_rate_ * ahead_s, 0, 0};
  }
  const GyroSample& before = *(after - 1);
  const double u = 1.0 - ahead_s / (after->time_s - before.time_s);
  return {true, before.angle + u * (after->angle - before.angle), before.lost, after->lost};
}

/// The last sample before the time stays: what comes is interpolated from it.
void OnlineAlignment::forget_samples_before(double time_s) {
  const auto after = std::ranges::lower_bound(samples_, time_s, {}, &GyroSample::time_s);
  if (after - samples_.begin() > 1) samples_.erase(samples_.begin(), after - 1);
}

}  // namespace trundle
