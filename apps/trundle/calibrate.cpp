#include "trundle/calibration/calibrate.hpp"

#include <memory>

#include <fmt/format.h>

#include "calibration_output.hpp"
#include "command.hpp"

namespace trundle::app {
namespace {

struct Options {
  std::vector<std::string> recordings;
  std::vector<std::string> hold_out;
  std::string robot;
  int robot_number = 0;
  CalibrateOptions calibrate;
  CalibrationOutput output;
  Common common;
};

std::vector<Recording> read_all(const std::vector<std::string>& folders, const Options& options) {
  std::vector<Recording> recordings;
  for (const std::string& folder : folders)
    for (const std::filesystem::path& path : recordings_below(folder))
      recordings.push_back(read_recording(path, {.robot_number = options.robot_number}));
  return recordings;
}

void add_inputs(const std::vector<Recording>& recordings, Provenance& provenance) {
  for (const Recording& recording : recordings)
    provenance.inputs.insert(provenance.inputs.end(), recording.inputs.begin(), recording.inputs.end());
}

void run(const Options& options) {
  const Robot nominal = read_robot(options.robot);
  const std::vector<Recording> training = read_all(options.recordings, options);
  const std::vector<Recording> hold_out = read_all(options.hold_out, options);
  if (training.empty())
    throw InputError(options.recordings.front(), "holds no recording", "recording folders");
  Provenance provenance;
  provenance.inputs.push_back(input_file(options.robot));
  add_inputs(training, provenance);
  add_inputs(hold_out, provenance);
  for (const std::string& name : options.calibrate.free) provenance.options.emplace_back("free", name);
  for (const std::string& name : options.calibrate.fix) provenance.options.emplace_back("fix", name);
  if (options.calibrate.learn_noise) provenance.options.emplace_back("learn_noise", "true");
  finish_calibration(calibrate(training, hold_out, nominal, options.calibrate), provenance, options.output,
                     options.common);
}

}  // namespace

void add_calibrate(CLI::App& app) {
  const auto options = std::make_shared<Options>();
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
                    "Also learn the noise of wheels, sideways motion and gyro from what odometry misses");
  command->add_option("--robot-number", options->robot_number, "Which robot of a folder that holds several");
  add_calibration_output(*command, options->output);
  command->callback([options] { run(*options); });
}

}  // namespace trundle::app
