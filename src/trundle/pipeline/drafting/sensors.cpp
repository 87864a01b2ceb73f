#include "trundle/pipeline/drafting/detail/sensors.hpp"

#include <algorithm>
#include <array>

#include "trundle/pipeline/drafting/detail/candidates.hpp"

namespace trundle::pipeline {
namespace {

using logs::FieldSummary;
using logs::TopicSummary;

bool is_truth(const TopicSummary& topic) {
  return has_word(words_of(topic.topic),
                  {"truth", "gt", "groundtruth", "mocap", "vicon", "optitrack", "qualisys", "natnet", "vrpn",
                   "rtk", "leica", "gazebo", "reference", "ref", "tracker", "lighthouse", "slam", "amcl"});
}

DraftStream satellite_stream(const TopicSummary& topic, const char* latitude, const char* longitude,
                             double scale) {
  DraftStream stream = stream_of("reference", topic, "satellites: metres of error, no heading");
  stream.columns = {{.column = "latitude_deg", .field = latitude, .scale = scale},
                    {.column = "longitude_deg", .field = longitude, .scale = scale}};
  return stream;
}

std::optional<DraftStream> known_reference(const TopicSummary& topic) {
  const std::string type = logs::short_type_name(topic.type);
  if (type == "sensor_msgs/NavSatFix")
    return stream_of("reference", topic, "satellites: metres of error, no heading");
  if (type == "geometry_msgs/PoseStamped" || type == "geometry_msgs/PoseWithCovarianceStamped" ||
      type == "geometry_msgs/TransformStamped")
    return stream_of("reference", topic,
                     is_truth(topic)
                         ? "poses, by its name of a system outside the robot"
                         : "poses; whether they are better than the wheels, its name does not say");
  if (type == "nav_msgs/Odometry" && is_truth(topic))
    return stream_of("reference", topic, "by its name the truth");
  if (topic.type == "GPS" && field_of(topic, "Lat") != nullptr && field_of(topic, "Lng") != nullptr)
    return satellite_stream(topic, "Lat", "Lng", 1.0);
  if (topic.type == "vehicle_gps_position" && field_of(topic, "lat") != nullptr)
    return satellite_stream(topic, "lat", "lon", 1e-7);
  return std::nullopt;
}

/// x, y and a heading of one table or message.
std::optional<DraftStream> named_reference(const TopicSummary& topic) {
  DraftStream stream = stream_of("reference", topic, "by the names of its columns");
  const auto take = [&](const char* column, std::initializer_list<std::string_view> names, auto unit_in) {
    for (const FieldSummary& field : topic.fields) {
      const std::vector<std::string> words = words_of(field.path);
      const bool is_named = !words.empty() && has_word({words.front()}, names);
      if (field.is_text || field.values == 0 || !is_named) continue;
      if (has_word(words, {"rate", "vel", "velocity", "acc", "accel", "m_s", "sigma", "std"})) continue;
      stream.columns.push_back({.column = column, .field = field.path, .unit = unit_in(words)});
      return true;
    }
    return false;
  };
  using Words = std::vector<std::string>;
  const auto none = [](const Words&) { return std::string(); };
  const auto of_length = [](const Words& words) { return length_unit_in({words.back()}); };
  const auto of_angle = [](const Words& words) {
    return std::string(has_word(words, {"deg", "degrees"}) ? "deg" : "");
  };
  if (take("latitude_deg", {"lat", "latitude"}, none) &&
      take("longitude_deg", {"lon", "lng", "long", "longitude"}, none)) {
    stream.reason = "satellites: metres of error, no heading";
    return stream;
  }
  stream.columns.clear();
  const bool has_x = take("x_m", {"x", "px", "pos", "position"}, of_length),
             has_y = take("y_m", {"y", "py"}, of_length);
  if (!has_x || !has_y) return std::nullopt;
  take("heading_rad", {"heading", "yaw", "theta", "th", "phi", "psi"}, of_angle);
  return stream;
}

bool is_odometry(const TopicSummary& topic) {
  return has_word(words_of(topic.topic), {"odom", "odometry", "odometer"});
}

/// Forward velocity and yaw rate of one table.
std::optional<DraftStream> named_velocity(const TopicSummary& topic) {
  DraftStream stream = stream_of("velocity", topic, "by the names of its columns");
  for (const FieldSummary& field : topic.fields) {
    const std::vector<std::string> words = words_of(field.path);
    if (field.is_text || field.values == 0 || words.empty() || is_wanted_only(words)) continue;
    const bool is_forward = has_word({words.front()}, {"v", "vx", "forward", "speed"});
    const bool is_yaw = has_word({words.front()}, {"om", "omega", "w", "wz", "vth"});
    const char* const column = is_forward ? "forward_m_s" : is_yaw ? "yaw_rate_rad_s" : nullptr;
    if (column == nullptr || std::ranges::count(stream.columns, column, &DraftColumn::column) > 0) continue;
    stream.columns.push_back({.column = column, .field = field.path});
  }
  return stream.columns.size() == 2 ? std::optional(std::move(stream)) : std::nullopt;
}

}  // namespace

std::vector<DraftStream> reference_candidates(const DraftQuestion& question) {
  std::vector<DraftStream> found;
  for (const TopicSummary& topic : question.summary.topics) {
    if (topic.messages == 0) continue;
    if (question.is_csv && is_odometry(topic)) continue;
    std::optional<DraftStream> stream = question.is_csv ? named_reference(topic) : known_reference(topic);
    if (stream) found.push_back(std::move(*stream));
  }
  drop_unstamped(found, question);
  put_best_first(found, question, [](const DraftStream& stream, const TopicSummary& topic) {
    const bool is_satellites = logs::short_type_name(topic.type) == "sensor_msgs/NavSatFix" ||
                               topic.type == "GPS" ||
                               (!stream.columns.empty() && stream.columns.front().column == "latitude_deg");
    return is_truth(topic) ? 2.0 : is_satellites ? 1.0 : 0.0;
  });
  return found;
}

std::vector<DraftStream> sighting_candidates(const DraftQuestion& question) {
  struct KnownTags {
    std::string_view type, id, position;
  };
  constexpr std::array kKnownTags = {
      KnownTags{"apriltag_ros/AprilTagDetectionArray", "detections[].id[0]",
                "detections[].pose.pose.pose.position"},
      KnownTags{"fiducial_msgs/FiducialTransformArray", "transforms[].fiducial_id",
                "transforms[].transform.translation"},
      KnownTags{"aruco_msgs/MarkerArray", "markers[].id", "markers[].pose.pose.position"},
      KnownTags{"aruco_opencv_msgs/ArucoDetection", "markers[].marker_id", "markers[].pose.position"},
      KnownTags{"ros2_aruco_interfaces/ArucoMarkers", "marker_ids[]", "poses[].position"}};
  std::vector<DraftStream> found;
  for (const TopicSummary& topic : question.summary.topics) {
    const auto known = std::ranges::find(kKnownTags, logs::short_type_name(topic.type), &KnownTags::type);
    if (known == kKnownTags.end() || topic.messages == 0 || !topic.unreadable.empty()) continue;
    DraftStream stream = stream_of("sightings", topic, "tags; x of the camera points right, z ahead");
    const std::string position(known->position);
    stream.columns = {{.column = "landmark", .field = std::string(known->id)},
                      {.column = "x_m", .field = position + ".z"},
                      {.column = "y_m", .field = position + ".x", .scale = -1.0}};
    found.push_back(std::move(stream));
  }
  return found;
}

std::vector<DraftStream> velocity_candidates(const DraftQuestion& question) {
  std::vector<DraftStream> found;
  for (const TopicSummary& topic : question.summary.topics) {
    if (logs::short_type_name(topic.type) == "nav_msgs/Odometry" && topic.messages > 1 && !is_truth(topic))
      found.push_back(stream_of("velocity", topic, "odometry as the robot itself computed it"));
    if (std::optional<DraftStream> named = question.is_csv ? named_velocity(topic) : std::nullopt)
      found.push_back(std::move(*named));
  }
  drop_unstamped(found, question);
  put_best_first(found, question, [](const DraftStream&, const TopicSummary& topic) {
    // What a filter has made of it already is no measurement of the wheels.
    const bool is_filtered =
        has_word(words_of(topic.topic), {"filtered", "fused", "ekf", "ukf", "global", "gps"});
    return (is_filtered ? 0.0 : 1e9) + static_cast<double>(topic.messages);
  });
  return found;
}

std::optional<StampColumn> stamps_of(const TopicSummary& table) {
  const auto rises = [](const FieldSummary& field) {
    return !field.is_text && field.values > 1 && field.falls == 0 && field.last > field.first;
  };
  const FieldSummary* found = nullptr;
  for (const FieldSummary& field : table.fields)
    if (rises(field) &&
        has_word(words_of(field.path), {"time", "t", "stamp", "timestamp", "ts", "secs", "sec", "seconds",
                                        "ms", "millis", "micros", "us", "ns", "nsec", "utime"})) {
      found = &field;
      break;
    }
  if (found == nullptr && !table.fields.empty() && rises(table.fields.front())) found = &table.fields.front();
  if (found == nullptr) return std::nullopt;
  const std::vector<std::string> words = words_of(found->path);
  const double step =
      (found->last - found->first) / static_cast<double>(std::max<std::uint64_t>(found->changes, 1));
  // A robot's sensors come once a millisecond to once a second.
  const bool is_named = has_word(words, {"s", "sec", "secs", "seconds"});
  std::string unit = is_named || step < 1.0 ? "" : step < 1e3 ? "ms" : step < 1e6 ? "us" : "ns";
  for (const char* const name : {"ms", "us", "ns"})
    if (has_word(words, {name})) unit = name;
  return StampColumn{found->path, unit};
}

}  // namespace trundle::pipeline
