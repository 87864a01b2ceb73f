#pragma once

#include <optional>

#include "trundle/chassis/robot.hpp"
#include "trundle/geometry/trajectory.hpp"
#include "trundle/odometry/uncertain.hpp"
#include "trundle/slam/report.hpp"

namespace trundle::slam {

/// What all lengths of a world may be off by in common: they count in the metre of a landmark sensor's
/// ranges, and so do those of wheels that its sightings calibrated. Nothing that is seen shows whether that
/// metre is right: every place is off along the line from where the robot began. Maps count in that metre, in
/// which filters and localizers use them. docs/theory/motion-and-sensor.md, eq. 4c.
struct Metre {
  double sigma = 0.0;               ///< 1σ, as a share; 0: it is right
  Vector2 start = Vector2::Zero();  ///< where the robot began [m]

  /// To the covariance of a pose.
  void add_to(const Pose2& pose, Matrix3& covariance) const;
  void add_to(PoseEstimate& estimate) const { add_to(estimate.pose, estimate.covariance); }
  void add_to(Trajectory& trajectory) const;
};

/// 1σ of the metre, by what a robot's calibration says of sensor.range_scale; nothing: it says nothing.
[[nodiscard]] std::optional<double> metre_sigma(const Robot& robot);
/// That of a robot that begins there; right where its calibration says nothing.
[[nodiscard]] Metre metre_of(const Robot& robot, const Pose2& start);

/// Counts parameters in that metre: their covariance given that ranges are right in proportion. What these
/// may be off by, wheels that they calibrated are off by, too. Eq. 4b.
void count_in_sensor_metre(odometry::UncertainParameters& uncertain);

}  // namespace trundle::slam
