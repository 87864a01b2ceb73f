// The candidates for a gyro: rates by type or by name, and angles where there is no rate.
#include <algorithm>
#include <array>
#include <cmath>

#include "trundle/chassis/chassis.hpp"
#include "trundle/pipeline/drafting/detail/candidates.hpp"
#include "trundle/pipeline/drafting/detail/sensors.hpp"

namespace trundle::pipeline {
namespace {

using logs::FieldSummary;
using logs::TopicSummary;

/// A field of a type that a format itself defines. Bodies of aircraft look forward, right and down.
struct KnownSensor {
  std::string_view type;
  std::string_view field;
  double scale;
};
constexpr std::array kKnownGyros = {
    KnownSensor{"IMU", "GyrZ", -1.0}, KnownSensor{"vehicle_angular_velocity", "xyz[2]", -1.0},
    KnownSensor{"sensor_combined", "gyro_rad[2]", -1.0}, KnownSensor{"sensor_gyro", "z", -1.0}};

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
double gyro_merit(const DraftStream& stream, const TopicSummary& topic) {
  const std::string path = stream.columns.empty() ? "angular_velocity.z" : stream.columns.front().field;
  const FieldSummary* const field = field_of(topic, path);
  const bool moves = field != nullptr && field->changes > 10;
  return (moves ? 1e9 : 0.0) + static_cast<double>(topic.messages);
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

std::vector<DraftStream> gyro_headings(const DraftQuestion& question) {
  std::vector<DraftStream> found;
  const std::vector<DraftStream> references = reference_candidates(question);
  for (const TopicSummary& topic : question.summary.topics) {
    // The heading of a reference is no gyro's: odometry would follow what it is to be compared with.
    if (std::ranges::count(references, topic.topic, &DraftStream::topic) > 0) continue;
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

}  // namespace trundle::pipeline
