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

Json path_json(const std::vector<Vector2>& path) {
  std::vector<double> x, y;
  for (const Vector2& place : path) {
    x.push_back(place.x());
    y.push_back(place.y());
  }
  return {{"x_m", column_json(x)}, {"y_m", column_json(y)}};
}

Json landmarks_json(const std::vector<LandmarkRow>& landmarks) {
  std::vector<double> x, y, major, minor, angle;
  for (const LandmarkRow& landmark : landmarks) {
    const Ellipse ellipse = error_ellipse95(landmark.position, landmark.covariance.value_or(Matrix2::Zero()));
    x.push_back(landmark.position.x());
    y.push_back(landmark.position.y());
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
  for (const GrowthSnapshot& snapshot : placed(growth, laid_by).snapshots)
    snapshots.push_back({{"time_s", snapshot.time_s},
                         {"x_m", snapshot.pose.x},
                         {"y_m", snapshot.pose.y},
                         {"heading_rad", snapshot.pose.heading},
                         {"ellipse95", ellipse_json(snapshot.covariance)},
                         {"path", path_json(snapshot.path)},
                         {"landmarks", landmarks_json(snapshot.landmarks)}});
  const std::array<std::span<const double>, 1> pictured = {growth.moved_m};
  const std::vector<std::size_t> rows = rows_for_picture(pictured, most);
  return {
      {"robot", growth.robot},
      {"snapshots", std::move(snapshots)},
      {"moved",
       {{"time_s", column_json(growth.moved_time_s, rows)}, {"moved_m", column_json(growth.moved_m, rows)}}}};
}

}  // namespace trundle::report
