#include "trundle/pipeline/no_rest.hpp"

#include <cmath>

#include "trundle/odometry/odometer.hpp"

namespace trundle::pipeline {

void report_no_rest(const RunOfGyro& run, std::vector<Finding>& findings) {
  if (!run.robot.chassis.gyro || run.rest_s > 0.0) return;
  const double by_bias = initial_bias_sigma(run.robot) * run.duration_s;
  const bool is_most = by_bias * by_bias >= 0.5 * run.heading_variance;
  const bool was_learned = by_bias * by_bias >= 2.0 * run.heading_variance;  // otherwise: from the wheels
  if (!is_most || was_learned) return;
  findings.push_back({.severity = Severity::note,
                      .code = FindingCode::no_rest,
                      .place = "gyro",
                      .payload = payload::Amount{degrees(std::sqrt(run.heading_variance))}});
}

}  // namespace trundle::pipeline
