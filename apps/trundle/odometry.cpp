#include <algorithm>
#include <cmath>
#include <memory>

#include <fmt/format.h>

#include "trundle/odometry/effective_track.hpp"
#include "trundle/odometry/integrate.hpp"

#include "command.hpp"
#include "shared_output.hpp"
#include "start_pose.hpp"

namespace trundle::app {
namespace {

struct Options {
  std::string recording;
  std::string robot;
  std::string start = "0,0,0";
  int robot_number = 0;
  bool smooth = false;
  std::string output;
  Common common;
};

Provenance provenance_of(const Options& options, const Recording& recording) {
  Provenance provenance{recording.inputs, {{"start", options.start}}, std::nullopt};
  provenance.inputs.push_back(input_file(options.robot));
  if (options.robot_number != 0)
    provenance.options.emplace_back("robot-number", std::to_string(options.robot_number));
  if (options.smooth) provenance.options.emplace_back("smooth", "true");
  return provenance;
}

struct Sigmas {
  double x_m, y_m, heading_rad;
};

Sigmas sigmas_of(const Matrix3& covariance) {
  return {std::sqrt(covariance(0, 0)), std::sqrt(covariance(1, 1)), std::sqrt(covariance(2, 2))};
}

nlohmann::ordered_json to_json(const Sigmas& sigmas) {
  return {{"x_m", sigmas.x_m}, {"y_m", sigmas.y_m}, {"heading_rad", sigmas.heading_rad}};
}

nlohmann::ordered_json document_of(const Provenance& provenance, const IntegratedOdometry& odometry) {
  const StampedPose& end = odometry.trajectory.poses.back();
  nlohmann::ordered_json document = app::to_json(provenance);
  document["poses"] = odometry.trajectory.poses.size();
  document["path_length_m"] = odometry.path_length_m;
  document["end"] = {
      {"time_s", end.time_s}, {"x_m", end.pose.x}, {"y_m", end.pose.y}, {"heading_rad", end.pose.heading}};
  document["sigma"] = to_json(sigmas_of(odometry.trajectory.covariances.back()));
  document["sigma_white"] = to_json(sigmas_of(odometry.white_covariances.back()));
  document["sigma_parameters"] = nullptr;  // not known without a calibration
  if (!odometry.parameters.empty())
    document["sigma_parameters"] = to_json(sigmas_of(odometry.end_parameter_covariance));
  document["uncertain_parameters"] = odometry.parameters;
  document["degrees_of_freedom"] = odometry.degrees_of_freedom;
  document["rest_s"] = odometry.rest_s;
  if (odometry.end_gyro_bias.variance > 0.0)
    document["gyro_bias"] = {{"rad_s", odometry.end_gyro_bias.rad_s},
                             {"sigma_rad_s", std::sqrt(odometry.end_gyro_bias.variance)}};
  document["bridged_gaps"] = odometry.bridged;
  document["problems"] = nlohmann::ordered_json::array();
  for (const Problem& problem : odometry.problems) document["problems"].push_back(app::to_json(problem));
  return document;
}

std::string line_of(const char* name, const Sigmas& sigmas) {
  return fmt::format("  {:<28}± {:.4f} m, ± {:.4f} m, ± {:.3f}°\n", name, sigmas.x_m, sigmas.y_m,
                     degrees(sigmas.heading_rad));
}

std::string text_of(const IntegratedOdometry& odometry) {
  const auto& poses = odometry.trajectory.poses;
  const Pose2& end = poses.back().pose;
  std::string text = fmt::format("{} poses over {:.1f} s, path {:.3f} m\n", poses.size(),
                                 poses.back().time_s - poses.front().time_s, odometry.path_length_m);
  text +=
      fmt::format("end pose: x {:.4f} m, y {:.4f} m, heading {:.3f}°\n", end.x, end.y, degrees(end.heading));
  text += line_of("all together", sigmas_of(odometry.trajectory.covariances.back()));
  text += line_of("noise of the readings", sigmas_of(odometry.white_covariances.back()));
  text += odometry.parameters.empty()
              ? "  the robot file has no calibration: how well its parameters are known is not in here\n"
              : line_of("calibrated parameters", sigmas_of(odometry.end_parameter_covariance));
  text += odometry.degrees_of_freedom == 0
              ? "no reading beyond those the motion needs: slip cannot show\n"
              : fmt::format("readings beyond those the motion needs: {}\n", odometry.degrees_of_freedom);
  if (const GyroBias& bias = odometry.end_gyro_bias; bias.variance > 0.0)
    text += fmt::format("gyro bias {:.6f} ± {:.6f} rad/s, {}\n", bias.rad_s, std::sqrt(bias.variance),
                        odometry.rest_s > 0.0 ? fmt::format("learned in {:.1f} s at rest", odometry.rest_s)
                                              : "as the robot file says: it never rests");
  for (const Problem& problem : odometry.problems) text += app::line_of(problem);
  return text;
}

/// Where wheels must scrub in turns, the ground sets the track.
std::vector<TrackOnGround> tracks_of(const Recording& recording, const Robot& robot) {
  const auto wheels = robot.chassis.wheels();
  const bool skids = std::ranges::any_of(wheels, [](const Wheel& w) { return w.kind == WheelKind::skid; });
  if (!skids || !EffectiveTrack::applies_to(robot.chassis)) return {};
  return effective_tracks(align(recording, robot), robot.chassis);
}

void run(const Options& options) {
  const Pose2 start = start_pose_from(options.start);
  const Robot robot = read_robot(options.robot);
  const Recording recording = read_recording(options.recording, {.robot_number = options.robot_number});
  IntegratedOdometry odometry = integrate(recording, robot, {.start = start, .smooth = options.smooth});
  odometry.problems.insert(odometry.problems.begin(), recording.problems.begin(), recording.problems.end());
  const Provenance provenance = provenance_of(options, recording);
  if (!options.output.empty()) write_trajectory(options.output, provenance, odometry.trajectory);
  nlohmann::ordered_json document = document_of(provenance, odometry);
  std::string text = text_of(odometry);
  for (const TrackOnGround& track : tracks_of(recording, robot)) {
    document["effective_track"].push_back({{"start_s", track.start_s},
                                           {"end_s", track.end_s},
                                           {"track_m", track.track_m},
                                           {"sigma_m", track.sigma_m}});
    text += fmt::format("effective track by the gyro, {:.1f} to {:.1f} s: {:.4f} ± {:.4f} m\n", track.start_s,
                        track.end_s, track.track_m, track.sigma_m);
  }
  print(options.common, document, text);
}

}  // namespace

void add_odometry(CLI::App& app) {
  auto options = std::make_shared<Options>();
  CLI::App* command = add_command(
      app, "odometry", "Integrate a recording's wheels and gyro to a trajectory with covariance",
      "trundle odometry recording --robot robot.toml --start 1,2,90 -o trajectory.csv", options->common);
  command->add_option("RECORDING", options->recording, "Recording folder")->required();
  command->add_option("--robot", options->robot, "Robot file")->required();
  command->add_option("--start", options->start, "Pose at the first stamp: X,Y,DEG [m, m, degrees]")
      ->capture_default_str();
  command->add_option("--robot-number", options->robot_number, "Which robot of a UTIAS MRCLAM folder");
  command->add_flag("--smooth", options->smooth,
                    "Every pose also by what later rests show of the gyro's bias");
  command->add_option("-o,--output", options->output, "Trajectory: .csv, or .tum by its name");
  command->callback([options] { run(*options); });
}

}  // namespace trundle::app
