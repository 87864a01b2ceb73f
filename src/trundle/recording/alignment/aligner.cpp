#include "trundle/recording/alignment/aligner.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "trundle/io/error.hpp"

namespace trundle {
namespace {

constexpr double kMemory_s = 5.0;  // for wheels whose readings arrive later than those of the other sensors

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

Aligner::Aligner(const Robot& robot, const AlignerOptions& options)
    : wheels_(robot.chassis.wheels().begin(), robot.chassis.wheels().end()),
      names_(robot.wheel_names),
      count_(wheels_.empty() ? 2 : wheels_.size()),
      options_(options),
      wheels_offset_s_(robot.chassis.wheels_time_offset_s),
      sums_(count_),
      usual_step_(options.shortest_gap_s) {
  for (std::size_t i = 0; i < wheels_.size(); ++i) places_.push_back(place_of_wheel(robot, i));
  if (!robot.chassis.gyro) return;
  gyro_.emplace(*robot.chassis.gyro, options.shortest_gap_s);
  gyro_offset_s_ = robot.chassis.gyro->time_offset_s;
}

void Aligner::set_units(const WheelUnits& units) {
  units_ = units;
  for (std::size_t i = 0; i < count_; ++i) {
    if (wheels_.empty()) {  // a velocity is its own unit
      units_[i] = WheelUnit::rate;
      units_per_turn_[i] = 1.0;
      continue;
    }
    units_per_turn_[i] = units_per_turn_of(wheels_[i], units[i], names_[i], places_[i]);
    const double units_per_m = std::abs(units_per_turn_[i]) / (kPi * wheels_[i].diameter_m);
    sums_[i].counter = Counter({.bits = units[i] == WheelUnit::ticks ? wheels_[i].tick_bits : 0,
                                .usual_speed = options_.usual_speed_m_s * units_per_m});
  }
}

bool Aligner::add(const WheelReadings& readings) {
  const std::size_t number = added_++;
  Row row{.time_s = readings.time_s + wheels_offset_s_, .number = number};
  if (last_row_s_ && row.time_s <= *last_row_s_) return false;
  if (last_row_s_) usual_step_.add(row.time_s - *last_row_s_);
  row.longest_step_s = usual_step_.longest_s();
  row.sum.fill(kNotMeasured);
  rows_.push_back(row);
  newest_s_ = last_row_s_ ? std::max(newest_s_, row.time_s) : row.time_s;
  last_row_s_ = row.time_s;
  for (std::size_t i = 0; i < count_; ++i) read(i, readings.value[i], row);
  sort_out_rows();
  return true;
}

bool Aligner::add(const GyroReading& reading) {
  if (!gyro_) return true;
  if (!gyro_->add(reading.time_s, reading.yaw_rate_rad_s)) return false;
  newest_s_ = last_row_s_ ? std::max(newest_s_, gyro_->last_s()) : gyro_->last_s();
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
  if (rows_.empty()) return;
  for (std::size_t i = 0; i < count_; ++i)
    for (const CounterStep& step : sums_[i].counter.decide(rows_.back().longest_step_s))
      settle(i, step, rows_.back().longest_step_s);
  sort_out_rows();
}

/// A rate is the mean since the row before.
void Aligner::read(std::size_t wheel, double value, const Row& row) {
  WheelSum& sum = sums_[wheel];
  if (units_[wheel] == WheelUnit::rate) {
    if (!sum.time_s)
      settle(wheel, {row.time_s, row.time_s}, 0.0);
    else if (!std::isnan(value))
      settle(wheel, {*sum.time_s, row.time_s, value * (row.time_s - *sum.time_s)}, 0.0);
    return;
  }
  const auto& last_s = sum.counter.time_s();
  const bool silent = last_s && row.time_s - *last_s > row.longest_step_s;
  const Counter::Steps steps = !std::isnan(value) ? sum.counter.add(row.time_s, value, row.longest_step_s)
                               : silent           ? sum.counter.decide(row.longest_step_s)
                                                  : Counter::Steps{};
  for (const CounterStep& step : steps) settle(wheel, step, row.longest_step_s);
}

/// Rows that a wheel left empty are filled in between, but not across a gap.
void Aligner::settle(std::size_t wheel, const CounterStep& step, double longest_step_s) {
  WheelSum& sum = sums_[wheel];
  const double start = sum.sum;
  sum.sum += step.travel;
  sum.time_s = step.end_s;
  const bool fills = step.duration_s() <= longest_step_s;
  for (auto row = rows_.rbegin(); row != rows_.rend() && row->time_s > step.start_s; ++row) {
    if (row->time_s > step.end_s) continue;
    if (row->time_s < step.end_s && !fills) continue;
    const double slope = (sum.sum - start) / step.duration_s();
    row->sum[wheel] = row->time_s == step.end_s ? sum.sum : start + slope * (row->time_s - step.start_s);
    if (row->time_s == step.end_s) row->event[wheel] = step.event;
  }
  if (step.duration_s() == 0.0) rows_.back().sum[wheel] = sum.sum;  // the first
}

bool Aligner::is_known(const Row& row) const {
  return std::none_of(row.sum.begin(), row.sum.begin() + static_cast<std::ptrdiff_t>(count_),
                      [](double sum) { return std::isnan(sum); });
}

/// Whether no further reading can tell what a wheel had turned by then.
bool Aligner::stays_unknown(const Row& row) const {
  for (std::size_t i = 0; i < count_; ++i) {
    if (!std::isnan(row.sum[i])) continue;
    const WheelSum& sum = sums_[i];
    if (finished_ || !sum.time_s || *sum.time_s > row.time_s || units_[i] == WheelUnit::rate) return true;
    if (!sum.counter.waits() && *last_row_s_ - *sum.time_s > rows_.back().longest_step_s) return true;
  }
  return false;
}

/// What happened at a row concerns the interval that it lies in or ends.
void Aligner::pass(const Row& row) {
  for (std::size_t i = 0; i < count_; ++i) {
    bridged_ = bridged_ || row.event[i] == CounterEvent::reset || row.event[i] == CounterEvent::jump;
    if (row.event[i] != CounterEvent::none && findings_[i].event == CounterEvent::none)
      findings_[i] = {row.event[i], row.number};
  }
}

/// Rows that stay unknown are left out; the first that is known is the start.
void Aligner::sort_out_rows() {
  while (!rows_.empty() && !is_known(rows_.front()) && stays_unknown(rows_.front())) {
    pass(rows_.front());
    rows_.erase(rows_.begin());
  }
  if (!start_s_ && !rows_.empty() && is_known(rows_.front())) start_s_ = rows_.front().time_s;
}

std::optional<AlignedInterval> Aligner::next() {
  while (!rows_.empty() && is_known(rows_.front()) && !is_gyro_awaited(rows_.front().time_s)) {
    const Row row = rows_.front();
    rows_.erase(rows_.begin());
    pass(row);
    std::optional<AlignedInterval> interval;
    if (begun_) interval = interval_to(row);
    if (!begun_ && gyro_) gyro_start_ = gyro_->at(row.time_s, is_gyro_silent());
    if (!begun_ && gyro_) rate_start_ = gyro_->rate_before(row.time_s);
    begun_ = true;
    end_ = {row.time_s, row.sum};
    sort_out_rows();
    if (interval) return interval;
  }
  return std::nullopt;
}

bool Aligner::is_gyro_awaited(double time_s) const {
  return gyro_ && !finished_ && gyro_->is_awaited(time_s) && !is_gyro_silent();
}

bool Aligner::is_gyro_silent() const {
  if (gyro_->is_heard()) return newest_s_ > gyro_->last_s() + gyro_->longest_step_s();
  if (rows_.empty()) return true;  // it would have been, by now
  const double until_s = rows_.front().time_s + std::max(0.0, wheels_offset_s_ - gyro_offset_s_);
  return begun_ ? newest_s_ >= until_s : newest_s_ > until_s;
}

AlignedInterval Aligner::interval_to(const Row& row) {
  AlignedInterval interval;
  Increment& increment = interval.increment;
  increment.time_s = row.time_s;
  increment.duration_s = row.time_s - end_.time_s;
  for (std::size_t i = 0; i < count_; ++i)
    increment.turned[i] = (row.sum[i] - end_.sum[i]) / units_per_turn_[i];
  if (gyro_) add_gyro_turn(increment);
  increment.shaking_m_s2 = shaking_until(end_.time_s, row.time_s);
  interval.bridged = bridged_ || increment.duration_s > row.longest_step_s;
  interval.counters = findings_;
  bridged_ = false;
  findings_ = {};
  return interval;
}

void Aligner::add_gyro_turn(Increment& increment) {
  const bool is_silent = is_gyro_silent();
  if (!gyro_start_.known) gyro_start_ = gyro_->at(end_.time_s, is_silent);  // it had not been heard then
  const GyroIntegral::Reading end = gyro_->at(increment.time_s, is_silent);
  const std::optional<double> turn = GyroIntegral::turn(gyro_start_, end);
  increment.has_gyro = turn.has_value();
  increment.gyro_rad = turn.value_or(0.0);
  const double rate = gyro_->rate_before(increment.time_s);
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

}  // namespace trundle
