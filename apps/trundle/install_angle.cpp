#include "trundle/calibration/install_angle.hpp"

#include <charconv>
#include <cmath>
#include <memory>

#include <fmt/format.h>

#include "command.hpp"

namespace trundle::app {
namespace {

using Json = nlohmann::ordered_json;

struct Options {
  std::vector<std::string> recordings;
  std::string robot;
  std::optional<double> side_m;
  std::optional<double> end_x_m;
  std::optional<double> end_y_m;
  std::vector<std::string> repeat;
  double sigma_m = kDefaultPositionSigma;
  double sigma_heading_deg = degrees(kDefaultHeadingSigma);
  Common common;
};

/// Runs and what they were read from. Each end may be the mean of several runs.
struct Input {
  std::vector<LRun> runs;
  std::vector<InputFile> files;
};

[[noreturn]] void refuse_repeat(const std::string& text) {
  throw CLI::ValidationError(
      "--repeat",
      fmt::format("'{}' is neither X,Y (the end of one more run [m]) nor a number of runs", text));
}

/// "X,Y": the end of one more run of the same side.
LRun repeat_from(const std::string& text, double side_m) {
  const char* at = text.data();
  const char* end = at + text.size();
  LRun run{.side_m = side_m};
  const auto [comma, x_error] = std::from_chars(at, end, run.end_x_m);
  if (x_error != std::errc{} || comma == end || *comma != ',') refuse_repeat(text);
  const auto [last, y_error] = std::from_chars(comma + 1, end, run.end_y_m);
  if (y_error != std::errc{} || last != end) refuse_repeat(text);
  if (!(std::hypot(run.end_x_m, run.end_y_m) <= kLargest)) refuse_repeat(text);
  return run;
}

/// "N": the end is the mean of N runs.
std::optional<int> count_from(const std::string& text) {
  int count = 0;
  const auto [last, error] = std::from_chars(text.data(), text.data() + text.size(), count);
  if (error != std::errc{} || last != text.data() + text.size()) return std::nullopt;
  if (count < 1) refuse_repeat(text);
  return count;
}

std::vector<LRun> runs_by_hand(const Options& options) {
  if (!options.side_m || !options.end_x_m || !options.end_y_m)
    throw CLI::RequiredError("--side-m, --end-x-m and --end-y-m, or a recording folder,");
  const LRun first{.side_m = *options.side_m, .end_x_m = *options.end_x_m, .end_y_m = *options.end_y_m};
  std::vector<LRun> runs = {first};
  for (const std::string& text : options.repeat) {
    if (const auto count = count_from(text)) {
      runs.insert(runs.end(), static_cast<std::size_t>(*count - 1), first);
    } else {
      runs.push_back(repeat_from(text, *options.side_m));
    }
  }
  return runs;
}

Input from_recordings(const Options& options) {
  if (options.side_m || options.end_x_m || options.end_y_m || !options.repeat.empty())
    throw CLI::ValidationError("recordings",
                               "hold the side and the end of each run: leave out --side-m, --end-x-m, "
                               "--end-y-m and --repeat");
  if (options.robot.empty()) throw CLI::RequiredError("--robot (which wheel is which pod)");
  Input input;
  for (const std::string& folder : options.recordings) {
    for (const auto& path : recordings_below(folder)) {
      const Recording recording = read_recording(path);
      input.runs.push_back(l_run_of(recording, read_robot(options.robot)));
      input.files.insert(input.files.end(), recording.inputs.begin(), recording.inputs.end());
    }
  }
  input.files.push_back(input_file(options.robot));
  return input;
}

Provenance provenance_of(const Options& options, const Input& input) {
  Provenance provenance{input.files, {}, std::nullopt};
  const auto add = [&](const char* name, const std::optional<double>& value) {
    if (value) provenance.options.emplace_back(name, fmt::format("{}", *value));
  };
  add("side_m", options.side_m);
  add("end_x_m", options.end_x_m);
  add("end_y_m", options.end_y_m);
  for (const std::string& repeat : options.repeat) provenance.options.emplace_back("repeat", repeat);
  add("sigma_m", options.sigma_m);
  add("sigma_heading_deg", options.sigma_heading_deg);
  return provenance;
}

Json document_of(const Provenance& provenance, const Input& input, const InstallAngle& angle) {
  Json document = trundle::to_json(provenance);
  document["alpha_rad"] = angle.alpha_rad;
  document["alpha_deg"] = degrees(angle.alpha_rad);
  document["theta_rad"] = angle.theta_rad;
  document["theta_deg"] = degrees(angle.theta_rad);
  document["sigma_alpha_rad"] = angle.sigma_rad;
  document["sigma_alpha_deg"] = degrees(angle.sigma_rad);
  document["x_over_s"] = angle.scale;
  document["x_over_s_sigma"] = angle.scale_sigma;
  document["scatter_deg"] = angle.scatter_rad ? Json(degrees(*angle.scatter_rad)) : Json();
  document["pod1_over_pod2"] = angle.between_senses_rad ? Json(1.0 + *angle.between_senses_rad) : Json();
  document["runs"] = Json::array();
  for (std::size_t i = 0; i < input.runs.size(); ++i) {
    const LRun& run = input.runs[i];
    document["runs"].push_back({{"side_m", run.side_m},
                                {"end_x_m", run.end_x_m},
                                {"end_y_m", run.end_y_m},
                                {"mirrored", run.mirrored()},
                                {"alpha_deg", degrees(angle.run_alpha_rad[i])}});
  }
  document["warnings"] = angle.warnings;
  return document;
}

std::string text_of(const Input& input, const InstallAngle& angle) {
  std::string text;
  for (std::size_t i = 0; input.runs.size() > 1 && i < input.runs.size(); ++i)
    text += fmt::format("run {}: side {:.4f} m, end ({:.4f}, {:.4f}) m{}: alpha {:.3f}°\n", i + 1,
                        input.runs[i].side_m, input.runs[i].end_x_m, input.runs[i].end_y_m,
                        input.runs[i].mirrored() ? ", mirrored" : "", degrees(angle.run_alpha_rad[i]));
  text += fmt::format("mounting error alpha  {:9.4f}° ± {:.4f}°\n", degrees(angle.alpha_rad),
                      degrees(angle.sigma_rad));
  text += fmt::format("pod 1 rolls at theta  {:9.4f}° from pod 2: its direction_deg, if pod 2 has 0\n",
                      degrees(angle.theta_rad));
  text += fmt::format("X/S                   {:9.4f}  ± {:.4f}: multiply the diameter of pod 2 by it\n",
                      angle.scale, angle.scale_sigma);
  if (angle.scatter_rad) text += fmt::format("scatter of the runs   {:9.4f}°\n", degrees(*angle.scatter_rad));
  if (angle.between_senses_rad)
    text += fmt::format("pod 1 over pod 2      {:9.4f}: multiply the diameter of pod 1 by it as well\n",
                        1.0 + *angle.between_senses_rad);
  for (const std::string& warning : angle.warnings) text += "warning: " + warning + "\n";
  return text;
}

void run(const Options& options) {
  const Input input =
      options.recordings.empty() ? Input{runs_by_hand(options), {}} : from_recordings(options);
  const InstallAngle angle = install_angle(
      input.runs, {.sigma_m = options.sigma_m, .sigma_heading_rad = radians(options.sigma_heading_deg)});
  print(options.common, document_of(provenance_of(options, input), input, angle), text_of(input, angle));
}

}  // namespace

void add_install_angle(CLI::App& app) {
  auto options = std::make_shared<Options>();
  CLI::App* command =
      add_command(app, "install-angle", "Mounting angle of two dead wheels from an L-shaped run",
                  "trundle install-angle --side-m 2 --end-x-m 1.998 --end-y-m 1.931 --repeat "
                  "2.001,1.935",
                  options->common);
  command->add_option("RECORDING", options->recordings,
                      "Recordings of L-shaped runs, instead of numbers by hand");
  command->add_option("--robot", options->robot, "Robot file, for recordings: which wheel is which pod");
  command->add_option("--side-m", options->side_m, "Side that the pods read on each leg [m]")
      ->check(number_from(0.0, kLargest));
  command->add_option("--end-x-m", options->end_x_m, "Where the robot really ended: ahead of its start [m]")
      ->check(number_from(-kLargest, kLargest));
  command->add_option("--end-y-m", options->end_y_m, "and to its left, negative to its right [m]")
      ->check(number_from(-kLargest, kLargest));
  command->add_option(
      "--repeat", options->repeat,
      "X,Y: the end of one more run [m], any number of times; N: the end is the mean of N runs");
  command->add_option("--sigma-m", options->sigma_m, "How well each end coordinate is measured, 1 sigma [m]")
      ->check(number_from(0.0, kLargest))
      ->capture_default_str();
  command
      ->add_option("--sigma-heading-deg", options->sigma_heading_deg,
                   "How well the start heading is set, 1 sigma [degrees]")
      ->check(number_from(0.0, 360.0))
      ->capture_default_str();
  command->callback([options] { run(*options); });
}

}  // namespace trundle::app
