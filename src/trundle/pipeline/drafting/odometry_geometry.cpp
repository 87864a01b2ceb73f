#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "trundle/geometry/angle.hpp"
#include "trundle/logs/field_reader.hpp"
#include "trundle/pipeline/drafting/detail/names.hpp"
#include "trundle/pipeline/drafting/detail/sensors.hpp"
#include "trundle/pipeline/drafting/draft.hpp"

namespace trundle::pipeline {
namespace {

constexpr std::size_t kMostReadings = 1'000'000;  // of a stream: an hour at 100 Hz is a third of it
constexpr double kWindow_s = 1.0;                 // stamps that jitter by a hundredth of it leave 1 %
constexpr double kLeastTurn_rad = 6.0;            // a turn of a wheel: less is mostly jitter
constexpr double kLeastExplained = 0.99;  // of the squares: the odometry is of these wheels and nothing else

/// Angles of the left and of the right wheels, of each the mean [rad].
struct WheelAngles {
  double time_s, left_rad, right_rad;
};
struct OdometryPose {
  double time_s, x_m, y_m, yaw_rad;
};

/// Fields of one topic, read where it comes.
class TopicReader {
 public:
  TopicReader(std::string topic, std::vector<std::string> paths)
      : topic_(std::move(topic)), paths_(std::move(paths)) {}

  /// The time and the fields; nothing where one is missing, or the message is of another topic.
  std::optional<std::vector<double>> read(const logs::Message& message) {
    if (message.channel->topic != topic_) return std::nullopt;
    if (message.channel != channel_) compile(*message.channel);
    std::vector<double> values = {static_cast<double>(time_of(message)) * logs::kNanosecond_s};
    for (const logs::FieldReader& reader : readers_) {
      const std::optional<double> value = logs::number_of(reader.read(message));
      if (!value || !std::isfinite(*value)) return std::nullopt;
      values.push_back(*value);
    }
    return values;
  }

 private:
  void compile(const logs::Channel& channel) {
    channel_ = &channel;
    readers_.clear();
    stamp_.reset();
    layout_ = std::make_unique<logs::Layout>(logs::layout_of(channel));
    for (const std::string& path : paths_) readers_.emplace_back(*layout_, channel.encoding, path);
    stamp_.emplace(*layout_, channel.encoding, "header.stamp");
  }
  std::int64_t time_of(const logs::Message& message) const {
    const logs::Value stamp = stamp_->read(message);
    const auto* const time = std::get_if<std::int64_t>(&stamp);
    return time != nullptr && *time != 0 ? *time : message.log_time_ns;
  }

  std::string topic_;
  std::vector<std::string> paths_;
  const logs::Channel* channel_ = nullptr;
  std::unique_ptr<logs::Layout> layout_;
  std::vector<logs::FieldReader> readers_;
  std::optional<logs::FieldReader> stamp_;
};

/// A number that explains another by a factor.
struct Proportion {
  double xx = 0.0, xy = 0.0, yy = 0.0, way = 0.0;

