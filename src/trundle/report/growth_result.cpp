#include "trundle/report/growth_result.hpp"

#include <array>

#include <nlohmann/json.hpp>

#include "trundle/report/json_rules.hpp"

namespace trundle::report {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::array kGrowthRules = {
    JsonRule{"snapshots", kArray},
    JsonRule{"snapshots/*", kObject | kMissing},
    JsonRule{"snapshots/*/time_s", kNumber},
    JsonRule{"snapshots/*/x_m", kNumber},
    JsonRule{"snapshots/*/y_m", kNumber},
    JsonRule{"snapshots/*/heading_rad", kNumber},
    JsonRule{"snapshots/*/var_xx", kNumber},
    JsonRule{"snapshots/*/var_xy", kNumber},
    JsonRule{"snapshots/*/var_yy", kNumber},
    JsonRule{"snapshots/*/path", kObject},
    JsonRule{"snapshots/*/path/x_m", kArray},
    JsonRule{"snapshots/*/path/x_m/*", kNumber | kMissing},
    JsonRule{"snapshots/*/path/y_m", kArray},
    JsonRule{"snapshots/*/path/y_m/*", kNumber | kMissing},
    JsonRule{"snapshots/*/landmarks", kArray},
    JsonRule{"snapshots/*/landmarks/*", kObject | kMissing},
    JsonRule{"snapshots/*/landmarks/*/landmark", kString},
    JsonRule{"snapshots/*/landmarks/*/x_m", kNumber},
    JsonRule{"snapshots/*/landmarks/*/y_m", kNumber},
    JsonRule{"snapshots/*/landmarks/*/var_xx", kNumber},
    JsonRule{"snapshots/*/landmarks/*/var_xy", kNumber},
    JsonRule{"snapshots/*/landmarks/*/var_yy", kNumber},
    JsonRule{"moved", kObject},
    JsonRule{"moved/time_s", kArray},
    JsonRule{"moved/time_s/*", kNumber | kMissing},
    JsonRule{"moved/moved_m", kArray},
    JsonRule{"moved/moved_m/*", kNumber | kMissing},
};

void add_covariance(const Matrix2& P, Json& to) {
  to["var_xx"] = P(0, 0);
  to["var_xy"] = P(0, 1);
  to["var_yy"] = P(1, 1);
}

Matrix2 covariance_of(const Json& from) {
  Matrix2 P;
  P << from.at("var_xx").get<double>(), from.at("var_xy").get<double>(), from.at("var_xy").get<double>(),
      from.at("var_yy").get<double>();
  return P;
}

Json to_json(const LandmarkRow& landmark) {
  Json document = {
      {"landmark", landmark.name}, {"x_m", landmark.position.x()}, {"y_m", landmark.position.y()}};
  add_covariance(landmark.covariance.value_or(Matrix2::Zero()), document);
  return document;
}

Json to_json(const GrowthSnapshot& snapshot) {
  Json document = {{"time_s", snapshot.time_s},
                   {"x_m", snapshot.pose.x},
                   {"y_m", snapshot.pose.y},
                   {"heading_rad", snapshot.pose.heading}};
  add_covariance(snapshot.covariance, document);
  Json x = Json::array(), y = Json::array(), landmarks = Json::array();
  for (const Vector2& place : snapshot.path) {
    x.push_back(place.x());
    y.push_back(place.y());
  }
  for (const LandmarkRow& landmark : snapshot.landmarks) landmarks.push_back(to_json(landmark));
  document["path"] = {{"x_m", std::move(x)}, {"y_m", std::move(y)}};
  document["landmarks"] = std::move(landmarks);
  return document;
}

GrowthSnapshot snapshot_of(const Json& from, std::string_view file_name) {
  GrowthSnapshot snapshot{.time_s = from.at("time_s"),
                          .pose = {from.at("x_m").get<double>(), from.at("y_m").get<double>(),
                                   from.at("heading_rad").get<double>()},
                          .covariance = covariance_of(from),
                          .path = {},
                          .landmarks = {}};
  constexpr std::array kColumns = {"x_m", "y_m"};
  expect_same_lengths(from, "path", kColumns, file_name);
  const Json& path = from.at("path");
  for (std::size_t i = 0; i < path.at("x_m").size(); ++i)
    snapshot.path.emplace_back(path.at("x_m")[i].get<double>(), path.at("y_m")[i].get<double>());
  for (const Json& landmark : from.at("landmarks"))
    snapshot.landmarks.push_back(
        {.name = landmark.at("landmark"),
         .position = Vector2(landmark.at("x_m").get<double>(), landmark.at("y_m").get<double>()),
         .covariance = covariance_of(landmark)});
  return snapshot;
}

}  // namespace

GrowthResult placed(GrowthResult growth, const Pose2& by) {
  const Matrix2 R = rotation(by.heading);
  for (GrowthSnapshot& snapshot : growth.snapshots) {
    snapshot.pose = by * snapshot.pose;
    snapshot.covariance = R * snapshot.covariance * R.transpose();
    for (Vector2& place : snapshot.path) place = by * place;
    for (LandmarkRow& landmark : snapshot.landmarks) {
      landmark.position = by * landmark.position;
      if (landmark.covariance) landmark.covariance = R * *landmark.covariance * R.transpose();
    }
  }
  return growth;
}

Json to_json(const GrowthResult& growth) {
  Json snapshots = Json::array();
  for (const GrowthSnapshot& snapshot : growth.snapshots) snapshots.push_back(to_json(snapshot));
  return {{"snapshots", std::move(snapshots)},
          {"moved", {{"time_s", growth.moved_time_s}, {"moved_m", growth.moved_m}}}};
}

GrowthResult growth_from_json(std::string_view text, std::string_view file_name) {
  const Json document = parse_result(text, "growth", kGrowthRules, file_name);
  constexpr std::array kColumns = {"time_s", "moved_m"};
  expect_same_lengths(document, "moved", kColumns, file_name);
  GrowthResult growth;
  for (const Json& snapshot : document.at("snapshots"))
    growth.snapshots.push_back(snapshot_of(snapshot, file_name));
  growth.moved_time_s = document.at("moved").at("time_s").get<std::vector<double>>();
  growth.moved_m = document.at("moved").at("moved_m").get<std::vector<double>>();
  return growth;
}

}  // namespace trundle::report
