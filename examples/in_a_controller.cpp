// What `trundle live` does, inside a controller: each cycle gives its readings and gets the pose, its
// covariance and the slip. Here the readings are lines "time_s left_ticks right_ticks yaw_rate_rad_s" on
// stdin.
//   example_in_a_controller robot.toml < readings.txt
#include <cstdio>
#include <iostream>

#include "trundle/chassis/robot.hpp"
#include "trundle/pipeline/live.hpp"

int main(int argc, char** argv) {
  if (argc != 2) return std::fputs("usage: example_in_a_controller robot.toml\n", stderr), 2;
  const trundle::Robot robot = trundle::read_robot(argv[1]);
  trundle::LiveOdometer odometer(robot, {.start = {0.0, 0.0, 0.0}});
  std::vector<trundle::LiveEstimate> estimates;

  double time_s = 0.0, left = 0.0, right = 0.0, yaw_rate = 0.0;
  while (std::cin >> time_s >> left >> right >> yaw_rate) {  // the controller's cycle
    odometer.take({time_s, {{"left_ticks", left}, {"right_ticks", right}}, yaw_rate}, "cycle", estimates);
    for (const trundle::LiveEstimate& now : estimates) {
      const trundle::Pose2& pose = now.slip ? now.slip->pose : now.pose;
      const trundle::Matrix3& covariance = now.slip ? now.slip->covariance : now.covariance;
      std::printf("%.3f s: x %.4f m, y %.4f m, heading %.4f rad, +- %.4f m%s\n", now.time_s, pose.x, pose.y,
                  pose.heading, std::sqrt(covariance(0, 0) + covariance(1, 1)),
                  now.slip && now.slip->slipping ? ", slipping" : "");
    }
    estimates.clear();
  }
}
