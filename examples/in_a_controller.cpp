// Odometry inside a controller: each cycle gives its readings and gets the pose, its covariance and whether a
// wheel slips, the numbers of `trundle live`. The readings are lines "time_s left_ticks right_ticks
// yaw_rate_rad_s" on stdin: put your encoders and your gyro there.
//   example_in_a_controller robot.toml < readings.txt
#include <cstdio>
#include <iostream>

#include "trundle/geometry/gaussian.hpp"
#include "trundle/io/error.hpp"
#include "trundle/pipeline/live.hpp"

using namespace trundle::pipeline;

int main(int argc, char** argv) try {
  if (argc != 2) return std::fputs("usage: example_in_a_controller robot.toml\n", stderr), 2;
  LiveOdometer odometer(read_robot(argv[1]), {.start = {0.0, 0.0, 0.0}});
  std::vector<LiveEstimate> estimates;

  double time_s = 0.0, left = 0.0, right = 0.0, yaw_rate = 0.0;
  while (std::cin >> time_s >> left >> right >> yaw_rate) {  // the controller's cycle
    odometer.take({time_s, {{"left_ticks", left}, {"right_ticks", right}}, yaw_rate}, "cycle", estimates);
    for (const LiveEstimate& now : estimates)
      std::printf("%.3f s: x %.4f m, y %.4f m, heading %.4f rad, +- %.4f m%s\n", now.time_s,
                  now.best_pose().x, now.best_pose().y, now.best_pose().heading,
                  position_sigma(now.best_covariance()), now.slipping() ? ", slipping" : "");
    estimates.clear();
  }
} catch (const std::exception& error) {
  return std::fprintf(stderr, "%s\n", error.what()), exit_code_of(error);
}
