#include "trundle/pipeline/viewers/ros_messages.hpp"

#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "trundle/report/scatter.hpp"
#include "trundle/slip/find_slip.hpp"

namespace trundle::pipeline {
namespace {

constexpr std::int64_t kNsOfSecond = 1'000'000'000;  // a ROS stamp has both apart

void put_stamp(CdrWriter& out, const RosStamp& stamp) {
  out.put(static_cast<std::int32_t>(stamp.time_ns / kNsOfSecond));
  out.put(static_cast<std::uint32_t>(stamp.time_ns % kNsOfSecond));
  out.text(stamp.frame);
}

void put_vector(CdrWriter& out, double x, double y, double z) {
  out.put(x).put(y).put(z);
}

/// Geometry's Pose and Transform have the same bytes.
void put_pose(CdrWriter& out, const Pose2& pose) {
  put_vector(out, pose.x, pose.y, 0.0);
  put_vector(out, 0.0, 0.0, std::sin(0.5 * pose.heading));  // of the quaternion x, y, z
  out.put(std::cos(0.5 * pose.heading));
}

/// 6 × 6 of x, y, z and the rotations about them; `planar` of x, y and the heading.
void put_covariance(CdrWriter& out, const Matrix3& planar) {
  constexpr std::array<int, 6> kPlanar = {0, 1, -1, -1, -1, 2};
  for (const int row : kPlanar)
    for (const int column : kPlanar) out.put(row < 0 || column < 0 ? 0.0 : planar(row, column));
}

/// visualization_msgs/msg/Marker.
struct RosMarker {
  enum Type : std::int32_t { kSphere = 2, kCylinder = 3, kText = 9 };
  enum Action : std::int32_t { kAdd = 0, kDeleteAll = 3 };

  std::string_view name_space;
  std::int32_t id = 0;
  Type type = kSphere;
  Action action = kAdd;
  Pose2 pose = {};
  Vector3 scale = Vector3::Zero();
  std::array<float, 4> colour = {0.0F, 0.0F, 0.0F, 1.0F};  ///< red, green, blue, opacity
  std::string_view text = {};
};

void put_marker(CdrWriter& out, const RosStamp& stamp, const RosMarker& marker) {
  put_stamp(out, stamp);
  out.text(marker.name_space).put(marker.id).put(std::int32_t{marker.type}).put(std::int32_t{marker.action});
  put_pose(out, marker.pose);
  put_vector(out, marker.scale.x(), marker.scale.y(), marker.scale.z());
  for (const float part : marker.colour) out.put(part);
  out.put(std::int32_t{0}).put(std::uint32_t{0});  // it stays
  out.put(std::uint8_t{0});                        // where it was put, though its frame should move
  out.count(0).count(0);                           // points and their colours
  out.text("");                                    // a texture, and its image
  put_stamp(out, {});
  out.text("").count(0).count(0);
  out.text(marker.text);
  out.text("").text("").count(0);  // a mesh
  out.put(std::uint8_t{0});
}

constexpr std::array<float, 4> kBlue = {0.12F, 0.47F, 0.71F, 0.5F};
constexpr std::array<float, 4> kBlack = {0.0F, 0.0F, 0.0F, 1.0F};
constexpr double kFlat_m = 0.01;       ///< in z: a disc that viewers still draw
constexpr double kLetters_m = 0.2;     ///< height
constexpr double kSmallest_m = 0.002;  ///< of an axis: viewers warn of scales of 0

RosMarker disc_of(const RosEllipse& ellipse) {
  const Ellipse region = error_ellipse95(ellipse.centre, ellipse.covariance);
  return {.name_space = {},
          .type = RosMarker::kSphere,
          .pose = {ellipse.centre.x(), ellipse.centre.y(), region.angle_rad},
          .scale = {std::max(2.0 * region.semi_major_m, kSmallest_m),
                    std::max(2.0 * region.semi_minor_m, kSmallest_m), kFlat_m},
          .colour = kBlue};
}

RosMarker label_of(const RosEllipse& ellipse) {
  return {.name_space = {},
          .type = RosMarker::kText,
          .pose = {ellipse.centre.x(), ellipse.centre.y(), 0.0},
          .scale = {0.0, 0.0, kLetters_m},
          .colour = kBlack,
          .text = ellipse.name};
}

}  // namespace

void put_odometry(CdrWriter& out, const RosStamp& stamp, std::string_view child, const Pose2& pose,
                  const Matrix3& covariance, const Twist2& motion, double duration_s) {
  put_stamp(out, stamp);
  out.text(child);
  put_pose(out, pose);
  put_covariance(out, covariance);
  const double per_second = duration_s > 0.0 ? 1.0 / duration_s : 0.0;
  put_vector(out, motion.dx * per_second, motion.dy * per_second, 0.0);
  put_vector(out, 0.0, 0.0, motion.dtheta * per_second);
  put_covariance(out, Matrix3::Zero());
}

void put_transform(CdrWriter& out, const RosStamp& stamp, std::string_view child, const Pose2& pose) {
  out.count(1);
  put_stamp(out, stamp);
  out.text(child);
  put_pose(out, pose);
}

void put_path(CdrWriter& out, const RosStamp& stamp, const std::vector<StampedPose>& poses,
              const std::vector<std::int64_t>& times_ns) {
  put_stamp(out, stamp);
  out.count(poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    put_stamp(out, {times_ns[i], stamp.frame});
    put_pose(out, poses[i].pose);
  }
}

void put_ellipses(CdrWriter& out, const RosStamp& stamp, std::string_view what,
                  const std::vector<RosEllipse>& ellipses) {
  std::vector<RosMarker> markers = {{.name_space = what, .action = RosMarker::kDeleteAll}};
  for (const RosEllipse& ellipse : ellipses) {
    markers.push_back(disc_of(ellipse));
    if (!ellipse.name.empty()) markers.push_back(label_of(ellipse));
  }
  out.count(markers.size());
  for (std::size_t i = 0; i < markers.size(); ++i) {
    markers[i].name_space = what;
    markers[i].id = static_cast<std::int32_t>(i);
    put_marker(out, stamp, markers[i]);
  }
}

void put_slip(CdrWriter& out, const RosStamp& stamp, const ShownSlip& slip, bool begins) {
  constexpr std::uint8_t kOk = 0, kWarn = 1;  // levels of a DiagnosticStatus
  const SlipEvent& event = slip.event;
  put_stamp(out, stamp);
  out.count(1);
  out.put(begins ? kWarn : kOk).text("slip: " + slip.wheel).text(begins ? name_of(event.kind) : "none");
  out.text(slip.wheel);
  const std::array<std::pair<const char*, double>, 3> values = {{{"excess_m", event.excess_m},
                                                                 {"excess_sigma_m", event.excess_sigma_m},
                                                                 {"confidence", event.confidence}}};
  out.count(values.size());
  for (const auto& [key, value] : values) out.text(key).text(fmt::format("{}", begins ? value : 0.0));
}

}  // namespace trundle::pipeline