  void add(double x, double y) {
    xx += x * x;
    xy += x * y;
    yy += y * y;
    way += std::abs(x);
  }
  /// Nothing: too little of it, or it explains too little.
  std::optional<double> factor() const {
    if (way < kLeastTurn_rad || yy <= 0.0 || xy * xy < kLeastExplained * xx * yy) return std::nullopt;
    return xy / xx;
  }
};

WheelAngles angles_at(const std::vector<WheelAngles>& wheels, double time_s) {
  const auto after = std::ranges::lower_bound(wheels, time_s, {}, &WheelAngles::time_s);
  if (after == wheels.begin()) return wheels.front();
  if (after == wheels.end()) return wheels.back();
  const WheelAngles &a = *std::prev(after), &b = *after;
  const double share = b.time_s > a.time_s ? (time_s - a.time_s) / (b.time_s - a.time_s) : 0.0;
  return {time_s, std::lerp(a.left_rad, b.left_rad, share), std::lerp(a.right_rad, b.right_rad, share)};
}

/// Radius and separation with which these poses follow from these angles: those of the controller.
std::optional<RobotGeometry> geometry_of(const std::vector<WheelAngles>& wheels,
                                         const std::vector<OdometryPose>& poses) {
  if (wheels.size() < 2 || poses.size() < 2) return std::nullopt;
  Proportion ahead, turning;
  WheelAngles start = angles_at(wheels, poses.front().time_s);
  double start_s = poses.front().time_s, way_m = 0.0, turn_rad = 0.0;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    const OdometryPose &a = poses[i - 1], &b = poses[i];
    const double step_rad = wrap_angle(b.yaw_rad - a.yaw_rad), middle = a.yaw_rad + 0.5 * step_rad;
    way_m += (b.x_m - a.x_m) * std::cos(middle) + (b.y_m - a.y_m) * std::sin(middle);
    turn_rad += step_rad;
    if (b.time_s - start_s < kWindow_s) continue;
    const WheelAngles end = angles_at(wheels, b.time_s);
    const double left = end.left_rad - start.left_rad, right = end.right_rad - start.right_rad;
    ahead.add(0.5 * (left + right), way_m);
    turning.add(right - left, turn_rad);
    start = end;
    start_s = b.time_s;
    way_m = turn_rad = 0.0;
  }
  const std::optional<double> radius_m = ahead.factor(), radius_per_separation = turning.factor();
  if (!radius_m || !(*radius_m > 0.0)) return std::nullopt;
  RobotGeometry geometry;
  geometry.wheel_radius_m = geometry.right_wheel_radius_m = *radius_m;
  if (radius_per_separation && *radius_per_separation != 0.0)
    geometry.wheel_separation_m = *radius_m / *radius_per_separation;
  return geometry;
}

}  // namespace

std::optional<RobotGeometry> geometry_from_odometry(const std::filesystem::path& path, const Draft& draft,
                                                    const std::string& odometry_topic) {
  const auto wheels = std::ranges::find(draft.streams, "wheels", &DraftStream::table);
  if (wheels == draft.streams.end() || wheels->topic.empty()) return std::nullopt;
  std::vector<std::string> paths;
  std::vector<int> sides;
  for (const DraftColumn& column : wheels->columns) {
    const std::optional<PlacedName> name = placed(words_of(column.column));
    if (!column.column.ends_with("_rad") || !column.unit.empty() || !name || name->place.side == 0)
      return std::nullopt;
    paths.push_back(column.field);
    sides.push_back(name->place.side);
  }
  TopicReader of_wheels(wheels->topic, paths);
  TopicReader of_poses(odometry_topic, {"pose.pose.position.x", "pose.pose.position.y",
                                        "pose.pose.orientation.z", "pose.pose.orientation.w"});
  std::vector<WheelAngles> angles;
  std::vector<OdometryPose> poses;
  const std::unique_ptr<logs::Log> log = logs::open_log(path);
  try {
    while (const std::optional<logs::Message> message = log->next()) {
      if (const auto values = of_wheels.read(*message); values && angles.size() < kMostReadings) {
        std::array<double, 2> sum{}, count{};
        for (std::size_t i = 0; i < sides.size(); ++i) {
          sum[sides[i] > 0 ? 0 : 1] += (*values)[i + 1];
          count[sides[i] > 0 ? 0 : 1] += 1.0;
        }
        if (count[0] > 0.0 && count[1] > 0.0)
          angles.push_back({(*values)[0], sum[0] / count[0], sum[1] / count[1]});
      }
      if (const auto values = of_poses.read(*message); values && poses.size() < kMostReadings)
        poses.push_back(
            {(*values)[0], (*values)[1], (*values)[2], 2.0 * std::atan2((*values)[3], (*values)[4])});
    }
  } catch (const logs::UnknownField&) {
    return std::nullopt;
  } catch (const logs::BadDefinition&) {
    return std::nullopt;
  }
  std::ranges::stable_sort(angles, {}, &WheelAngles::time_s);
  std::ranges::stable_sort(poses, {}, &OdometryPose::time_s);
  return geometry_of(angles, poses);
}

}  // namespace trundle::pipeline
