#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <nlohmann/json.hpp>

#include "trundle/report/column.hpp"
#include "trundle/report/or_null.hpp"
#include "trundle/report/picture_rows.hpp"
#include "trundle/report/result_parts.hpp"
#include "trundle/report/scatter.hpp"
#include "trundle/statistics/distribution.hpp"

namespace trundle::report {
namespace {

using Json = nlohmann::ordered_json;
using Column = std::vector<double>;
using Rows = std::vector<std::size_t>;

/// Time marks along a track: at round times, not more than so many, nor more than one in so many rows.
constexpr double kMostMarks = 30.0;
constexpr std::size_t kRowsOfAMark = 16;  // marks nearer than that hide the track
constexpr std::array kRoundSeconds = {1.0,   2.0,   5.0,    10.0,   20.0,   30.0,  60.0,   120.0,  300.0,
                                      600.0, 900.0, 1800.0, 3600.0, 7200.0, 1.8e4, 8.64e4, 6.048e5};

template <typename Get>
Column column_of(std::size_t count, Get get) {
  Column column(count);
  for (std::size_t i = 0; i < count; ++i) column[i] = get(i);
  return column;
}

/// 95 % of positions lie so near to the track, measured across it.
double across95(const Pose2& pose, const Matrix3& covariance) {
  const Vector2 left(-std::sin(pose.heading), std::cos(pose.heading));
  return kNormalAt95 * std::sqrt(left.dot(covariance.topLeftCorner<2, 2>() * left));
}

double step_of_marks(double duration_s, std::size_t rows) {
  const double most = std::min(kMostMarks, static_cast<double>(rows / kRowsOfAMark));
  for (const double step : kRoundSeconds)
    if (duration_s <= step * most) return step;
  return duration_s / most;
}

Json mark_json(const Trajectory& trajectory, std::size_t i) {
  const auto& [time_s, pose] = trajectory.poses[i];
  Json mark = {{"time_s", time_s}, {"x_m", pose.x}, {"y_m", pose.y}, {"heading_rad", pose.heading}};
  mark["ellipse95"] = trajectory.has_covariance()
                          ? ellipse_json(trajectory.covariances[i].topLeftCorner<2, 2>())
                          : Json(nullptr);
  return mark;
}

/// At the poses nearest to round times since the start.
Json marks_json(const Trajectory& trajectory, std::size_t rows) {
  Json marks = Json::array();
  const auto& poses = trajectory.poses;
  if (poses.size() < 2) return marks;
  const double start = poses.front().time_s;
  const double step = step_of_marks(poses.back().time_s - start, rows);
  std::size_t i = 0;
  for (double time = start + step; time < poses.back().time_s; time += step) {
    while (poses[i].time_s < time) ++i;
    marks.push_back(mark_json(trajectory, i));
  }
  return marks;
}

Json track_json(const ResultTrack& track, std::size_t most) {
  const auto& poses = track.trajectory.poses;
  const std::size_t n = poses.size();
  const Column time = column_of(n, [&](std::size_t i) { return poses[i].time_s; });
  const Column x = column_of(n, [&](std::size_t i) { return poses[i].pose.x; });
  const Column y = column_of(n, [&](std::size_t i) { return poses[i].pose.y; });
  const Column heading = column_of(n, [&](std::size_t i) { return poses[i].pose.heading; });
  const std::array<std::span<const double>, 2> pictured = {x, y};
  const Rows rows = rows_for_picture(pictured, most);
  Json json = {{"name", track.name},
               {"role", name_of(track.role)},
               {"poses", n + track.left_out},
               {"drawn", rows.size()},
               {"time_s", column_json(time, rows)},
               {"x_m", column_json(x, rows)},
               {"y_m", column_json(y, rows)},
               {"heading_rad", column_json(heading, rows)},
               {"across95_m", nullptr},
               {"marks", marks_json(track.trajectory, most)}};
  if (track.trajectory.has_covariance()) {
    const Column across =
        column_of(n, [&](std::size_t i) { return across95(poses[i].pose, track.trajectory.covariances[i]); });
    json["across95_m"] = column_json(across, rows);
  }
  return json;
}

Json alignment_json(const Evaluation& e) {
  return {{"kind", name_of(e.alignment)},
          {"x_m", e.reference_from_estimate.x},
          {"y_m", e.reference_from_estimate.y},
          {"heading_rad", e.reference_from_estimate.heading}};
}

Json summary_json(const Evaluation& e) {
  Json summary = {{"compared", e.compared},
                  {"path_m", e.path_m},
                  {"position_rms_m", e.position_m.rms},
                  {"position_max_m", e.position_m.max},
                  {"heading_rms_rad", or_null(e.heading_rms_rad)},
                  {"final_m", e.final_position_m},
                  {"final_percent", or_null(e.final_percent)},
                  {"nees_mean", nullptr},
                  {"share_inside_95", nullptr},
                  {"before_motion", nullptr},
                  {"reference_noise", nullptr}};
  if (e.reference_noise.stated())
    summary["reference_noise"] = {{"position_sigma_m", e.reference_noise.position_sigma_m},
                                  {"heading_sigma_rad", e.reference_noise.heading_sigma_rad}};
  if (e.nees) {
    summary["before_motion"] = e.nees->before_motion;
    summary["nees_mean"] = e.nees->mean;
    summary["share_inside_95"] = e.nees->share_inside_95;
  }
  return summary;
}

Json bounds95(int degrees_of_freedom) {
  const double dof = degrees_of_freedom;
  return {chi_squared_limit(0.975, dof), chi_squared_limit(0.025, dof)};
}

Json error_json(const ResultTrack& track, std::size_t most) {
  const auto& at = track.errors.at;
  const std::size_t n = at.size();
  const auto of = [&](double ErrorAt::*member) {
    return column_of(n, [&](std::size_t i) { return at[i].*member; });
  };
  const Column position = of(&ErrorAt::position_m), heading = of(&ErrorAt::heading_rad),
               nees = of(&ErrorAt::nees);
  const std::array<std::span<const double>, 3> pictured = {position, heading, nees};
  const Rows rows = rows_for_picture(pictured, most);
  return {{"name", track.name},
          {"role", name_of(track.role)},
          {"alignment", alignment_json(*track.evaluation)},
          {"summary", summary_json(*track.evaluation)},
          {"drawn", rows.size()},
          {"time_s", column_json(of(&ErrorAt::time_s), rows)},
          {"way_m", column_json(of(&ErrorAt::way_m), rows)},
          {"position_m", column_json(position, rows)},
          {"heading_rad", column_json(heading, rows)},
          {"bound95_m", track.evaluation->nees ? column_json(of(&ErrorAt::bound95_m), rows) : Json(nullptr)},
          {"heading95_rad",
           track.evaluation->nees ? column_json(of(&ErrorAt::heading95_rad), rows) : Json(nullptr)},
          {"nees", track.evaluation->nees ? column_json(nees, rows) : Json(nullptr)},
          {"nees_degrees_of_freedom", track.errors.degrees_of_freedom},
          {"nees_bounds95", bounds95(track.errors.degrees_of_freedom)}};
}

}  // namespace

Json ellipse_json(const Matrix2& covariance) {
  if (!covariance.allFinite()) return nullptr;
  const Ellipse ellipse = error_ellipse95(Vector2::Zero(), covariance);
  return {{"semi_major_m", ellipse.semi_major_m},
          {"semi_minor_m", ellipse.semi_minor_m},
          {"angle_rad", ellipse.angle_rad}};
}

Json tracks_json(const std::vector<ResultTrack>& tracks, std::size_t rows) {
  Json all = Json::array();
  for (const ResultTrack& track : tracks) all.push_back(track_json(track, rows));
  return all;
}

Json errors_json(const std::vector<ResultTrack>& tracks, std::size_t rows) {
  Json all = Json::array();
  for (const ResultTrack& track : tracks)
    if (track.evaluation) all.push_back(error_json(track, rows));
  return all;
}

}  // namespace trundle::report
