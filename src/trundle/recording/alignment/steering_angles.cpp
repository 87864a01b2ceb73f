#include "trundle/recording/alignment/steering_angles.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "trundle/io/error.hpp"

namespace trundle::recording {
namespace {

// Stamps that differ by less are one: a clock's offset may put a reading on the middle of an interval.
constexpr double kSameTime_s = 1e-9;
/// The same direction, by less than half a turn from `near`.
double turned_near(double rad, double near) {
  return rad + 2.0 * kPi * std::round((near - rad) / (2.0 * kPi));
}

}  // namespace

bool is_direct(const SteeringSensor& steering) {
  constexpr double kDirect = 0.1;  // of its scale; one that is geared is another matter by far
  return std::abs(std::abs(steering.scale) - 1.0) < kDirect;
}

SteeringAngles::SteeringAngles(const Robot& robot)
    : wheels_(robot.chassis.all_wheels().begin(), robot.chassis.all_wheels().end()),
      samples_(wheels_.size()) {
  for (std::size_t i = 0; i < wheels_.size(); ++i) {
    names_.push_back(wheel_name(robot, i));
    places_.push_back(place_of_wheel(robot, i));
  }
}

void SteeringAngles::set_units(const WheelUnits& units) {
  for (std::size_t i = 0; i < wheels_.size(); ++i) {
    if (!wheels_[i].steering) continue;
    rad_per_unit_[i] = 1.0;
    if (units[i] != WheelUnit::ticks) continue;
    if (wheels_[i].steering->ticks_per_revolution == 0.0)
      throw InputError(places_[i],
                       fmt::format("the wheel '{}' has no steering_ticks_per_revolution", names_[i]),
                       "steering_ticks_per_revolution: its steering is read in counts");
    rad_per_unit_[i] = 2.0 * kPi / wheels_[i].steering->ticks_per_revolution;
  }
}

void SteeringAngles::add(double time_s, const std::array<double, kMaxWheels>& readings) {
  for (std::size_t i = 0; i < wheels_.size(); ++i) {
    const std::optional<SteeringSensor>& steering = wheels_[i].steering;
    if (!steering || std::isnan(readings[i])) continue;
    std::vector<Sample>& samples = samples_[i];
    double rad = readings[i] * rad_per_unit_[i];
    if (is_direct(*steering))
      rad = turned_near(rad, samples.empty() ? steering->zero_rad : samples.back().rad);
    samples.push_back({time_s + steering->time_offset_s, rad});
  }
}

bool SteeringAngles::is_awaited(double time_s, double newest_s, double longest_step_s) const {
  for (std::size_t i = 0; i < wheels_.size(); ++i) {
    if (!wheels_[i].steering) continue;
    const bool is_read = !samples_[i].empty() && samples_[i].back().time_s >= time_s - kSameTime_s;
    const bool is_late = newest_s + wheels_[i].steering->time_offset_s > time_s + longest_step_s;
    if (!is_read && !is_late) return true;
  }
  return false;
}

SteeringAngles::Reading SteeringAngles::at(double time_s, double longest_step_s) const {
  Reading reading;
  for (std::size_t i = 0; i < wheels_.size(); ++i) {
    if (!wheels_[i].steering) continue;
    const std::vector<Sample>& samples = samples_[i];
    if (samples.empty()) {
      reading.known = false;
      continue;
    }
    const auto after = std::ranges::lower_bound(samples, time_s - kSameTime_s, {}, &Sample::time_s);
    const Sample& next = after == samples.end() ? samples.back() : *after;
    const Sample& before = after == samples.begin() ? next : *std::prev(after);
    const double step_s = next.time_s - before.time_s;
    const double share = step_s > 0.0 ? std::clamp((time_s - before.time_s) / step_s, 0.0, 1.0) : 0.0;
    reading.rad[i] = before.rad + share * wrap_angle(next.rad - before.rad);
    const double away_s = std::min(std::abs(next.time_s - time_s), std::abs(before.time_s - time_s));
    reading.known = reading.known && away_s <= longest_step_s;
  }
  return reading;
}

void SteeringAngles::smooth(double over_s) {
  if (over_s <= 0.0) return;
  for (std::vector<Sample>& samples : samples_) {
    std::vector<double> sum_rad{0.0};
    for (std::size_t i = 0; i < samples.size(); ++i) {
      if (i > 0) samples[i].rad = turned_near(samples[i].rad, samples[i - 1].rad);
      sum_rad.push_back(sum_rad.back() + samples[i].rad);
    }
    std::size_t first = 0, end = 0;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      while (samples[first].time_s < samples[i].time_s - 0.5 * over_s) ++first;
      while (end < samples.size() && samples[end].time_s <= samples[i].time_s + 0.5 * over_s) ++end;
      const std::size_t aside = std::min(i - first, end - 1 - i);
      samples[i].rad = (sum_rad[i + aside + 1] - sum_rad[i - aside]) / static_cast<double>(2 * aside + 1);
    }
  }
}

void SteeringAngles::forget_before(double time_s) {
  for (std::vector<Sample>& samples : samples_) {
    const auto first_after = std::ranges::lower_bound(samples, time_s, {}, &Sample::time_s);
    if (first_after != samples.begin()) samples.erase(samples.begin(), std::prev(first_after));
  }
}

}  // namespace trundle::recording
