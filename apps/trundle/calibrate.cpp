#include <memory>

#include "trundle/pipeline/calibration_answer.hpp"

#include "calibration_output.hpp"
#include "command.hpp"

namespace trundle::app {
namespace {

struct CalibrateArguments {
  std::vector<std::string> recordings;
  std::vector<std::string> hold_out;
  std::string robot;
  ReadOptions reading;
  CalibrateOptions calibrate;
  bool landmarks = false;
  CalibrationOutput output;
  Common common;
};

void run(const CalibrateArguments& options) {
  const RobotFile nominal = read_robot_file(options.robot);
  const ReadOptions& how = options.reading;
  const std::vector<Recording> training = read_recordings(options.recordings, how);
  const std::vector<Recording> hold_out = read_recordings(options.hold_out, how);
  require_apart(training, {options.output.robot_path});
  require_apart(hold_out, {options.output.robot_path});
  const auto answer = options.landmarks ? answer_landmark_calibration : answer_calibration;
  finish_calibration(answer(training, hold_out, nominal, options.calibrate), options.output, options.common);
}

}  // namespace

void add_calibrate(CLI::App& app) {
  const auto options = std::make_shared<CalibrateArguments>();
  CLI::App* command = add_command(
      app, "calibrate", "Calibrate a robot from recordings with references",
      "trundle calibrate squares/ --hold-out tour/ --robot nominal.toml -o calibrated.toml", options->common);
  command
      ->add_option("recordings", options->recordings,
                   "Recording folders, or folders of recordings (one session)")
      ->required();
  command->add_option("--hold-out", options->hold_out,
                      "Recordings to evaluate the result on, not to learn from");
  command->add_option("--robot", options->robot, "The nominal robot file")->required();
  command->add_option("--free", options->calibrate.free, "Also estimate this parameter, e.g. reference.x");
  command->add_option("--fix", options->calibrate.fix, "Leave this parameter at its nominal value");
  command->add_flag("--learn-noise", options->calibrate.learn_noise,
                    "Also learn the noise of wheels, sideways motion and gyro from what odometry misses of "
                    "the reference; with --landmarks that of odometry and landmark sensor from what the "
                    "smoother leaves");
  CLI::Option* landmarks = command->add_flag(
      "--landmarks", options->landmarks, "Learn from what the robot saw of landmarks, without any reference");
  command
      ->add_flag("--with-reference", options->calibrate.with_reference,
                 "With --landmarks: also from the positions of the reference, which show how long a metre of "
                 "the landmark sensor is")
      ->needs(landmarks);
  add_read_options(*command, options->reading);
  add_calibration_output(*command, options->output);
  command->callback([options] { run(*options); });
}

}  // namespace trundle::app
