#include "trundle/recording/alignment/gyro_integral.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace trundle::recording {
namespace {

constexpr std::size_t kForgetAtOnce = 64;  // samples: to look for them each time costs more than they do

}  // namespace

bool GyroIntegral::add(double time_s, double yaw_rate_rad_s) {
  const double at_s = time_s + offset_s_;
  if (!first_s_) {
    first_s_ = at_s;
    first_rate_ = yaw_rate_rad_s;
    samples_.push_back({at_s, 0.0, 0});
  } else {
    const Sample& before = samples_.back();
    const double step_s = at_s - before.time_s;
    if (step_s <= 0.0) return false;
    usual_step_.add(step_s);
    const bool gap = step_s > usual_step_.longest_s();
    const bool saturated = std::abs(yaw_rate_rad_s) >= max_rate_rad_s_;
    const bool lost = std::isnan(yaw_rate_rad_s) || saturated || gap;
    saturated_ += saturated ? 1 : 0;
    samples_.push_back(
        {at_s, before.angle + (lost ? 0.0 : yaw_rate_rad_s * step_s), before.lost + (lost ? 1 : 0)});
    beyond_s_ = gap ? 0.0 : step_s;
    if (!before_s_) before_s_ = beyond_s_;
  }
  last_rate_ = yaw_rate_rad_s;
  return true;
}

GyroIntegral::Reading GyroIntegral::at(double time_s, bool is_silent) const {
  if (samples_.empty()) return {};
  const auto after = first_at_or_after(time_s);
  if (after == samples_.end()) {
    const Sample& last = samples_.back();
    const double beyond_s = time_s - last.time_s;
    if (beyond_s > beyond_s_ || is_silent) return {};
    return {!std::isnan(last_rate_), last.angle + last_rate_ * beyond_s, last.lost, last.lost};
  }
  const double ahead_s = after->time_s - time_s;
  if (ahead_s == 0.0) return {true, after->angle, after->lost, after->lost};
  if (time_s < *first_s_) {
    if (ahead_s > before_s_.value_or(0.0)) return {};
    return {!std::isnan(first_rate_), -first_rate_ * ahead_s, 0, 0};
  }
  if (after == samples_.begin()) return {};
  const Sample& before = *(after - 1);
  const double u = 1.0 - ahead_s / (after->time_s - before.time_s);
  return {true, before.angle + u * (after->angle - before.angle), before.lost, after->lost};
}

std::optional<double> GyroIntegral::turn(const Reading& start, const Reading& end) {
  if (!start.known || !end.known || end.lost_after != start.lost_before) return std::nullopt;
  return end.angle - start.angle;
}

double GyroIntegral::rate_before(double time_s, const Reading& there) const {
  const std::optional<double> turned = turn(at(time_s - kRateOver_s), there);
  return turned ? *turned / kRateOver_s : std::numeric_limits<double>::quiet_NaN();
}

bool GyroIntegral::is_awaited(double time_s) const {
  return samples_.empty() || samples_.back().time_s < time_s || (time_s < *first_s_ && !before_s_);
}

/// The last sample before the time stays, to interpolate from.
void GyroIntegral::forget_before(double time_s) {
  if (samples_.size() < 2 * kForgetAtOnce) return;
  const auto old = first_at_or_after(time_s - kRateOver_s) - samples_.begin() - 1;
  if (old >= static_cast<std::ptrdiff_t>(kForgetAtOnce))
    samples_.erase(samples_.begin(), samples_.begin() + old);
}

std::vector<GyroIntegral::Sample>::const_iterator GyroIntegral::first_at_or_after(double time_s) const {
  return std::ranges::lower_bound(samples_, time_s, {}, &Sample::time_s);
}

}  // namespace trundle::recording
