#include "trundle/pipeline/drafting/draft.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "trundle/geometry/angle.hpp"
#include "trundle/pipeline/drafting/detail/found_wheels.hpp"
#include "trundle/pipeline/drafting/detail/names.hpp"
#include "trundle/pipeline/drafting/detail/sensors.hpp"

namespace trundle::pipeline {
namespace {

constexpr std::size_t kMostAlternatives = 5;  ///< of one stream: a list of all would hide the likely ones

class Drafter {
 public:
  explicit Drafter(const DraftQuestion& question) : question_(question) {}

  Draft make() {
    take_name();
    take_wheels();
    take_gyro();
    take_reference();
    take_sightings();
    return std::move(draft_);
  }

 private:
  const RobotGeometry* urdf() const { return question_.urdf ? &*question_.urdf : nullptr; }
  const RobotGeometry* controller() const { return question_.controller ? &*question_.controller : nullptr; }

  void take_name() {
    draft_.robot_name = urdf() != nullptr && !urdf()->robot_name.empty() ? urdf()->robot_name : "robot";
  }

  /// With its file; its columns without the topic that they all share.
  DraftStream placed_stream(DraftStream stream) const {
    stream.file = question_.is_csv ? question_.file + stream.topic : question_.file;
    if (!question_.is_csv) return stream;
    const auto table = std::ranges::find(question_.summary.topics, stream.topic, &logs::TopicSummary::topic);
    if (table != question_.summary.topics.end())
      if (const std::optional<StampColumn> stamps = stamps_of(*table)) {
        stream.columns.insert(stream.columns.begin(), {.column = "time_s", .field = stamps->name});
        stream.time_unit = stamps->unit;
        stream.format = table->metadata;
      }
    stream.topic.clear();
    return stream;
  }

  DraftStream stream_of(const FoundWheels& found) const {
    DraftStream stream{.table = "wheels", .file = {}};
    for (const FoundWheel& wheel : found.wheels) {
      stream.columns.push_back(wheel.column);
      if (wheel.steering) stream.columns.push_back(*wheel.steering);
    }
    const std::string& topic = stream.columns.front().topic;
    if (std::ranges::all_of(stream.columns,
                            [&](const DraftColumn& column) { return column.topic == topic; })) {
      stream.topic = topic;
      for (DraftColumn& column : stream.columns) column.topic.clear();
    }
    if (stream.topic.empty() && question_.summary.is_written_on_change) stream.topic = row_topic(stream);
    return placed_stream(std::move(stream));
  }

  /// Whose messages make the rows of columns that are written apart and where they change: one that is
  /// written in every cycle of the robot, also at rest, and behind the columns, so that a row holds what its
  /// cycle wrote.
  std::string row_topic(const DraftStream& stream) const {
    constexpr double kFastest_hz = 300.0;  // of a robot's main loop
    std::int64_t written_ns = 0;
    std::uint64_t most = 0;
    const auto is_cyclic = [](const logs::TopicSummary& topic) {
      const double lasts_s = static_cast<double>(topic.end_ns - topic.start_ns) * logs::kNanosecond_s;
      return topic.unreadable.empty() && static_cast<double>(topic.messages) <= kFastest_hz * lasts_s;
    };
    for (const logs::TopicSummary& topic : question_.summary.topics) {
      if (std::ranges::find(stream.columns, topic.topic, &DraftColumn::topic) != stream.columns.end())
        written_ns = std::max(written_ns, topic.end_ns);
      if (is_cyclic(topic)) most = std::max(most, topic.messages);
    }
    const logs::TopicSummary* best = nullptr;
    for (const logs::TopicSummary& topic : question_.summary.topics) {
      if (!is_cyclic(topic) || topic.messages * 10 < most * 9) continue;
      const auto merit = [&](const logs::TopicSummary& candidate) {  // just behind, else as late as can be
        const bool is_behind = candidate.end_ns >= written_ns;
        return std::pair(is_behind, is_behind ? -candidate.end_ns : candidate.end_ns);
      };
      if (best == nullptr || merit(topic) > merit(*best)) best = &topic;
    }
    return best == nullptr ? std::string() : best->topic;
  }

