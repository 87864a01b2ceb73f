#include <algorithm>
#include <cmath>
#include <limits>

#include <nlohmann/json.hpp>

#include "trundle/report/calibration_parts.hpp"
#include "trundle/report/or_null.hpp"
#include "trundle/report/scatter.hpp"

namespace trundle::report {
namespace {

using Json = nlohmann::ordered_json;

/// Below this weight a run counts as an outlier by name.
constexpr double kOutlierWeight = 0.5;
constexpr double kPictureGrain = 1e5;         // per metre: 10 µm are below a pixel of any picture
constexpr std::size_t kPosesInPicture = 500;  // of a run in a small picture: about one for each pixel across

Json json_of(const std::optional<TrajectoryError>& error) {
  if (!error) return nullptr;
  return {{"position_rms_m", error->position_rms_m},
          {"position_max_m", error->position_max_m},
          {"heading_rms_rad", error->heading_rms_rad},
          {"end_x_m", error->end_x_m},
          {"end_y_m", error->end_y_m},
          {"end_heading_rad", error->end_heading_rad},
          {"path_m", error->path_m}};
}

double rounded(double metres) {
  return std::round(metres * kPictureGrain) / kPictureGrain;
}

/// Every n-th pose, and the last one.
Trajectory for_picture(const Trajectory& trajectory) {
  const auto& poses = trajectory.poses;
  const std::size_t stride = 1 + (poses.size() - 1) / kPosesInPicture;
  if (poses.empty() || stride == 1) return trajectory;
  Trajectory thinned;
  for (std::size_t i = 0; i + 1 < poses.size(); i += stride) thinned.poses.push_back(poses[i]);
  thinned.poses.push_back(poses.back());
  return thinned;
}

Json json_of(const Trajectory& trajectory) {
  Json time = Json::array(), x = Json::array(), y = Json::array();
  for (const StampedPose& stamped : trajectory.poses) {
    time.push_back(stamped.time_s);
    x.push_back(rounded(stamped.pose.x));
    y.push_back(rounded(stamped.pose.y));
  }
  return {{"time_s", std::move(time)}, {"x_m", std::move(x)}, {"y_m", std::move(y)}};
}

Json trajectories_json(const RunResult& run) {
  if (run.nominal.poses.empty() && run.calibrated.poses.empty() && run.reference.poses.empty())
    return nullptr;
  return {{"nominal", json_of(for_picture(run.nominal))},
          {"calibrated", json_of(for_picture(run.calibrated))},
          {"reference", json_of(for_picture(run.reference))}};
}

/// Distances [m] of a trajectory from the reference, at the reference's stamps; null where it has no pose.
Json distances_json(const Trajectory& trajectory, const Trajectory& reference) {
  constexpr double kAnyGap = std::numeric_limits<double>::infinity();
  Json distances = Json::array();
  for (const StampedPose& truth : reference.poses) {
    const std::optional<Pose2> pose = pose_at(trajectory, truth.time_s, kAnyGap);
    distances.push_back(pose ? Json(rounded((pose->translation() - truth.pose.translation()).norm()))
                             : Json(nullptr));
  }
  return distances;
}

Json deviation_json(const RunResult& run) {
  if (run.reference.poses.size() < 2 || run.nominal.poses.empty()) return nullptr;
  const Trajectory reference = for_picture(run.reference);
  Json path = Json::array();
  for (const double metres : path_lengths(reference)) path.push_back(rounded(metres));
  return {{"path_m", std::move(path)},
          {"nominal_m", distances_json(run.nominal, reference)},
          {"calibrated_m", distances_json(run.calibrated, reference)}};
}

/// Of columns that are equally long.
void thin(Json& columns, std::size_t rows) {
  if (!columns.is_object()) return;
  for (Json& column : columns) {
    if (!column.is_array() || column.size() <= rows) continue;
    const std::size_t stride = 1 + (column.size() - 1) / rows;
    Json thinned = Json::array();
    for (std::size_t i = 0; i + 1 < column.size(); i += stride) thinned.push_back(column[i]);
    thinned.push_back(column.back());
    column = std::move(thinned);
  }
}

Json json_of(const std::optional<TimeOffset>& offset) {
  if (!offset) return nullptr;
  return {{"time_offset_s", offset->offset_s}, {"sigma_s", offset->sigma_s}};
}

Json json_of(const std::optional<GyroBias>& bias) {
  if (!bias) return nullptr;
  return {{"rad_s", bias->rad_s}, {"sigma_rad_s", std::sqrt(bias->variance)}};
}

Json run_json(const RunResult& run) {
  return {{"name", run.name},
          {"session", run.session},
          {"hold_out", run.hold_out},
          {"turn", run.turn},
          {"weight", run.weight},
          {"outlier", run.weight < kOutlierWeight},
          {"chi2_per_dof", run.hold_out ? Json(nullptr) : Json(run.chi2_per_dof)},
          {"reference_clock", json_of(run.reference_clock)},
          {"gyro_bias", json_of(run.gyro_bias)},
          {"remark", run.remark},
          {"before", json_of(run.before)},
          {"after", json_of(run.after)},
          {"nees", or_null(run.nees)},
          {"nees_white_only", or_null(run.nees_white_only)},
          {"trajectories", trajectories_json(run)},
          {"deviation", deviation_json(run)}};
}

/// Over runs: root mean square of the rms values, the largest of the worst ones.
class PooledErrors {
 public:
  void add(const TrajectoryError& error) {
    position_squares_ += error.position_rms_m * error.position_rms_m;
    heading_squares_ += error.heading_rms_rad * error.heading_rms_rad;
    worst_ = std::max(worst_, error.position_max_m);
    ++count_;
  }
  Json json() const {
    if (count_ == 0) return nullptr;
    return {{"position_rms_m", std::sqrt(position_squares_ / count_)},
            {"position_max_m", worst_},
            {"heading_rms_rad", std::sqrt(heading_squares_ / count_)}};
  }

