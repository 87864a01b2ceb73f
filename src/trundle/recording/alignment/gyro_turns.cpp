#include "trundle/recording/alignment/gyro_turns.hpp"

#include <algorithm>
#include <cmath>

#include "trundle/recording/alignment/aligner.hpp"

namespace trundle::recording {

GyroSamples::GyroSamples(const GyroStream& gyro, const Gyro& sensor)
    : stream(gyro), is_lost(gyro.time_s.size()) {
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

GyroAngles::GyroAngles(const GyroSamples& samples) : time_s_(samples.stream.time_s) {
  angle_.reserve(time_s_.size());
  double angle = 0.0;
  for (std::size_t i = 0; i < time_s_.size(); ++i) {
    if (samples.is_lost[i])
      lost_.push_back(i);
    else if (i > 0)
      angle += samples.stream.yaw_rate_rad_s[i] * (time_s_[i] - time_s_[i - 1]);
    angle_.push_back(angle);
  }
}

GyroIntegral::Reading GyroAngles::at(double sensor_time_s, std::size_t& near) const {
  while (near > 0 && time_s_[near - 1] >= sensor_time_s) --near;
  while (near < time_s_.size() && time_s_[near] < sensor_time_s) ++near;
  if (near == time_s_.size()) return {};
  const double ahead_s = time_s_[near] - sensor_time_s;
  if (ahead_s == 0.0) return {true, angle_[near], lost_until(near), lost_until(near)};
  if (near == 0) return {};
  const double u = 1.0 - ahead_s / (time_s_[near] - time_s_[near - 1]);
  return {true, angle_[near - 1] + u * (angle_[near] - angle_[near - 1]), lost_until(near - 1),
          lost_until(near)};
}

std::size_t GyroAngles::lost_until(std::size_t sample) const {
  if (lost_.empty()) return 0;
  return static_cast<std::size_t>(std::ranges::upper_bound(lost_, sample) - lost_.begin());
}

GyroIntegral::Reading GyroTurns::beyond(const GyroSamples& samples, bool before_first, Sample nearest,
                                        double time_s) {
  if (time_s == nearest.time_s) return {true, nearest.angle, nearest.lost, nearest.lost};
  const std::vector<double>& rates = samples.stream.yaw_rate_rad_s;
  const double rate = before_first ? rates.front() : rates.back();
  const double away_s = time_s - nearest.time_s;
  if (std::abs(away_s) > (before_first ? samples.before_s : samples.beyond_s)) return {};
  return {!std::isnan(rate), nearest.angle + rate * away_s, nearest.lost, nearest.lost};
}

}  // namespace trundle::recording
