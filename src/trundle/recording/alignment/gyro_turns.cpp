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
