#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/recording/logs/detail/log_streams.hpp"

namespace trundle::recording {
namespace {

ColumnSource log_column(const char* column, std::string path) {
  return {.column = column, .name = std::move(path)};
}

/// Velocities of the body in a twist at a path.
std::vector<ColumnSource> twist_columns(const std::string& path) {
  return {log_column("forward_m_s", path + "linear.x"), log_column("yaw_rate_rad_s", path + "angular.z")};
}

std::vector<ColumnSource> pose_columns(const std::string& position, const std::string& orientation) {
  std::vector<ColumnSource> columns = {log_column("x_m", position + ".x"),
                                       log_column("y_m", position + ".y")};
  for (const char* const part : {"x", "y", "z", "w"})
    columns.push_back({.column = fmt::format("q{}", part), .name = fmt::format("{}.{}", orientation, part)});
  return columns;
}

std::vector<ColumnSource> velocity_columns(std::string_view type) {
  if (type == "nav_msgs/Odometry" || type == "geometry_msgs/TwistWithCovarianceStamped")
    return twist_columns("twist.twist.");
  if (type == "geometry_msgs/TwistStamped") return twist_columns("twist.");
  if (type == "geometry_msgs/Twist") return twist_columns("");
  return {};
}

std::vector<ColumnSource> reference_columns(std::string_view type) {
  if (type == "nav_msgs/Odometry" || type == "geometry_msgs/PoseWithCovarianceStamped")
    return pose_columns("pose.pose.position", "pose.pose.orientation");
  if (type == "geometry_msgs/PoseStamped") return pose_columns("pose.position", "pose.orientation");
  if (type == "geometry_msgs/Pose") return pose_columns("position", "orientation");
  if (type == "geometry_msgs/TransformStamped")
    return pose_columns("transform.translation", "transform.rotation");
  if (type == "geometry_msgs/Pose2D")
    return {log_column("x_m", "x"), log_column("y_m", "y"), log_column("heading_rad", "theta")};
  if (type == "sensor_msgs/NavSatFix")
    return {log_column("latitude_deg", "latitude"), log_column("longitude_deg", "longitude")};
  return {};
}

}  // namespace

std::string type_of_topic(const std::filesystem::path& log, const std::string& topic,
                          const std::string& place) {
  const auto opened = logs::open_log(log);
  const auto find = [&]() -> const logs::Channel* {
    for (const logs::Channel* const channel : opened->channels())
      if (channel->topic == topic) return channel;
    return nullptr;
  };
  const logs::Channel* found = find();
  std::size_t known = opened->channels().size();
  while (found == nullptr && opened->next()) {  // a log without an index names them as they come
    if (opened->channels().size() == known) continue;
    known = opened->channels().size();
    found = find();
  }
  if (found != nullptr) return logs::short_type_name(found->type);
  std::vector<std::string> topics;
  for (const logs::Channel* const channel : opened->channels()) topics.push_back(channel->topic);
  const std::string nearest = nearest_name(topic, topics);
  constexpr std::size_t kMostNames = 12;  // more would make a list of the message
  if (topics.size() > kMostNames) topics.resize(kMostNames);
  throw InputError(place, fmt::format("{} has no topic '{}'", log.string(), topic),
                   nearest.empty() ? fmt::format("one of {}", fmt::join(topics, ", ")) : "'" + nearest + "'");
}

std::vector<ColumnSource> columns_of_type(StreamKind kind, std::string_view type) {
  switch (kind) {
    case StreamKind::velocity:
    case StreamKind::commands:
      return velocity_columns(type);
    case StreamKind::reference:
      return reference_columns(type);
    case StreamKind::gyro:
      if (type == "sensor_msgs/Imu") return {log_column("yaw_rate_rad_s", "angular_velocity.up")};
      return {};
    case StreamKind::accel:
      if (type == "sensor_msgs/Imu")
        return {log_column("x_m_s2", "linear_acceleration.x"), log_column("y_m_s2", "linear_acceleration.y")};
      return {};
    case StreamKind::wheels:
      if (type == "irobot_create_msgs/WheelTicks")
        return {log_column("left_ticks", "ticks_left"), log_column("right_ticks", "ticks_right")};
      return {};
    default:
      return {};
  }
}

}  // namespace trundle::recording
