// Finds where wheels slipped in a recording, and where the robot ended once that is corrected. Wants the
// robot that example_calibrate writes: errors of nominal wheels look like slip. In the root of the
// repository:
//   example_slip out/calibrated.toml data/demo/slip
#include <cmath>
#include <cstdio>

#include "trundle/geometry/gaussian.hpp"
#include "trundle/io/error.hpp"
#include "trundle/slip/find_slip.hpp"

using namespace trundle::slip;

namespace {

void print_end(const char* what, const Trajectory& trajectory) {
  const Pose2& end = trajectory.poses.back().pose;
  const Matrix3& covariance = trajectory.covariances.back();
  std::printf("%s: x %.4f m, y %.4f m, heading %.4f rad, +- %.4f m, +- %.4f rad\n", what, end.x, end.y,
              end.heading, position_sigma(covariance), std::sqrt(covariance(2, 2)));
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 3) return std::fputs("usage: example_slip robot.toml RECORDING\n", stderr), 2;
  const Robot robot = read_robot(argv[1]);
  const Recording recording = read_recording(argv[2]);
  const AlignedReadings readings = align(recording, robot);

  const SlipReport slips = find_slip(readings, recording.commands, robot);
  // "ambiguous": that something slipped is certain, which wheel is not.
  for (const SlipEvent& event : slips.events)
    std::printf("%.2f s to %.2f s: %s %s, %.4f +- %.4f m\n", event.start_s, event.end_s,
                wheel_of(event, robot).c_str(), name_of(event.kind).c_str(), event.excess_m,
                event.excess_sigma_m);
  print_end("as recorded", integrate(readings, robot).trajectory);
  print_end("corrected", integrate(corrected(readings, slips, robot), robot).trajectory);
} catch (const std::exception& error) {
  return std::fprintf(stderr, "%s\n", error.what()), exit_code_of(error);
}