  static bool has_stamps(const DraftStream& stream) {
    return std::ranges::count(stream.columns, "time_s", &DraftColumn::column) > 0;
  }

  void take_wheels() {
    std::vector<WheelGroup> groups = wheel_groups(question_.summary);
    if (question_.is_csv)  // columns of one table share their stamps
      std::erase_if(groups, [](const WheelGroup& group) {
        return std::ranges::any_of(group.wheels, [&](const WheelSource& wheel) {
          return wheel.topic != group.wheels.front().topic;
        });
      });
    std::optional<FoundWheels> found = known_wheels(question_.summary);
    const bool is_known = found.has_value();
    if (!found && !groups.empty() && groups.front().is_of_wheels)
      found = wheels_of(groups.front(), steering_of(question_.summary, groups.front()));
    for (std::size_t i = found && !is_known ? 1 : 0; i < groups.size() && !is_known; ++i) {
      if (alternatives_of("wheels") == kMostAlternatives) break;
      add_alternative(stream_of(wheels_of(groups[i], {})), "look like the same of several wheels");
    }
    if (!found) return take_odometry();
    if (!found->moves) draft_.notes.push_back("wheels: none of them moves in this log");
    draft_.streams.push_back(stream_of(*found));
    draft_.streams.back().reason = "by the names of the wheels";
    if (question_.is_csv && !has_stamps(draft_.streams.back()))
      draft_.to_fill_in.push_back(
          "recording.toml: [wheels]: no column of its table rises as stamps do: columns.time_s, or rate_hz "
          "where "
          "its rows are evenly apart");
    for (const FoundWheel& wheel : found->wheels) draft_.wheels.push_back(drafted(wheel, *found));
    if (is_known) take_ardupilot();
    name_missing();
    for (const DraftStream& odometry : velocity_candidates(question_))
      if (alternatives_of("velocity") < kMostAlternatives)
        add_alternative(placed_stream(odometry), odometry.reason);
  }

  /// No wheels, but what the robot made of them.
  void take_odometry() {
    const std::vector<DraftStream> candidates = velocity_candidates(question_);
    if (candidates.empty()) {
      draft_.to_fill_in.push_back(
          "recording.toml: [wheels]: nothing in the log looks like wheels or their odometry");
      return;
    }
    DraftStream chosen = candidates.front();
    if (controller() != nullptr && controller()->wheel_separation_m) {
      chosen.table = "wheels";
      chosen.rebuilt_separation_m = controller()->wheel_separation_m;
      chosen.reason = "wheels rebuilt from odometry with the controller's wheel separation";
      for (const int side : {1, -1}) {
        const WheelPlace place{.side = side};
        DraftWheel wheel{.name = wheel_name(place)};
        take_geometry({}, place, 2, wheel);
        wheel.recorded_diameter_m = wheel.diameter_m;
        draft_.wheels.push_back(std::move(wheel));
      }
      name_missing();
    } else {
      draft_.notes.push_back(
          "velocity: the log has odometry and no wheels: without --controller FILE (its wheel_separation) "
          "they "
          "cannot be rebuilt from it, and nothing of them is calibrated");
    }
    draft_.streams.push_back(placed_stream(std::move(chosen)));
    for (std::size_t i = 1; i < std::min(candidates.size(), kMostAlternatives); ++i)
      add_alternative(placed_stream(candidates[i]), candidates[i].reason);
  }

