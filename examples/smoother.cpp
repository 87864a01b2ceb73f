// After the drive: the most probable trajectory and map given everything that was seen, before and after each
// instant. A filter tells first which sighting shows which landmark. Writes both with their covariances, for
// trundle evaluate and trundle localize. In the root of the repository:
//   example_smoother out/calibrated.toml data/demo/session_02/tour out/trajectory.csv out/landmarks.csv
#include "trundle/slam/smoothing/smoother.hpp"

#include <cstdio>

#include "trundle/geometry/gaussian.hpp"
#include "trundle/io/error.hpp"
#include "trundle/io/file.hpp"
#include "trundle/recording/trajectory_file.hpp"
#include "trundle/slam/consistency_checks.hpp"
#include "trundle/slam/map_file.hpp"

using namespace trundle::slam;

int main(int argc, char** argv) try {
  if (argc != 5)
    return std::fputs("usage: example_smoother robot.toml RECORDING trajectory.csv landmarks.csv\n", stderr),
           2;
  const Robot robot = read_robot(argv[1]);
  const Recording recording = read_recording(argv[2]);
  const SlamInput input = slam_input(recording, robot);

  const SlamResult filtered = slam(input, *robot.landmark_sensor);
  const SmoothedSlam best = smooth(input, *robot.landmark_sensor, filtered);
  const Pose2& end = best.last.pose;
  std::printf("end: x %.4f m, y %.4f m, heading %.4f rad, +- %.4f m; while it drove +- %.4f m\n", end.x,
              end.y, end.heading, position_sigma(best.last.covariance),
              position_sigma(filtered.last.covariance));
  std::printf("%zu landmarks, %zu of %zu sightings are outliers\n", best.map.size(), best.counts.outliers,
              best.counts.sightings);
  // Evidence against the result: a lost filter, wrong sigmas, a minimum that was not reached.
  for (const Finding& finding : consistency_checks(input, filtered, &best))
    std::printf("inconsistent: %s\n", describe(finding).c_str());
  write_file(argv[3], to_csv(best.trajectory));
  write_file(argv[4], to_csv(best.map, input.landmarks));
} catch (const std::exception& error) {
  return std::fprintf(stderr, "%s\n", error.what()), exit_code_of(error);
}
