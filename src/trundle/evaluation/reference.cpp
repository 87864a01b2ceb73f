#include <cmath>

#include "trundle/evaluation/evaluate.hpp"
#include "trundle/io/interruption.hpp"
#include "trundle/recording/lengths.hpp"

namespace trundle::evaluation {

Trajectory of_reference_sensor(const Trajectory& world_from_body, const Robot& robot) {
  Trajectory moved = world_from_body;
  for (std::size_t i = 0; i < moved.poses.size(); ++i) {
    check_interruption();
    const Pose2 body = moved.poses[i].pose;
    moved.poses[i] = {moved.poses[i].time_s - robot.reference_time_offset_s,
                      body * robot.body_from_reference};
    if (!moved.has_covariance()) continue;
    // ∂(x, y)/∂heading of the sensor: its lever on the body, turned by a quarter.
    const Vector2 lever = moved.poses[i].pose.translation() - body.translation();
    Matrix3 J = Matrix3::Identity();
    J(0, 2) = -lever.y();
    J(1, 2) = lever.x();
    moved.covariances[i] = J * moved.covariances[i] * J.transpose();
  }
  return moved;
}

Trajectory positions_of(const ReferenceStream& reference) {
  require_equal_lengths(reference);
  Trajectory trajectory;
  for (std::size_t i = 0; i < reference.time_s.size(); ++i) {
    if (std::isnan(reference.x_m[i]) || std::isnan(reference.y_m[i])) continue;
    trajectory.poses.push_back(
        {reference.time_s[i], {reference.x_m[i], reference.y_m[i], reference.heading_rad[i]}});
  }
  return trajectory;
}

}  // namespace trundle::evaluation