  DraftWheel drafted(const FoundWheel& found, const FoundWheels& all) const {
    DraftWheel wheel{.name = found.name};
    wheel.is_steered = found.steering.has_value();
    wheel.needs_ticks = all.quantity == WheelQuantity::ticks;
    const std::vector<std::string> words = words_of(found.column.topic + "/" + found.column.field);
    const bool is_mecanum =
        (controller() != nullptr && controller()->is_mecanum) || has_word(words, {"mecanum"});
    if (is_mecanum)
      wheel.kind = chassis::WheelKind::mecanum;
    else if (all.wheels.size() >= 4 && !wheel.is_steered)
      wheel.kind = chassis::WheelKind::skid;
    take_geometry(found.joint, found.place, all.wheels.size(), wheel);
    return wheel;
  }

  /// A URDF knows the wheel by its joint; a controller by its side.
  void take_geometry(const std::string& joint, const WheelPlace& place, std::size_t count,
                     DraftWheel& wheel) const {
    if (urdf() != nullptr)
      for (const WheelGeometry& known : urdf()->wheels) {
        const std::optional<PlacedName> name = placed(words_of(known.joint));
        const bool is_it = joint.empty() ? name && name->place == place : known.joint == joint;
        if (!is_it) continue;
        wheel.x_m = known.x_m;
        wheel.y_m = known.y_m;
        if (known.radius_m) wheel.diameter_m = 2.0 * *known.radius_m;
      }
    if (controller() == nullptr || place.side == 0) return;
    if (!controller()->wheel_separation_m && wheel.y_m)
      *wheel.y_m *= controller()->separation_multiplier.value_or(1.0);
    if (controller()->wheel_separation_m) wheel.y_m = place.side * *controller()->wheel_separation_m / 2.0;
    if (!wheel.x_m && count == 2) wheel.x_m = 0.0;
    const std::optional<double>& radius_m =
        place.side < 0 ? controller()->right_wheel_radius_m : controller()->wheel_radius_m;
    if (radius_m) wheel.diameter_m = 2.0 * *radius_m;
  }

  /// WENC: where the wheels are and how large, in the autopilot's frame: forward, right.
  void take_ardupilot() {
    for (std::size_t i = 0; i < draft_.wheels.size(); ++i) {
      const std::string prefix = i == 0 ? "WENC_" : "WENC2_";
      const auto parameter = [&](const char* name) -> std::optional<double> {
        const auto found = question_.parameters.find(prefix + name);
        return found == question_.parameters.end() ? std::nullopt : std::optional(found->second);
      };
      DraftWheel& wheel = draft_.wheels[i];
      if (const auto radius_m = parameter("RADIUS"); radius_m && *radius_m > 0.0)
        wheel.diameter_m = wheel.recorded_diameter_m = 2.0 * *radius_m;
      if (const auto x_m = parameter("POS_X")) wheel.x_m = *x_m;
      if (const auto y_m = parameter("POS_Y"); y_m && *y_m != 0.0) wheel.y_m = -*y_m;
      if (const auto counts = parameter("CPR"); counts && *counts > 0.0)
        draft_.sources.push_back(
            fmt::format("{}CPR = {:g}: counts of a turn; the log has metres", prefix, *counts));
    }
  }

  /// What a person has to measure.
  void name_missing() {
    const auto names = [&](auto lacks) {
      std::vector<std::string> found;
      for (const DraftWheel& wheel : draft_.wheels)
        if (lacks(wheel)) found.push_back(wheel.name);
      return found;
    };
    const auto add = [&](const std::vector<std::string>& wheels, std::string_view what) {
      if (!wheels.empty())
        draft_.to_fill_in.push_back(fmt::format("robot.toml: {} of {}", what, fmt::join(wheels, ", ")));
    };
    add(names([](const DraftWheel& wheel) { return !wheel.diameter_m; }), "diameter_m");
    const auto is_numbered = [](const DraftWheel& wheel) { return wheel.name.starts_with("wheel_"); };
    add(names([&](const DraftWheel& wheel) { return !wheel.y_m && !is_numbered(wheel); }),
        "y_m (left of the middle is positive)");
    if (draft_.wheels.size() > 2)
      add(names([&](const DraftWheel& wheel) { return !wheel.x_m && !is_numbered(wheel); }),
          "x_m (ahead of the middle is positive)");
    add(names([&](const DraftWheel& wheel) { return is_numbered(wheel) && !(wheel.x_m && wheel.y_m); }),
        draft_.wheels.size() == 4
            ? "x_m and y_m (the log numbers the wheels; WPILib's order is front left, front right, rear "
              "left, rear right)"
            : "x_m, y_m and direction_deg (the log numbers the wheels: which is where, it does not say)");
    add(names([](const DraftWheel& wheel) { return wheel.needs_ticks; }),
        "ticks_per_revolution (negative: counts backwards)");
    add(names([](const DraftWheel& wheel) { return wheel.kind == chassis::WheelKind::mecanum; }),
        "roller_deg");
  }

