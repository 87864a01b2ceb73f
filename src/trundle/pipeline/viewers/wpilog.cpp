#include <algorithm>
#include <map>

#include <nlohmann/json.hpp>

#include "trundle/geometry/thinning.hpp"
#include "trundle/logs/wpilog_writer.hpp"
#include "trundle/pipeline/viewers/writers.hpp"
#include "trundle/report/json_text.hpp"
#include "trundle/slip/find_slip.hpp"

namespace trundle::pipeline {
namespace {

std::int64_t microseconds_of(double time_s, const Shown& shown) {
  constexpr std::int64_t kNsOfMicrosecond = 1000;  // WPILOG counts microseconds
  return (nanoseconds_of(time_s, shown) + kNsOfMicrosecond / 2) / kNsOfMicrosecond;
}

/// A structure of WPILib as its own serialization has it: numbers without padding.
std::string packed(std::initializer_list<double> numbers) {
  ByteWriter bytes;
  for (const double number : numbers) bytes.put(number);
  return std::string(bytes.bytes());
}

std::string packed_pose(const Pose2& pose) {
  return packed({pose.x, pose.y, pose.heading});
}

/// The schemas of the structures that are written, as WPILib writes them itself.
void add_schemas(WpilogWriter& file, std::int64_t time_us) {
  const auto add = [&](std::string_view name, std::string_view schema) {
    file.add(file.start("/.schema/struct:" + std::string(name), "structschema", time_us), time_us, schema);
  };
  add("Rotation2d", "double value");
  add("Translation2d", "double x;double y");
  add("Pose2d", "Translation2d translation;Rotation2d rotation");
}

/// Slashes make folders of entries.
std::string without_slashes(std::string text) {
  std::ranges::replace(text, '/', '_');
  return text;
}

/// "/Trundle/slam online/Pose"
std::string entry_name(const std::string& of, std::string_view what) {
  return "/Trundle/" + without_slashes(of) + "/" + std::string(what);
}

/// Writes one trajectory's values as its poses come.
class WpilogTrajectory {
 public:
  /// From its first pose on.
  WpilogTrajectory(WpilogWriter& file, const ShownTrajectory& trajectory, std::int64_t first_us)
      : file_(file),
        has_covariance_(trajectory.has_covariance),
        first_us_(first_us),
        pose_(file.start(entry_name(trajectory.name, "Pose"), "struct:Pose2d", first_us)),
        path_(file.start(entry_name(trajectory.name, "Path"), "struct:Pose2d[]", first_us)),
        kept_(kMostPathPoses, false) {
    if (!has_covariance_) return;
    sigma_ = file.start(entry_name(trajectory.name, "Sigma"), "double[]", first_us);
    covariance_ = file.start(entry_name(trajectory.name, "Covariance"), "double[]", first_us);
  }

  void add(std::int64_t time_us, const StampedPose& pose, const Matrix3& covariance) {
    file_.add(pose_, time_us, packed_pose(pose.pose));
    kept_.add(pose, covariance);
    if (!has_covariance_) return;
    const Vector3 sigma = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
    file_.add(sigma_, time_us, packed({sigma.x(), sigma.y(), sigma.z()}));
    file_.add(covariance_, time_us,
              packed({covariance(0, 0), covariance(0, 1), covariance(0, 2), covariance(1, 1),
                      covariance(1, 2), covariance(2, 2)}));
  }

  /// The whole path is there from its first pose on.
  void finish() {
    std::string path;
    for (const StampedPose& pose : kept_.take().poses) path += packed_pose(pose.pose);
    file_.add(path_, first_us_, path);
  }

 private:
  WpilogWriter& file_;
  bool has_covariance_;
  std::int64_t first_us_;
  std::uint32_t pose_ = 0, path_ = 0, sigma_ = 0, covariance_ = 0;
  ThinnedTrajectory kept_;
};

void add_landmark_values(WpilogWriter& file, const Shown& shown, std::int64_t first_us) {
  if (shown.landmarks.empty()) return;
  std::string positions, covariances;
  ByteWriter names;
  names.put(static_cast<std::uint32_t>(shown.landmarks.size()));
  for (const LandmarkRow& landmark : shown.landmarks) {
    positions += packed({landmark.position.x(), landmark.position.y()});
    const Matrix2 covariance = landmark.covariance.value_or(Matrix2::Zero());
    covariances += packed({covariance(0, 0), covariance(0, 1), covariance(1, 1)});
    names.text(landmark.name);
  }
  const auto add = [&](std::string_view what, std::string_view type, std::string_view value) {
    file.add(file.start(entry_name("Landmarks", what), type, first_us), first_us, value);
  };
  add("Positions", "struct:Translation2d[]", positions);
  add("Covariances", "double[]", covariances);
  add("Names", "string[]", names.bytes());
}

/// The entries of one wheel.
struct SlipEntries {
  std::uint32_t kind = 0;
  std::uint32_t excess = 0;
  std::uint32_t confidence = 0;
};

void add_slip_values(WpilogWriter& file, const Shown& shown, std::int64_t first_us) {
  std::map<std::string, SlipEntries> wheels;
  const auto write = [&](const SlipEntries& entries, std::int64_t time_us, std::string_view kind,
                         double excess_m, double confidence) {
    file.add(entries.kind, time_us, kind);
    file.add(entries.excess, time_us, packed({excess_m}));
    file.add(entries.confidence, time_us, packed({confidence}));
  };
  for (const auto& [event, wheel] : shown.slips) {
    auto [entries, is_new] = wheels.try_emplace(wheel);
    const auto start = [&, name = without_slashes(wheel)](std::string_view what, std::string_view type) {
      return file.start(entry_name("Slip", name + std::string(what)), type, first_us);
    };
    if (is_new) {
      entries->second = {start("/Kind", "string"), start("/ExcessMeters", "double"),
                         start("/Confidence", "double")};
      write(entries->second, first_us, "none", 0.0, 0.0);
    }
    write(entries->second, microseconds_of(event.start_s, shown), name_of(event.kind), event.excess_m,
          event.confidence);
    write(entries->second, microseconds_of(event.end_s, shown), "none", 0.0, 0.0);
  }
}

}  // namespace

void write_wpilog(const Shown& shown, const TakeText& take) {
  WpilogWriter file(take, dumped(to_json(shown.provenance)));
  std::optional<std::int64_t> first_us;
  for (const ShownTrajectory& trajectory : shown.trajectories) {
    std::optional<WpilogTrajectory> values;
    trajectory.produce([&](const StampedPose& pose, const Matrix3& covariance) {
      const std::int64_t time_us = microseconds_of(pose.time_s, shown);
      if (!first_us) add_schemas(file, time_us);
      first_us = std::min(first_us.value_or(time_us), time_us);
      if (!values) values.emplace(file, trajectory, time_us);
      values->add(time_us, pose, covariance);
    });
    if (values) values->finish();
  }
  add_landmark_values(file, shown, first_us.value_or(0));
  add_slip_values(file, shown, first_us.value_or(0));
  file.finish();
}

}  // namespace trundle::pipeline
