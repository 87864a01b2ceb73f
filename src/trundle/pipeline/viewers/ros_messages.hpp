#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "trundle/geometry/trajectory.hpp"
#include "trundle/logs/cdr_writer.hpp"
#include "trundle/pipeline/viewers/shown.hpp"

// Messages of ROS 2, in the definitions of Humble, appended to a CdrWriter. Poses lie in the plane z = 0;
// what a robot on wheels does not measure there is 0.
namespace trundle::pipeline {

/// Of a header.
struct RosStamp {
  std::int64_t time_ns = 0;
  std::string_view frame;
};

/// nav_msgs/msg/Odometry: pose and covariance in the frame of the stamp; `motion` since the pose before,
/// over `duration_s`, is its twist, in `child`. Covariances that are not known are 0.
void put_odometry(CdrWriter& out, const RosStamp& stamp, std::string_view child, const Pose2& pose,
                  const Matrix3& covariance, const Twist2& motion, double duration_s);
/// tf2_msgs/msg/TFMessage of one transform.
void put_transform(CdrWriter& out, const RosStamp& stamp, std::string_view child, const Pose2& pose);
/// nav_msgs/msg/Path; `times_ns` of its poses.
void put_path(CdrWriter& out, const RosStamp& stamp, const std::vector<StampedPose>& poses,
              const std::vector<std::int64_t>& times_ns);
/// visualization_msgs/msg/MarkerArray: where a point lies with 95 % probability, for each of them; where
/// there is a name, also a label. Deleted ones first: a viewer forgets what an earlier array showed.
struct RosEllipse {
  Vector2 centre = Vector2::Zero();
  Matrix2 covariance = Matrix2::Zero();
  std::string name = {};
};
void put_ellipses(CdrWriter& out, const RosStamp& stamp, std::string_view what,
                  const std::vector<RosEllipse>& ellipses);
/// diagnostic_msgs/msg/DiagnosticArray: a wheel begins to slip (a warning) or grips again (ok).
void put_slip(CdrWriter& out, const RosStamp& stamp, const ShownSlip& slip, bool begins);

}  // namespace trundle::pipeline