  void take_gyro() {
    std::vector<DraftStream> candidates = gyro_candidates(question_);
    if (candidates.empty()) {
      candidates = gyro_headings(question_);
      if (candidates.empty()) return;
      draft_.notes.push_back(
          "gyro: no yaw rate is recorded: the differences of its angle are taken; a rate would be better");
    }
    draft_.has_gyro = true;
    draft_.streams.push_back(mounted(placed_stream(candidates.front())));
    add_alternatives(candidates);
  }

  /// A gyro whose place on the robot the log says needs no gravity to tell its axis.
  DraftStream mounted(DraftStream stream) const {
    if (!question_.mounting_of || !stream.columns.empty()) return stream;
    const auto mounting = question_.mounting_of(stream.topic);
    if (!mounting) return stream;
    stream.body_frame = mounting->body_frame;
    stream.reason = "a sensor_msgs/Imu; its mounting is that of the static transforms";
    return stream;
  }

  void take_sightings() {
    const std::vector<DraftStream> candidates = sighting_candidates(question_);
    if (candidates.empty()) return;
    draft_.streams.push_back(placed_stream(candidates.front()));
    add_alternatives(candidates);
    draft_.has_landmark_sensor = true;
    const auto mounting =
        question_.mounting_of ? question_.mounting_of(candidates.front().topic) : std::nullopt;
    if (!mounting) {
      draft_.to_fill_in.push_back(
          "robot.toml: [landmark_sensor]: x_m, y_m and heading_deg: where the camera stands");
      return;
    }
    const Eigen::Vector3d at = mounting->body_from_sensor.translation(),
                          ahead = mounting->body_from_sensor.linear() * Eigen::Vector3d::UnitZ();
    draft_.landmark_sensor = DraftMount{at.x(), at.y(), degrees(std::atan2(ahead.y(), ahead.x()))};
    draft_.sources.push_back("[landmark_sensor]: by the log's transform from " + mounting->body_frame);
  }

  void take_reference() {
    const std::vector<DraftStream> candidates = reference_candidates(question_);
    if (candidates.empty()) {
      draft_.notes.push_back(
          "reference: nothing in the log says where the robot was: a [reference] with closed = true, "
          "distance_m "
          "or turns (docs/recording.md) is enough for a calibration");
      return;
    }
    draft_.streams.push_back(placed_stream(candidates.front()));
    add_alternatives(candidates);
  }

  void add_alternatives(const std::vector<DraftStream>& candidates) {
    for (std::size_t i = 1; i < std::min(candidates.size(), kMostAlternatives + 1); ++i)
      add_alternative(placed_stream(candidates[i]), candidates[i].reason);
  }
  void add_alternative(DraftStream stream, std::string reason) {
    stream.reason = std::move(reason);
    draft_.alternatives.push_back(std::move(stream));
  }
  std::size_t alternatives_of(std::string_view table) const {
    return static_cast<std::size_t>(std::ranges::count(draft_.alternatives, table, &DraftStream::table));
  }

  const DraftQuestion& question_;
  Draft draft_;
};

}  // namespace

Draft draft_of(const DraftQuestion& question) {
  return Drafter(question).make();
}

}  // namespace trundle::pipeline
