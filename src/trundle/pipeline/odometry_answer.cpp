#include "trundle/pipeline/odometry_answer.hpp"

#include <algorithm>
#include <cmath>

#include <nlohmann/json.hpp>

#include "trundle/io/error.hpp"
#include "trundle/pipeline/no_rest.hpp"
#include "trundle/pipeline/sound.hpp"

namespace trundle::pipeline {
namespace {

using Json = nlohmann::ordered_json;

/// Where wheels must scrub in turns, the ground sets the track.
std::vector<TrackOnGround> tracks_of(const Recording& recording, const Robot& robot) {
  if (!has_skid_wheels(robot.chassis) || !EffectiveTrack::applies_to(robot.chassis)) return {};
  return effective_tracks(recording, robot);
}

Json sigmas_of(const Matrix3& covariance) {
  return {{"x_m", std::sqrt(covariance(0, 0))},
          {"y_m", std::sqrt(covariance(1, 1))},
          {"heading_rad", std::sqrt(covariance(2, 2))}};
}

/// A row every second; fewer where there would be more than kMostBiasRows. The last one is kept.
constexpr std::size_t kMostBiasRows = 4000;

BiasOverTime bias_over_time(const std::vector<GyroBiasAt>& history) {
  BiasOverTime bias;
  const std::size_t stride = 1 + (history.size() - 1) / kMostBiasRows;
  for (std::size_t i = 0; i < history.size(); ++i) {
    if (i % stride != 0 && i + 1 != history.size()) continue;
    bias.time_s.push_back(history[i].time_s);
    bias.rad_s.push_back(history[i].rad_s);
    bias.sigma_rad_s.push_back(history[i].sigma_rad_s);
  }
  return bias;
}

/// Stretches [start_s, end_s] of standing still.
std::vector<std::pair<double, double>> rests_of(const std::vector<GyroBiasAt>& history) {
  std::vector<std::pair<double, double>> rests;
  for (std::size_t i = 0; i < history.size(); ++i) {
    if (!history[i].at_rest) continue;
    const double start = history[i].time_s;
    while (i + 1 < history.size() && history[i].at_rest) ++i;
    rests.emplace_back(start, history[i].time_s);
  }
  return rests;
}

}  // namespace

Provenance provenance_of_odometry(const Recording& recording, const RobotFile& robot,
                                  const OdometryQuestion& question) {
  Provenance provenance{recording.inputs, {{"start", question.start_text}}, std::nullopt};
  provenance.inputs.push_back(robot.file);
  add_read_options(question.reading, provenance);
  if (question.smooth) provenance.options.emplace_back("smooth", "true");
  return provenance;
}

OdometryAnswer answer_odometry(const Recording& recording, const RobotFile& robot,
                               const OdometryQuestion& question, const TakePose& take) {
  IntegrateOptions options{.start = question.start, .smooth = question.smooth};
  if (take)
    options.take = [&](const StampedPose& pose, const Matrix3& covariance) {
      require_sound(pose, covariance, recording.name);
      take(pose, covariance);
    };
  OdometryAnswer answer{.provenance = provenance_of_odometry(recording, robot, question),
                        .odometry = integrate(recording, robot.robot, options),
                        .tracks = {}};
  const IntegratedOdometry& odometry = answer.odometry;
  if (odometry.poses < 2)
    throw CannotAnswer(recording.name +
                       ": no two rows hold readings of all wheels: there is no motion to integrate");
  answer.tracks = tracks_of(recording, robot.robot);
  require_sound(odometry.trajectory, recording.name);
  auto& findings = answer.odometry.findings;
  report_no_rest(
      {robot.robot, odometry.rest_s, odometry.end.time_s - odometry.start_s, odometry.end_covariance(2, 2)},
      findings);
  findings.insert(findings.begin(), recording.findings.begin(), recording.findings.end());
  return answer;
}

OdometryResult odometry_result_of(const OdometryAnswer& answer) {
  OdometryResult result{.rest_s = answer.odometry.rest_s};
  if (answer.odometry.gyro_bias.empty()) return result;
  result.bias = bias_over_time(answer.odometry.gyro_bias);
  result.rests = rests_of(answer.odometry.gyro_bias);
  return result;
}

Json document_of(const OdometryAnswer& answer) {
  const IntegratedOdometry& odometry = answer.odometry;
  const StampedPose& end = odometry.end;
  Json document = to_json(answer.provenance);
  document["poses"] = odometry.poses;
  document["path_length_m"] = odometry.path_length_m;
  document["end"] = {
      {"time_s", end.time_s}, {"x_m", end.pose.x}, {"y_m", end.pose.y}, {"heading_rad", end.pose.heading}};
  document["sigma"] = sigmas_of(odometry.end_covariance);
  document["sigma_white"] = sigmas_of(odometry.end_white_covariance);
  document["sigma_parameters"] = nullptr;  // not known without a calibration
  if (!odometry.parameters.empty())
    document["sigma_parameters"] = sigmas_of(odometry.end_parameter_covariance);
  document["uncertain_parameters"] = odometry.parameters;
  document["degrees_of_freedom"] = odometry.degrees_of_freedom;
  document["rest_s"] = odometry.rest_s;
  if (odometry.end_gyro_bias.variance > 0.0)
    document["gyro_bias"] = {{"rad_s", odometry.end_gyro_bias.rad_s},
                             {"sigma_rad_s", std::sqrt(odometry.end_gyro_bias.variance)}};
  if (const OdometryResult result = odometry_result_of(answer); result.bias) {
    document["gyro_bias_over_time"] = to_json(*result.bias);
    document["rests"] = result.rests;
  }
  document["bridged_gaps"] = odometry.bridged;
  document["problems"] = to_json(odometry.findings);
  for (const TrackOnGround& track : answer.tracks)
    document["effective_track"].push_back({{"start_s", track.start_s},
                                           {"end_s", track.end_s},
                                           {"track_m", track.track_m},
                                           {"sigma_m", track.sigma_m}});
  return document;
}

}  // namespace trundle::pipeline
