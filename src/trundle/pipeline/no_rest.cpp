#include "trundle/pipeline/no_rest.hpp"

#include <cmath>

#include <fmt/format.h>

#include "trundle/odometry/odometer.hpp"

namespace trundle {

void report_no_rest(const RunOfGyro& run, std::vector<Problem>& problems) {
  if (!run.robot.chassis.gyro || run.rest_s > 0.0) return;
  const double by_bias = initial_bias_sigma(run.robot) * run.duration_s;
  if (by_bias * by_bias < 0.5 * run.heading_variance) return;
  problems.push_back({.severity = Severity::note,
                      .kind = ProblemKind::no_rest,
                      .place = "gyro",
                      .count = 1,
                      .message = fmt::format(
                          "heading ± {:.2g}° at the end: the robot never stands still, so the gyro's bias "
                          "is not known beforehand: let it rest 2 s at the start",
                          degrees(std::sqrt(run.heading_variance)))});
}

}  // namespace trundle