 private:
  double position_squares_ = 0.0;
  double heading_squares_ = 0.0;
  double worst_ = 0.0;
  int count_ = 0;
};

/// Mean over the runs that have the value.
Json mean_of(std::span<const RunResult> runs, bool hold_out, std::optional<double> RunResult::*member) {
  double sum = 0.0;
  int count = 0;
  for (const RunResult& run : runs) {
    if (run.hold_out != hold_out || !(run.*member)) continue;
    sum += *(run.*member);
    ++count;
  }
  return count == 0 ? Json(nullptr) : Json(sum / count);
}

/// Before and after are pooled over the same runs: those that have both, or, where none has, 'before' alone.
Json group_errors_json(std::span<const RunResult> runs, bool hold_out) {
  const bool any_after =
      std::ranges::any_of(runs, [&](const RunResult& run) { return run.hold_out == hold_out && run.after; });
  PooledErrors before;
  PooledErrors after;
  int count = 0;
  for (const RunResult& run : runs) {
    if (run.hold_out != hold_out || !run.before || (any_after && !run.after)) continue;
    before.add(*run.before);
    if (run.after) after.add(*run.after);
    ++count;
  }
  if (count == 0) return nullptr;
  return {{"runs", count},
          {"before", before.json()},
          {"after", after.json()},
          {"nees", mean_of(runs, hold_out, &RunResult::nees)},
          {"nees_white_only", mean_of(runs, hold_out, &RunResult::nees_white_only)}};
}

Json scatter_ellipse_json(const std::optional<Ellipse>& ellipse) {
  if (!ellipse) return nullptr;
  return {{"semi_major_m", ellipse->semi_major_m},
          {"semi_minor_m", ellipse->semi_minor_m},
          {"angle_rad", ellipse->angle_rad}};
}

/// The end points of some of the runs, and what scatter_of says of them.
Json scatter_json(std::span<const RunResult> runs, std::span<const std::size_t> members,
                  std::optional<TrajectoryError> RunResult::*error) {
  std::vector<Vector2> points;
  Json run = Json::array(), x = Json::array(), y = Json::array();
  for (const std::size_t index : members) {
    const std::optional<TrajectoryError>& found = runs[index].*error;
    if (!found) continue;
    points.emplace_back(found->end_x_m, found->end_y_m);
    run.push_back(index);
    x.push_back(points.back().x());
    y.push_back(points.back().y());
  }
  if (points.empty()) return nullptr;
  const Scatter scatter = scatter_of(points);
  return {{"run", std::move(run)},
          {"x_m", std::move(x)},
          {"y_m", std::move(y)},
          {"centroid_x_m", scatter.centroid.x()},
          {"centroid_y_m", scatter.centroid.y()},
          {"centroid_distance_m", scatter.centroid.norm()},
          {"ellipse95", scatter_ellipse_json(scatter.ellipse95)}};
}

Json turn_group_json(std::span<const RunResult> runs, bool hold_out, const char* turn) {
  std::vector<std::size_t> members;
  for (std::size_t i = 0; i < runs.size(); ++i)
    if (runs[i].hold_out == hold_out && runs[i].turn == turn) members.push_back(i);
  Json before = scatter_json(runs, members, &RunResult::before);
  if (before.is_null()) return nullptr;
  return {{"turn", turn},
          {"hold_out", hold_out},
          {"before", std::move(before)},
          {"after", scatter_json(runs, members, &RunResult::after)}};
}

}  // namespace

Json runs_json(std::span<const RunResult> runs) {
  Json array = Json::array();
  for (const RunResult& run : runs) array.push_back(run_json(run));
  return array;
}

Json with_thinned_runs(Json document, std::size_t rows) {
  if (const auto runs = document.find("runs"); runs != document.end())
    for (Json& run : *runs) {
      if (run.contains("deviation")) thin(run["deviation"], rows);
      if (!run.contains("trajectories") || !run["trajectories"].is_object()) continue;
      for (Json& trajectory : run["trajectories"]) thin(trajectory, rows);
    }
  return document;
}

Json errors_json(std::span<const RunResult> runs) {
  return {{"training", group_errors_json(runs, false)}, {"hold_out", group_errors_json(runs, true)}};
}

Json end_points_json(std::span<const RunResult> runs) {
  Json groups = Json::array();
  for (const bool hold_out : {false, true})
    for (const char* turn : {"cw", "ccw"})
      if (Json group = turn_group_json(runs, hold_out, turn); !group.is_null())
        groups.push_back(std::move(group));
  return groups;
}

}  // namespace trundle::report
