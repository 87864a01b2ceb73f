#include "trundle/recording/alignment/gyro_turns.hpp"

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

}  // namespace trundle::recording
