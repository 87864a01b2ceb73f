// Drives without a map and makes one: at each instant at which landmarks are seen, where the robot is and how
// well that is known; at the end the map with covariances. The filter takes one step at a time and its memory
// does not grow with time, as a robot needs it. In the root of the repository:
//   example_slam out/calibrated.toml data/demo/session_02/tour out/landmarks.csv
#include "trundle/slam/slam.hpp"

#include <cstdio>

#include "trundle/geometry/gaussian.hpp"
#include "trundle/io/error.hpp"
#include "trundle/io/file.hpp"
#include "trundle/recording/trajectory_file.hpp"
#include "trundle/slam/map_file.hpp"

using namespace trundle::slam;

int main(int argc, char** argv) try {
  if (argc != 4) return std::fputs("usage: example_slam robot.toml RECORDING landmarks.csv\n", stderr), 2;
  const Robot robot = read_robot(argv[1]);
  const Recording recording = read_recording(argv[2]);
  const SlamInput input = slam_input(recording, robot);

  // The smoother, which remembers the whole drive; SlamMethod::ekf needs memory for pose and map alone.
  SlamFilter filter(*robot.landmark_sensor, slam_options_for(input));
  for (const SlamStep& step : input.steps) {
    filter.step(step);
    if (step.observations.empty()) continue;
    const PoseEstimate now = filter.estimate();
    std::printf("%.3f s: x %.4f m, y %.4f m, heading %.4f rad, +- %.4f m, %zu landmarks seen\n", step.time_s,
                now.pose.x, now.pose.y, now.pose.heading, position_sigma(now.covariance),
                step.observations.size());
  }
  write_file(argv[3], to_csv(filter.map(), input.landmarks));
} catch (const std::exception& error) {
  return std::fprintf(stderr, "%s\n", error.what()), exit_code_of(error);
}
