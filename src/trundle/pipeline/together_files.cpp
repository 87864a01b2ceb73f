#include <cmath>

#include <nlohmann/json.hpp>

#include "trundle/pipeline/provenance.hpp"
#include "trundle/pipeline/together_answer.hpp"
#include "trundle/recording/landmark_file.hpp"
#include "trundle/recording/trajectory_file.hpp"
#include "trundle/report/json_text.hpp"
#include "trundle/slam/map_file.hpp"

namespace trundle::pipeline {
namespace {

using Json = nlohmann::ordered_json;

Json robot_json(const TogetherAnswer& answer, std::size_t i) {
  const RobotEstimate& robot = answer.joint.robots[i];
  const StampedPose& end = robot.trajectory.poses.back();
  Json document = {
      {"name", answer.names[i]},
      {"trajectory", answer.names[i] + "/trajectory.csv"},
      {"steps", robot.trajectory.poses.size()},
      {"landmarks", robot.landmarks},
      {"sightings", robot.sightings},
      {"outliers", robot.outliers},
      {"robot_sightings", robot.robot_sightings},
      {"robot_outliers", robot.robot_outliers},
      {"nis", robot.nis},
      {"robot_nis", robot.robot_nis},
      {"metre", {{"share", robot.metre}, {"sigma", robot.metre_sigma}}},
      {"end",
       {{"time_s", end.time_s}, {"x_m", end.pose.x}, {"y_m", end.pose.y}, {"heading_rad", end.pose.heading}}},
      {"systematic_errors", systematic_json(answer.systematic[i], robot.last)}};
  if (!robot.bias.empty())
    document["gyro_bias"] = {{"rad_s", answer.gyro_bias_rad_s[i] + robot.bias.back().rad_s},
                             {"sigma_rad_s", std::sqrt(std::max(0.0, robot.bias.back().variance))}};
  return document;
}

std::vector<std::string> names_of_map(const TogetherAnswer& answer) {
  std::vector<std::string> names;
  for (const MappedLandmark& landmark : answer.joint.map)
    names.push_back(answer.landmarks[static_cast<std::size_t>(landmark.id)]);
  return names;
}

}  // namespace

Json document_of(const TogetherAnswer& answer) {
  const SmootherCounts& counts = answer.joint.counts;
  Json document = to_json(answer.provenance);
  document["status"] = answer.inconsistencies.empty() ? "ok" : name_of(answer.inconsistencies.front().code);
  document["doubts"] = to_json(answer.inconsistencies);
  document["landmarks"] = answer.joint.map.size();
  document["sightings"] = {{"matched", counts.sightings - counts.outliers}, {"rejected", counts.outliers}};
  document["nis"] = {{"mean", nullptr}};
  document["trajectory"] = "smoothed, all robots together";
  document["smoother"] = smoother_json(counts);
  if (answer.metre_sigma > 0.0) document["metre_sigma"] = answer.metre_sigma;
  document["robots"] = Json::array();
  for (std::size_t i = 0; i < answer.names.size(); ++i) document["robots"].push_back(robot_json(answer, i));
  document["problems"] = to_json(answer.findings);
  return document;
}

std::vector<std::string> together_file_names(const TogetherAnswer& answer) {
  std::vector<std::string> names = slam_file_names();
  for (const std::string& robot : answer.names)
    for (const char* file : {"/trajectory.csv", "/growth.json"}) names.push_back(robot + file);
  return names;
}

std::vector<OutputFile> files_of(const TogetherAnswer& answer, const std::filesystem::path& folder) {
  const std::string head = head_of(answer.provenance);
  std::vector<OutputFile> files = {
      {folder / "landmarks.csv", head + to_csv(answer.joint.map, answer.landmarks)},
      {covariance_file_of(folder / "landmarks.csv"),
       head + landmark_covariance_csv(names_of_map(answer), answer.joint.map_covariance)},
      {folder / "slam.json", dumped(document_of(answer), 2) + "\n"}};
  for (std::size_t i = 0; i < answer.names.size(); ++i)
    files.push_back(
        {folder / answer.names[i] / "trajectory.csv", head + to_csv(answer.joint.robots[i].trajectory)});
  for (const GrowthResult& growth : answer.growth) {
    Json document = to_json(answer.provenance);
    document.update(to_json(growth));
    files.push_back({folder / growth.robot / "growth.json", dumped(document) + "\n"});
  }
  return files;
}

}  // namespace trundle::pipeline
