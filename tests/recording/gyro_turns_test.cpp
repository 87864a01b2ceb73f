#include "trundle/recording/alignment/gyro_turns.hpp"

#include <algorithm>
#include <limits>

#include <gtest/gtest.h>

#include "trundle/recording/alignment/aligner.hpp"
#include "trundle/statistics/random.hpp"

namespace trundle::recording {
namespace {

/// At about 100 Hz, with a gap, an empty cell and a sample beyond its limit.
GyroStream stream_with_faults() {
  Random random(5, 1);
  GyroStream gyro;
  double time_s = 10.0;
  for (int i = 0; i < 400; ++i) {
    time_s += i == 150 ? 2.0 : 0.01 * (0.5 + random.uniform());
    gyro.time_s.push_back(time_s);
    gyro.yaw_rate_rad_s.push_back(i == 220   ? std::numeric_limits<double>::quiet_NaN()
                                  : i == 300 ? 9.0
                                             : random.uniform() - 0.5);
  }
  return gyro;
}

TEST(GyroTurns, are_those_of_the_integral_to_the_last_bit) {
  const GyroStream gyro = stream_with_faults();
  for (const double offset_s : {0.0, 0.0123, -0.3}) {
    const Gyro sensor{.max_rate_rad_s = 8.0, .time_offset_s = offset_s};
    GyroIntegral integral(sensor, AlignerOptions{}.shortest_gap_s);
    for (std::size_t i = 0; i < gyro.time_s.size(); ++i) integral.add(gyro.time_s[i], gyro.yaw_rate_rad_s[i]);
    const GyroSamples samples(gyro, sensor);
    GyroTurns turns(samples, offset_s, 9.99);
    GyroIntegral::Reading start = integral.at(9.99);
    int known = 0, unknown = 0;
    for (double time_s = 10.0; time_s < gyro.time_s.back() + 0.5; time_s += 0.007) {
      const GyroIntegral::Reading end = integral.at(time_s);
      const std::optional<double> expected = GyroIntegral::turn(start, end);
      EXPECT_EQ(turns.until(time_s), expected) << time_s << " s, offset " << offset_s << " s";
      ++(expected ? known : unknown);
      start = end;
    }
    EXPECT_GT(known, 300);
    EXPECT_GT(unknown, 250);  // the gap, both ends, and two samples
  }
}

}  // namespace
}  // namespace trundle::recording
