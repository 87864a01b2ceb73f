#include "trundle/pipeline/drafting/detail/sensors.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include <fmt/format.h>

#include "trundle/chassis/chassis.hpp"
#include "trundle/pipeline/drafting/detail/names.hpp"

namespace trundle::pipeline {
namespace {

using logs::FieldSummary;
using logs::TopicSummary;

const FieldSummary* field_of(const TopicSummary& topic, std::string_view path) {
  const auto found = std::ranges::find(topic.fields, path, &FieldSummary::path);
  return found == topic.fields.end() || found->is_text || found->values == 0 ? nullptr : &*found;
}

/// A field of a type that a format itself defines. Bodies of aircraft look forward, right and down.
struct KnownSensor {
  std::string_view type;
  std::string_view field;
  double scale;
};
constexpr std::array kKnownGyros = {
    KnownSensor{"IMU", "GyrZ", -1.0}, KnownSensor{"vehicle_angular_velocity", "xyz[2]", -1.0},
    KnownSensor{"sensor_combined", "gyro_rad[2]", -1.0}, KnownSensor{"sensor_gyro", "z", -1.0}};

bool is_truth(const TopicSummary& topic) {
  return has_word(words_of(topic.topic),
                  {"truth", "gt", "groundtruth", "mocap", "vicon", "optitrack", "qualisys", "natnet", "vrpn",
                   "rtk", "leica", "gazebo", "reference", "ref", "tracker", "lighthouse", "slam", "amcl"});
}

bool is_wanted_only(const std::vector<std::string>& words) {
  return has_word(
      words, {"setpoint", "setpoints", "desired", "target", "goal", "command", "cmd", "covariance", "error",
              "joystick", "auto", "optimized", "bias", "wheel", "max", "min"});
}

/// "rad_s" and its like: a unit of rates, of whatever words it is made.
bool ends_with_rate(const std::vector<std::string>& words) {
  const std::size_t count = words.size();
  return count > 1 && words[count - 1] == "s" && (words[count - 2] == "rad" || words[count - 2] == "deg");
}

/// A yaw rate, as its name says it, and whether in degrees.
bool is_yaw_rate(const std::vector<std::string>& words) {
  const std::size_t count = words.size();
  if (count > 1 && words[count - 1] == "z" && has_word({words[count - 2]}, {"gyro", "gyr", "gyroscope"}))
    return true;  // an axis of a gyro by itself is what it reads
  const bool is_rate = has_word(words, {"rate", "velocity", "vel", "omega", "dps", "speed"}) ||
                       (has_word(words, {"per"}) && has_word(words, {"sec", "second"})) ||
                       has_word(words, {"gyr", "rads"}) || ends_with_rate(words);
  const bool is_of_gyro =
      has_word(words, {"gyro", "imu", "angular", "yaw", "gyr", "pigeon", "navx", "ahrs", "gz"});
  const bool is_other_axis = has_word(words, {"x", "y", "roll", "pitch", "linear", "gx", "gy", "delta"}) ||
                             words.back() == "0" || words.back() == "1";
  return (is_rate || has_word(words, {"gz"})) && is_of_gyro && !is_other_axis;
}

DraftStream stream_of(const char* table, const TopicSummary& topic, std::string reason) {
  DraftStream stream{.table = table, .file = {}, .topic = topic.topic};
  stream.reason = std::move(reason);
  return stream;
}

bool is_imu(const TopicSummary& topic) {
  return logs::short_type_name(topic.type) == "sensor_msgs/Imu";
}

constexpr std::uint64_t kFewestChanges = 10;  ///< of what moves
constexpr const char* kOfAngles = "an angle: the rates are its differences";

bool moves(const TopicSummary& topic, std::string_view path) {
  const FieldSummary* const field = field_of(topic, path);
  return field != nullptr && field->changes > kFewestChanges;
}

/// Some drivers publish the orientation of a sensor alone, and leave its rates 0.
bool has_rates(const TopicSummary& imu) {
  return moves(imu, "angular_velocity.x") || moves(imu, "angular_velocity.y") ||
         moves(imu, "angular_velocity.z");
}

bool has_orientation(const TopicSummary& imu) {
  return moves(imu, "orientation.z") || moves(imu, "orientation.w");
}

DraftStream orientation_stream(const TopicSummary& imu) {
  DraftStream stream = stream_of("gyro", imu, kOfAngles);
  stream.columns.push_back({.column = "yaw_rad", .field = "orientation.yaw"});
  return stream;
}

/// As its name says it, or else its size: no gyro of ours reads so many radians a second.
bool is_in_degrees(const FieldSummary& field, const std::vector<std::string>& words) {
  if (has_word(words, {"deg", "degs", "degrees", "dps"}) || field.unit == "deg/s") return true;
  if (has_word(words, {"rad", "rads", "radians"}) || field.unit == "rad/s") return false;
  return std::max(std::abs(field.least), std::abs(field.most)) > chassis::Gyro{}.max_rate_rad_s;
}

/// As its name says it, or else its size: in radians an angle is hardly beyond a few turns.
std::string unit_of_angle(const FieldSummary& field, const std::vector<std::string>& words) {
  constexpr double kMostRadians = 100.0;  // sixteen turns
  if (has_word(words, {"deg", "degs", "degree", "degrees"}) || field.unit == "deg") return "deg";
  if (has_word(words, {"rot", "rotations", "revolutions"})) return "rev";
  if (has_word(words, {"rad", "rads", "radians"}) || field.unit == "rad") return {};
  return std::max(std::abs(field.least), std::abs(field.most)) > kMostRadians ? "deg" : "";
}

std::optional<DraftStream> known_gyro(const TopicSummary& topic) {
  if (is_imu(topic) && (has_rates(topic) || !has_orientation(topic)))
    return stream_of("gyro", topic, "a sensor_msgs/Imu; the axis that points up is found by gravity");
  for (const KnownSensor& known : kKnownGyros) {
    const bool is_it = known.type == "IMU" ? topic.type.starts_with(known.type) : topic.type == known.type;
    if (!is_it || field_of(topic, known.field) == nullptr) continue;
    DraftStream stream = stream_of("gyro", topic, "z points down in this format");
    stream.columns.push_back(
        {.column = "yaw_rate_rad_s", .field = std::string(known.field), .scale = known.scale});
    return stream;
  }
  return std::nullopt;
}

/// "wz" beside "wx": three axes of a gyro. Odometry has the one that is up alone.
bool is_axis_of_three(const TopicSummary& topic, const FieldSummary& field) {
  const std::vector<std::string> own = words_of(field.path);
  return !own.empty() && own.back() == "wz" &&
         std::ranges::any_of(topic.fields, [](const FieldSummary& other) {
           const std::vector<std::string> words = words_of(other.path);
           return !words.empty() && words.back() == "wx";
         });
}

void add_named_gyros(const TopicSummary& topic, std::vector<DraftStream>& found) {
  // Poses and velocities that something has computed.
  if (topic.type.starts_with("nav_msgs/") || topic.type.starts_with("geometry_msgs/")) return;
  for (const FieldSummary& field : topic.fields) {
    const std::vector<std::string> words = words_of(topic, field);
    if (field.is_text || field.values == 0 || is_wanted_only(words)) continue;
    if (!is_yaw_rate(words) && !is_axis_of_three(topic, field)) continue;
    DraftStream stream = stream_of("gyro", topic, "by its name");
    stream.columns.push_back({.column = "yaw_rate_rad_s",
                              .field = field.path,
                              .unit = is_in_degrees(field, words) ? "deg/s" : ""});
    found.push_back(std::move(stream));
  }
}

/// The most messages first, moving before still.
void put_best_first(std::vector<DraftStream>& streams, const DraftQuestion& question,
                    const std::function<double(const DraftStream&, const TopicSummary&)>& merit) {
  std::ranges::stable_sort(streams, std::ranges::greater(), [&](const DraftStream& stream) {
    const auto topic = std::ranges::find(question.summary.topics, stream.topic, &TopicSummary::topic);
    return topic == question.summary.topics.end() ? 0.0 : merit(stream, *topic);
  });
}

double gyro_merit(const DraftStream& stream, const TopicSummary& topic) {
  const std::string path = stream.columns.empty() ? "angular_velocity.z" : stream.columns.front().field;
  const FieldSummary* const field = field_of(topic, path);
  const bool moves = field != nullptr && field->changes > 10;
  return (moves ? 1e9 : 0.0) + static_cast<double>(topic.messages);
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
  const auto take = [&](const char* column, std::initializer_list<std::string_view> names, const char* unit) {
    for (const FieldSummary& field : topic.fields) {
      const std::vector<std::string> words = words_of(field.path);
      const bool is_named = !words.empty() && has_word({words.front()}, names);
      const bool is_degrees = has_word(words, {"deg", "degrees"});
      if (field.is_text || field.values == 0 || !is_named) continue;
      if (has_word(words, {"rate", "vel", "velocity", "acc", "accel", "m_s", "sigma", "std"})) continue;
      stream.columns.push_back({.column = column, .field = field.path, .unit = is_degrees ? unit : ""});
      return true;
    }
    return false;
  };
  if (take("latitude_deg", {"lat", "latitude"}, "") &&
      take("longitude_deg", {"lon", "lng", "long", "longitude"}, "")) {
    stream.reason = "satellites: metres of error, no heading";
    return stream;
  }
  stream.columns.clear();
  const bool has_x = take("x_m", {"x", "px", "pos", "position"}, ""), has_y = take("y_m", {"y", "py"}, "");
  if (!has_x || !has_y) return std::nullopt;
  take("heading_rad", {"heading", "yaw", "theta", "th", "phi", "psi"}, "deg");
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

/// Tables without stamps hold no stream.
void drop_unstamped(std::vector<DraftStream>& streams, const DraftQuestion& question) {
  if (!question.is_csv) return;
  std::erase_if(streams, [&](const DraftStream& stream) {
    const auto table = std::ranges::find(question.summary.topics, stream.topic, &TopicSummary::topic);
    return table == question.summary.topics.end() || !stamps_of(*table);
  });
}

}  // namespace

std::vector<DraftStream> gyro_candidates(const DraftQuestion& question) {
  std::vector<DraftStream> found;
  for (const TopicSummary& topic : question.summary.topics) {
    if (topic.messages == 0) continue;
    if (std::optional<DraftStream> known = known_gyro(topic))
      found.push_back(std::move(*known));
    else if (!is_imu(topic))
      add_named_gyros(topic, found);
  }
  drop_unstamped(found, question);
  put_best_first(found, question, gyro_merit);
  return found;
}

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

std::vector<DraftStream> gyro_headings(const DraftQuestion& question) {
  std::vector<DraftStream> found;
  for (const TopicSummary& topic : question.summary.topics) {
    if (is_imu(topic)) {
      if (has_orientation(topic)) found.push_back(orientation_stream(topic));
      continue;
    }
    for (const FieldSummary& field : topic.fields) {
      const std::vector<std::string> words = words_of(topic, field);
      const bool is_heading =
          has_word(words, {"gyro", "yaw", "heading", "pigeon", "navx"}) &&
          !has_word(words, {"x", "y", "roll", "pitch", "offset", "connected", "type", "name"});
      if (field.is_text || field.changes <= kFewestChanges || !is_heading || is_wanted_only(words) ||
          is_yaw_rate(words))
        continue;
      DraftStream stream = stream_of("gyro", topic, kOfAngles);
      stream.columns.push_back(
          {.column = "yaw_rad", .field = field.path, .unit = unit_of_angle(field, words)});
      found.push_back(std::move(stream));
    }
  }
  drop_unstamped(found, question);
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
