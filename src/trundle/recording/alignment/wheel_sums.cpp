#include "trundle/recording/alignment/wheel_sums.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "trundle/io/error.hpp"

namespace trundle::recording {
namespace {

double units_per_turn_of(const Wheel& wheel, WheelUnit unit, const std::string& name,
                         const std::string& place) {
  if (unit == WheelUnit::metres)
    return kPi * (wheel.recorded_diameter_m > 0.0 ? wheel.recorded_diameter_m : wheel.diameter_m);
  if (unit != WheelUnit::ticks) return 2.0 * kPi;
  if (wheel.ticks_per_revolution != 0.0) return wheel.ticks_per_revolution;
  throw InputError(place, fmt::format("the wheel '{}' has no ticks_per_revolution", name),
                   "ticks_per_revolution: its readings are counts");
}

// What a lag has still to come is gone at once [m or rad].
constexpr double kArrived = 1e-4;

}  // namespace

WheelSums::WheelSums(const Robot& robot, const Options& options)
    : wheels_(robot.chassis.wheels().begin(), robot.chassis.wheels().end()),
      names_(robot.wheel_names),
      options_(options),
      offset_s_(robot.chassis.wheels_time_offset_s),
      lag_s_(wheels_.empty() ? robot.chassis.velocity.lag_s : 0.0),
      sums_(wheels_.empty() ? 2 : wheels_.size()),
      usual_step_(options.shortest_gap_s) {
  for (std::size_t i = 0; i < wheels_.size(); ++i) places_.push_back(place_of_wheel(robot, i));
}

void WheelSums::set_units(const WheelUnits& units) {
  units_ = units;
  for (std::size_t i = 0; i < sums_.size(); ++i) {
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

bool WheelSums::add(const WheelReadings& readings) {
  const std::size_t number = added_++;
  Row row{.time_s = readings.time_s + offset_s_};
  if (last_s_ && row.time_s <= *last_s_) return false;
  if (last_s_) usual_step_.add(row.time_s - *last_s_);
  last_s_ = row.time_s;
  row.longest_step_s = usual_step_.longest_s();
  row.sum.fill(kNotMeasured);
  for (CounterFinding& found : row.found) found.reading = number;
  rows_.push_back(row);
  for (std::size_t i = 0; i < sums_.size(); ++i) read(i, readings.value[i], row);
  leave_out_unknown();
  return true;
}

void WheelSums::finish() {
  finished_ = true;
  if (rows_.empty()) return;
  for (std::size_t i = 0; i < sums_.size(); ++i)
    for (const CounterStep& step : sums_[i].counter.decide(rows_.back().longest_step_s))
      settle(i, step, rows_.back().longest_step_s);
  leave_out_unknown();
}

/// Of a velocity that was read as `read` for so long: of the motion that follows it. docs/theory/velocity.md,
/// eq. 2.
double WheelSums::mean_of_motion(Sum& sum, double read, double duration_s) const {
  if (lag_s_ == 0.0) return read;
  const double ahead = *sum.velocity - read;
  if (std::abs(ahead) * lag_s_ < kArrived) {  // else a robot would never stand
    sum.velocity = read;
    return read + ahead * lag_s_ / duration_s;
  }
  const double faded = -std::expm1(-duration_s / lag_s_);
  sum.velocity = read + ahead * (1.0 - faded);
  return read + ahead * faded * lag_s_ / duration_s;
}

/// A rate is the mean since the row before.
void WheelSums::read(std::size_t wheel, double value, const Row& row) {
  Sum& sum = sums_[wheel];
  if (units_[wheel] == WheelUnit::rate) {
    if (!sum.velocity && !std::isnan(value)) sum.velocity = value;  // and it had been told so for long
    if (!sum.time_s)
      settle(wheel, {row.time_s, row.time_s}, 0.0);
    else if (const double duration_s = row.time_s - *sum.time_s; !std::isnan(value))
      settle(wheel, {*sum.time_s, row.time_s, mean_of_motion(sum, value, duration_s) * duration_s}, 0.0);
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
void WheelSums::settle(std::size_t wheel, const CounterStep& step, double longest_step_s) {
  Sum& sum = sums_[wheel];
  const double start = sum.value;
  sum.value += step.travel;
  sum.time_s = step.end_s;
  const bool fills = step.duration_s() <= longest_step_s;
  for (auto row = rows_.rbegin(); row != rows_.rend() && row->time_s >= step.start_s; ++row) {
    if (row->time_s == step.end_s) {
      row->sum[wheel] = sum.value;
      row->found[wheel].event = step.event;
      row->broken = row->broken || !step.is_measured();
    } else if (fills && row->time_s < step.end_s && row->time_s > step.start_s) {
      const double slope = (sum.value - start) / step.duration_s();
      row->sum[wheel] = start + slope * (row->time_s - step.start_s);
    }
  }
}

bool WheelSums::is_known(const Row& row) const {
  return std::none_of(row.sum.begin(), row.sum.begin() + static_cast<std::ptrdiff_t>(sums_.size()),
                      [](double sum) { return std::isnan(sum); });
}

/// Whether no further reading can determine what a wheel had turned by then.
bool WheelSums::stays_unknown(const Row& row) const {
  for (std::size_t i = 0; i < sums_.size(); ++i) {
    if (!std::isnan(row.sum[i])) continue;
    const Sum& sum = sums_[i];
    if (finished_ || !sum.time_s || *sum.time_s > row.time_s || units_[i] == WheelUnit::rate) return true;
    if (!sum.counter.waits() && *last_s_ - *sum.time_s > rows_.back().longest_step_s) return true;
  }
  return false;
}

void WheelSums::leave_out_unknown() {
  while (!rows_.empty() && !is_known(rows_.front()) && stays_unknown(rows_.front())) {
    left_out_.take_over(rows_.front());
    rows_.erase(rows_.begin());
  }
  if (!start_s_ && has_next()) start_s_ = rows_.front().time_s;
}

WheelSums::Row WheelSums::take_next() {
  Row row = rows_.front();
  rows_.erase(rows_.begin());
  row.take_over(left_out_);
  left_out_ = {};
  leave_out_unknown();
  return row;
}

void WheelSums::Row::take_over(const Row& left_out) {
  broken = broken || left_out.broken;
  for (std::size_t i = 0; i < found.size(); ++i)
    if (left_out.found[i].event != CounterEvent::none) found[i] = left_out.found[i];
}

}  // namespace trundle::recording
