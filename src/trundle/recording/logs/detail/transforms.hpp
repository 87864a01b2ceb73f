#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "trundle/logs/definitions.hpp"
#include "trundle/logs/field_reader.hpp"
#include "trundle/recording/csv/detail/table.hpp"

// Transforms between the frames of a robot, as tf publishes them: each of a child in its parent, so that
// frames are a tree. REP 105: map -> odom -> base_link.
namespace trundle::recording {

/// A child in its parent, at a time.
struct StampedTransform {
  std::string parent, child;
  std::int64_t stamp_ns = 0;
  std::int64_t log_time_ns = 0;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  bool is_static = false;  ///< of a topic of those that hold for ever
};

/// Reads those of a topic of transforms, and of the static ones beside it: "/tf" and "/tf_static".
class TransformReader {
 public:
  explicit TransformReader(std::string topic) : topic_(std::move(topic)) {}

  /// None of a message of another topic. Throws InputError with `file` where messages cannot be laid out.
  [[nodiscard]] std::vector<StampedTransform> read(const logs::Message& message, const std::string& file);

 private:
  struct Readers;
  const Readers* readers_of(const logs::Channel& channel, const std::string& file);

  std::string topic_;
  std::map<const logs::Channel*, std::shared_ptr<Readers>> readers_;
};

/// What a log is asked for: where `to` is in `from`.
struct FramePair {
  std::filesystem::path log;
  std::string topic;
  std::string from, to;
  std::string place;  ///< in recording.toml, for errors
};

/// The steps from one frame to the other through the tree. Throws InputError where no transforms connect
/// them, and names those that there are.
[[nodiscard]] std::vector<TransformStep> find_transforms(const FramePair& frames);

/// The vertical of a body in the axes of a sensor that is mounted on it, by static transforms. Throws
/// InputError where there are none.
[[nodiscard]] std::array<double, 3> vertical_in_sensor(const FramePair& body_and_sensor);

/// Where a sensor stands on its robot.
struct Mounting {
  std::string body_frame;  ///< REP 105: base_link, or else base_footprint
  Eigen::Isometry3d body_from_sensor = Eigen::Isometry3d::Identity();
};
/// Of the sensor whose frame the headers of a topic name, by a log's static transforms; nothing: they do not
/// say.
[[nodiscard]] std::optional<Mounting> mounting_of(const std::filesystem::path& log, const std::string& topic);

/// The frame_id in the header of the first message of a topic; empty: it has none.
[[nodiscard]] std::string frame_of_topic(const std::filesystem::path& log, const std::string& topic);

/// A chain of transforms as a stream of poses: a row at each stamp of the one that comes most often, the
/// others interpolated there between their neighbours, as tf does; no row where one of them has none on
/// either side.
class TransformStream {
 public:
  explicit TransformStream(const StreamSource& source);

  void take(const logs::Message& message);
  /// Nothing: no row is there yet.
  [[nodiscard]] std::optional<std::int64_t> first_stamp() const;
  [[nodiscard]] Table finish(std::vector<Finding>& findings);

 private:
  struct Sample {
    std::int64_t time_ns, log_time_ns;
    Eigen::Vector3d translation;
    Eigen::Quaterniond rotation;
  };
  struct Series {
    bool is_static = true;  ///< until one comes that is not
    std::vector<Sample> samples = {};
  };

  [[nodiscard]] std::optional<Eigen::Isometry3d> pose_at(std::int64_t time_ns) const;
  [[nodiscard]] static std::optional<Eigen::Isometry3d> interpolated(const Series& series,
                                                                     std::int64_t time_ns);

  const StreamSource& source_;
  TransformReader reader_;
  std::vector<Series> series_;  ///< of each step
};

}  // namespace trundle::recording
