#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <span>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "trundle/pipeline/odometry_answer.hpp"
#include "trundle/pipeline/outputs.hpp"

#include "command.hpp"
#include "shared_output.hpp"
#include "start_pose.hpp"

namespace trundle::app {
namespace {

struct OdometryArguments {
  std::string recording;
  std::string robot;
  OdometryQuestion question;
  std::string output;
  std::string viewer;
  Common common;
};

struct Sigmas {
  double x_m, y_m, heading_rad;
};

Sigmas sigmas_of(const Matrix3& covariance) {
  return {std::sqrt(covariance(0, 0)), std::sqrt(covariance(1, 1)), std::sqrt(covariance(2, 2))};
}

std::string line_of(const char* name, const Sigmas& sigmas) {
  return fmt::format("  {:<28}± {:.4f} m, ± {:.4f} m, ± {:.3f}°\n", name, sigmas.x_m, sigmas.y_m,
                     degrees(sigmas.heading_rad));
}

/// Sizes that no calibration has measured: they take no part in what is said of the parameters.
std::string taken_as_exact(const IntegratedOdometry& odometry, const Robot& robot) {
  std::vector<std::string> names;
  for (const Parameter& parameter : parameters_of(robot)) {
    constexpr std::array kSizes = {ParameterKind::diameter, ParameterKind::gyro_scale,
                                   ParameterKind::velocity_forward_scale, ParameterKind::velocity_yaw_scale};
    const bool is_size = std::ranges::find(kSizes, parameter.kind) != kSizes.end();
    const std::string name = name_of(parameter, robot);
    if (is_size && std::ranges::find(odometry.parameters, name) == odometry.parameters.end())
      names.push_back(name);
  }
  return names.empty() ? ""
                       : fmt::format("  taken as exact, for no calibration measured them: {}\n",
                                     fmt::join(names, ", "));
}

std::string source_of_bias(const IntegratedOdometry& odometry, const Robot& robot) {
  if (odometry.rest_s > 0.0) return fmt::format("learned in {:.1f} s at rest", odometry.rest_s);
  if (std::sqrt(odometry.end_gyro_bias.variance) < initial_bias_sigma(robot))
    return "learned from how the wheels turn: it never rests";
  return "as the robot file says: it never rests";
}

std::string text_of(const OdometryAnswer& answer, const Robot& robot) {
  const IntegratedOdometry& odometry = answer.odometry;
  const Pose2& end = odometry.end.pose;
  std::string text = fmt::format("{} poses over {:.1f} s, path {:.3f} m\n", odometry.poses,
                                 odometry.end.time_s - odometry.start_s, odometry.path_length_m);
  text +=
      fmt::format("end pose: x {:.4f} m, y {:.4f} m, heading {:.3f}°\n", end.x, end.y, degrees(end.heading));
  text += line_of("all together", sigmas_of(odometry.end_covariance));
  text += line_of("noise of the readings", sigmas_of(odometry.end_white_covariance));
  text += odometry.parameters.empty()
              ? "  the robot file has no calibration: how well its parameters are known is not in here\n"
              : line_of("calibrated parameters", sigmas_of(odometry.end_parameter_covariance)) +
                    taken_as_exact(odometry, robot);
  text += odometry.degrees_of_freedom == 0
              ? "slip is not observable: no redundant measurement\n"
              : fmt::format("readings beyond those the motion needs: {}\n", odometry.degrees_of_freedom);
  if (const GyroBias& bias = odometry.end_gyro_bias; bias.variance > 0.0)
    text += fmt::format("gyro bias {:.6f} ± {:.6f} rad/s, {}\n", bias.rad_s, std::sqrt(bias.variance),
                        source_of_bias(odometry, robot));
  for (const Finding& problem : odometry.findings) text += app::line_of(problem);
  for (const TrackOnGround& track : answer.tracks)
    text += fmt::format("effective track by the gyro, {:.1f} to {:.1f} s: {:.4f} ± {:.4f} m\n", track.start_s,
                        track.end_s, track.track_m, track.sigma_m);
  return text;
}

/// The trajectory, and what a viewer shows of it beside.
std::vector<OutputFile> files_of(const OdometryArguments& options, const Recording& recording,
                                 const Provenance& provenance,
                                 const std::function<void(const TakePose&)>& produce) {
  const std::filesystem::path path = options.output;
  std::vector<OutputFile> files = {trajectory_file(path, provenance, produce)};
  if (const auto format = viewer_format_named(options.viewer))
    files.push_back(viewer_file(std::filesystem::path(path).replace_extension(options.viewer), *format,
                                {.provenance = provenance,
                                 .time_origin_s = recording.time_origin_s,
                                 .trajectories = {{"odometry", true, produce}}}));
  return files;
}

void run(const OdometryArguments& options) {
  OdometryQuestion question = options.question;
  question.start = start_pose_from(question.start_text);
  const RobotFile robot = read_robot_file(options.robot);
  const Recording recording = read_recording(options.recording, question.reading);
  require_apart(std::span(&recording, 1), {options.output});
  OdometryAnswer answer;
  const auto integrate_into = [&](const TakePose& take) {
    answer = answer_odometry(recording, robot, question, take);
  };
  const Provenance provenance = provenance_of_odometry(recording, robot, question);
  if (options.output.empty())
    integrate_into([](const StampedPose&, const Matrix3&) {});
  else
    write_files(files_of(options, recording, provenance, integrate_into), provenance.inputs);
  print(options.common, document_of(answer), text_of(answer, robot.robot));
}

}  // namespace

void add_odometry(CLI::App& app) {
  auto options = std::make_shared<OdometryArguments>();
  CLI::App* command = add_command(
      app, "odometry", "Integrate a recording's wheels and gyro to a trajectory with covariance",
      "trundle odometry recording --robot robot.toml --start 1,2,90 -o trajectory.csv", options->common);
  command->add_option("RECORDING", options->recording, "Recording folder")->required();
  command->add_option("--robot", options->robot, "Robot file")->required();
  command
      ->add_option("--start", options->question.start_text,
                   "Pose at the first stamp: X,Y,DEG [m, m, degrees]")
      ->capture_default_str();
  add_read_options(*command, options->question.reading);
  command->add_flag("--smooth", options->question.smooth,
                    "Every pose also by what later rests show of the gyro's bias");
  CLI::Option* output =
      command->add_option("-o,--output", options->output, "Trajectory: .csv, or .tum by its name");
  add_viewer(*command, options->viewer)->needs(output);
  command->callback([options] { run(*options); });
}

}  // namespace trundle::app
