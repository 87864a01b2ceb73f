#include <array>
#include <span>

#include <nlohmann/json.hpp>

#include "trundle/report/column.hpp"
#include "trundle/report/picture_rows.hpp"
#include "trundle/report/result_parts.hpp"
#include "trundle/report/scatter.hpp"

namespace trundle::report {
namespace {

using Json = nlohmann::ordered_json;

Matrix2 turned(const Matrix2& covariance, const Pose2& by) {
  const Matrix2 R = rotation(by.heading);
  return R * covariance * R.transpose();
}

Json path_json(const std::vector<Vector2>& path, const Pose2& laid_by) {
  std::vector<double> x, y;
  for (const Vector2& place : path) {
    const Vector2 laid = laid_by * place;
    x.push_back(laid.x());
    y.push_back(laid.y());
  }
  return {{"x_m", column_json(x)}, {"y_m", column_json(y)}};
}

Json landmarks_json(const std::vector<LandmarkRow>& landmarks, const Pose2& laid_by) {
  std::vector<double> x, y, major, minor, angle;
  for (const LandmarkRow& landmark : landmarks) {
    const Vector2 laid = laid_by * landmark.position;
    const Ellipse ellipse =
        error_ellipse95(laid, turned(landmark.covariance.value_or(Matrix2::Zero()), laid_by));
    x.push_back(laid.x());
    y.push_back(laid.y());
    major.push_back(ellipse.semi_major_m);
    minor.push_back(ellipse.semi_minor_m);
    angle.push_back(ellipse.angle_rad);
  }
  return {{"x_m", column_json(x)},
          {"y_m", column_json(y)},
          {"semi_major_m", column_json(major)},
          {"semi_minor_m", column_json(minor)},
          {"angle_rad", column_json(angle)}};
}

}  // namespace

Json growth_json(const GrowthResult& growth, const Pose2& laid_by, std::size_t most) {
  Json snapshots = Json::array();
  for (const GrowthSnapshot& snapshot : growth.snapshots) {
    const Pose2 pose = laid_by * snapshot.pose;
    snapshots.push_back({{"time_s", snapshot.time_s},
                         {"x_m", pose.x},
                         {"y_m", pose.y},
                         {"heading_rad", pose.heading},
                         {"ellipse95", ellipse_json(turned(snapshot.covariance, laid_by))},
                         {"path", path_json(snapshot.path, laid_by)},
                         {"landmarks", landmarks_json(snapshot.landmarks, laid_by)}});
  }
  const std::array<std::span<const double>, 1> pictured = {growth.moved_m};
  const std::vector<std::size_t> rows = rows_for_picture(pictured, most);
  return {
      {"snapshots", std::move(snapshots)},
      {"moved",
       {{"time_s", column_json(growth.moved_time_s, rows)}, {"moved_m", column_json(growth.moved_m, rows)}}}};
}

}  // namespace trundle::report
