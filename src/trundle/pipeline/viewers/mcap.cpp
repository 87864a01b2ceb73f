#include <algorithm>
#include <optional>

#include <nlohmann/json.hpp>

#include "trundle/geometry/thinning.hpp"
#include "trundle/logs/mcap_writer.hpp"
#include "trundle/pipeline/viewers/ros_messages.hpp"
#include "trundle/pipeline/viewers/writers.hpp"
#include "trundle/report/json_text.hpp"

namespace trundle::pipeline {
namespace {

constexpr std::string_view kMapFrame = "map";

/// ROS has letters, digits and underscores in names.
std::string ros_name(std::string_view text) {
  std::string name;
  for (const char c : text) {
    const bool is_word = (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9');
    name += is_word ? c : '_';
  }
  return name;
}

/// Writes one trajectory's messages as its poses come.
class RosTrajectory {
 public:
  RosTrajectory(McapWriter& file, std::uint16_t transforms, const ShownTrajectory& trajectory,
                const Shown& shown)
      : file_(file),
        shown_(shown),
        has_covariance_(trajectory.has_covariance),
        name_(ros_name(trajectory.name)),
        child_(name_ + "/base_link"),
        transforms_(transforms),
        odometry_(file.add_channel("/trundle/" + name_, "nav_msgs/msg/Odometry")),
        path_(file.add_channel("/trundle/" + name_ + "/path", "nav_msgs/msg/Path")),
        kept_(kMostPathPoses, has_covariance_) {}

  void add(std::int64_t time_ns, const StampedPose& pose, const Matrix3& covariance) {
    const RosStamp stamp{time_ns, kMapFrame};
    Twist2 motion;
    double duration_s = 0.0;
    if (last_) {
      motion = log(last_->pose.inverse() * pose.pose);
      duration_s = pose.time_s - last_->time_s;
    }
    last_ = pose;
    message_.clear();
    put_odometry(message_, stamp, child_, pose.pose, covariance, motion, duration_s);
    file_.add(odometry_, stamp.time_ns, message_.bytes());
    message_.clear();
    put_transform(message_, stamp, child_, pose.pose);
    file_.add(transforms_, stamp.time_ns, message_.bytes());
    kept_.add(pose, covariance);
  }

  /// What is of the whole is there from the first pose on.
  void finish() {
    const Trajectory whole = kept_.take();
    if (whole.poses.empty()) return;
    std::vector<std::int64_t> times_ns;
    for (const StampedPose& pose : whole.poses) times_ns.push_back(nanoseconds_of(pose.time_s, shown_));
    const RosStamp stamp{times_ns.front(), kMapFrame};
    message_.clear();
    put_path(message_, stamp, whole.poses, times_ns);
    file_.add(path_, stamp.time_ns, message_.bytes());
    if (has_covariance_) add_ellipses(whole, stamp);
  }

 private:
  void add_ellipses(const Trajectory& whole, const RosStamp& stamp) {
    std::vector<RosEllipse> ellipses;
    const std::size_t stride = (whole.poses.size() + kMostEllipses - 1) / kMostEllipses;
    for (std::size_t i = 0; i < whole.poses.size(); i += stride)
      ellipses.push_back({.centre = whole.poses[i].pose.translation(),
                          .covariance = whole.covariances[i].topLeftCorner<2, 2>()});
    const std::uint16_t channel =
        file_.add_channel("/trundle/" + name_ + "/ellipses", "visualization_msgs/msg/MarkerArray");
    message_.clear();
    put_ellipses(message_, stamp, name_, ellipses);
    file_.add(channel, stamp.time_ns, message_.bytes());
  }

  McapWriter& file_;
  const Shown& shown_;
  bool has_covariance_;
  std::string name_;
  std::string child_;
  std::uint16_t transforms_, odometry_, path_;
  ThinnedTrajectory kept_;
  std::optional<StampedPose> last_;
  CdrWriter message_;
};

void add_landmark_markers(McapWriter& file, const Shown& shown, std::int64_t first_ns) {
  if (shown.landmarks.empty()) return;
  std::vector<RosEllipse> ellipses;
  for (const LandmarkRow& landmark : shown.landmarks)
    ellipses.push_back({.centre = landmark.position,
                        .covariance = landmark.covariance.value_or(Matrix2::Zero()),
                        .name = landmark.name});
  CdrWriter message;
  put_ellipses(message, {first_ns, kMapFrame}, "landmarks", ellipses);
  file.add(file.add_channel("/trundle/landmarks", "visualization_msgs/msg/MarkerArray"), first_ns,
           message.bytes());
}

/// A slip's start, or its end.
struct SlipChange {
  std::int64_t time_ns = 0;
  bool begins = false;
  const ShownSlip* slip = nullptr;
};

void add_slip_messages(McapWriter& file, const Shown& shown) {
  if (shown.slips.empty()) return;
  std::vector<SlipChange> changes;
  for (const ShownSlip& slip : shown.slips) {
    changes.push_back({nanoseconds_of(slip.event.start_s, shown), true, &slip});
    changes.push_back({nanoseconds_of(slip.event.end_s, shown), false, &slip});
  }
  std::ranges::stable_sort(changes, [](const SlipChange& a, const SlipChange& b) {
    return a.time_ns != b.time_ns ? a.time_ns < b.time_ns : a.begins < b.begins;  // one may follow another
  });
  const std::uint16_t channel = file.add_channel("/trundle/slips", "diagnostic_msgs/msg/DiagnosticArray");
  CdrWriter message;
  for (const SlipChange& change : changes) {
    message.clear();
    put_slip(message, {change.time_ns, kMapFrame}, *change.slip, change.begins);
    file.add(channel, change.time_ns, message.bytes());
  }
}

}  // namespace

void write_mcap(const Shown& shown, const TakeText& take) {
  McapWriter file(take, "trundle " + shown.provenance.version);
  file.add_metadata("trundle", {{"provenance", dumped(to_json(shown.provenance))}});
  const std::uint16_t transforms = file.add_channel("/tf", "tf2_msgs/msg/TFMessage");
  std::optional<std::int64_t> first_ns;
  for (const ShownTrajectory& trajectory : shown.trajectories) {
    RosTrajectory messages(file, transforms, trajectory, shown);
    trajectory.produce([&](const StampedPose& pose, const Matrix3& covariance) {
      const std::int64_t time_ns = nanoseconds_of(pose.time_s, shown);
      first_ns = std::min(first_ns.value_or(time_ns), time_ns);
      messages.add(time_ns, pose, covariance);
    });
    messages.finish();
  }
  add_landmark_markers(file, shown, first_ns.value_or(0));
  add_slip_messages(file, shown);
  file.finish();
}

}  // namespace trundle::pipeline
