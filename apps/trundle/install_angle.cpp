#include <algorithm>
#include <charconv>
#include <cmath>
#include <memory>

#include <fmt/format.h>

#include "trundle/pipeline/install_angle_answer.hpp"

#include "command.hpp"

namespace trundle::app {
namespace {

struct InstallAngleArguments {
  std::vector<std::string> recordings;
  std::string robot;
  std::optional<double> side_m;
  std::vector<double> end_x_m;  ///< of each run
  std::vector<double> end_y_m;
  std::vector<std::string> repeat;
  std::string start_heading = "one-alignment";
  double sigma_m = kDefaultPositionSigma;
  double sigma_heading_deg = degrees(kDefaultHeadingSigma);
  Common common;
};

[[noreturn]] void refuse_repeat(const std::string& text) {
  throw CLI::ValidationError(
      "--repeat",
      fmt::format("'{}' is neither X,Y (the end of one more run [m]) nor the number of runs", text));
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

/// "N": how many runs there are.
std::optional<std::size_t> count_from(const std::string& text) {
  std::size_t count = 0;
  const auto [last, error] = std::from_chars(text.data(), text.data() + text.size(), count);
  if (error != std::errc{} || last != text.data() + text.size()) return std::nullopt;
  if (count < 1) refuse_repeat(text);
  return count;
}

/// A repeat is a run that was measured: none is made up from a number.
void require_count(const InstallAngleArguments& options, std::size_t runs, const char* give) {
  for (const std::string& text : options.repeat)
    if (const auto count = count_from(text); count && *count != runs)
      throw CLI::ValidationError(
          "--repeat", fmt::format("{} runs are said to be there, {} given: {}", *count, runs, give));
}

std::vector<LRun> runs_by_hand(const InstallAngleArguments& options) {
  if (!options.side_m || options.end_x_m.empty() || options.end_y_m.empty())
    throw CLI::RequiredError("--side-m, --end-x-m and --end-y-m, or a recording folder,");
  if (options.end_x_m.size() != options.end_y_m.size())
    throw CLI::ValidationError("--end-x-m",
                               fmt::format("{} of them with {} of --end-y-m: one of each for every run",
                                           options.end_x_m.size(), options.end_y_m.size()));
  std::vector<LRun> runs;
  for (std::size_t i = 0; i < options.end_x_m.size(); ++i)
    runs.push_back({.side_m = *options.side_m, .end_x_m = options.end_x_m[i], .end_y_m = options.end_y_m[i]});
  for (const std::string& text : options.repeat)
    if (!count_from(text)) runs.push_back(repeat_from(text, *options.side_m));
  require_count(options, runs.size(), "the end of each by --end-x-m and --end-y-m, or --repeat X,Y");
  return runs;
}

LinesDriven from_recordings(const InstallAngleArguments& options) {
  const bool has_ends =
      std::ranges::any_of(options.repeat, [](const auto& text) { return !count_from(text); });
  if (options.side_m || !options.end_x_m.empty() || !options.end_y_m.empty() || has_ends)
    throw CLI::ValidationError("recordings",
                               "hold the side and the end of each run: leave out --side-m, --end-x-m, "
                               "--end-y-m and --repeat X,Y");
  if (options.robot.empty()) throw CLI::RequiredError("--robot (which wheel is which pod)");
  LinesDriven input = lines_driven(options.recordings, options.robot);
  require_count(options, input.runs.size(), "a recording of each");
  return input;
}

StartHeading start_heading_of(const InstallAngleArguments& options) {
  return options.start_heading == "each-run" ? StartHeading::each_run : StartHeading::one_alignment;
}

Provenance provenance_of(const InstallAngleArguments& options, const LinesDriven& input) {
  Provenance provenance{input.files, {}, std::nullopt};
  const auto add = [&](const char* name, const std::optional<double>& value) {
    if (value) provenance.options.emplace_back(name, fmt::format("{}", *value));
  };
  add("side_m", options.side_m);
  for (const double x : options.end_x_m) add("end_x_m", x);
  for (const double y : options.end_y_m) add("end_y_m", y);
  for (const std::string& repeat : options.repeat) provenance.options.emplace_back("repeat", repeat);
  add("sigma_m", options.sigma_m);
  add("sigma_heading_deg", options.sigma_heading_deg);
  provenance.options.emplace_back("start_heading", options.start_heading);
  return provenance;
}

/// Where ± comes from, where several runs leave a choice.
std::string words_of_sigma(const InstallAngle& angle, StartHeading start_heading) {
  std::string text;
  if (angle.scatter_rad)
    text +=
        fmt::format("scatter of the runs   {:9.4f}° ({} degree{} of freedom), measuring explains {:.4f}°{}\n",
                    degrees(*angle.scatter_rad), angle.scatter_freedom, angle.scatter_freedom == 1 ? "" : "s",
                    degrees(angle.measuring_rad),
                    angle.sigma_from_scatter ? ": ± is from the scatter, by Student's t" : "");
  if (angle.run_alpha_rad.size() > 1)
    text += start_heading == StartHeading::each_run
                ? "start heading         aligned anew for each run: its error averages\n"
                : "start heading         one alignment for all runs: its error does not average "
                  "(--start-heading each-run, where it was aligned anew)\n";
  return text;
}

std::string text_of(const InstallAngleAnswer& answer, StartHeading start_heading) {
  const InstallAngle& angle = answer.angle;
  std::string text;
  for (std::size_t i = 0; answer.runs.size() > 1 && i < answer.runs.size(); ++i)
    text += fmt::format("run {}: side {:.4f} m, end ({:.4f}, {:.4f}) m{}: alpha {:.3f}°\n", i + 1,
                        answer.runs[i].side_m, answer.runs[i].end_x_m, answer.runs[i].end_y_m,
                        answer.runs[i].mirrored() ? ", mirrored" : "", degrees(angle.run_alpha_rad[i]));
  text += fmt::format("mounting error alpha  {:9.4f}° ± {:.4f}°\n", degrees(angle.alpha_rad),
                      degrees(angle.sigma_rad));
  text += fmt::format("pod 1 rolls at theta  {:9.4f}° from pod 2: its direction_deg, if pod 2 has 0\n",
                      degrees(angle.theta_rad));
  text += fmt::format("X/S                   {:9.4f}  ± {:.4f}: multiply the diameter of pod 2 by it\n",
                      angle.scale, angle.scale_sigma);
  text += words_of_sigma(angle, start_heading);
  if (angle.between_senses_rad)
    text += fmt::format("pod 1 over pod 2      {:9.4f}: multiply the diameter of pod 1 by it as well\n",
                        1.0 + *angle.between_senses_rad);
  for (const std::string& warning : angle.warnings) text += "warning: " + warning + "\n";
  return text;
}

void run(const InstallAngleArguments& options) {
  const LinesDriven input =
      options.recordings.empty() ? LinesDriven{runs_by_hand(options), {}} : from_recordings(options);
  const InstallAngleAnswer answer = {
      provenance_of(options, input), input.runs,
      install_angle(input.runs, {.sigma_m = options.sigma_m,
                                 .sigma_heading_rad = radians(options.sigma_heading_deg),
                                 .start_heading = start_heading_of(options)})};
  print(options.common, document_of(answer), text_of(answer, start_heading_of(options)));
}

}  // namespace

void add_install_angle(CLI::App& app) {
  auto options = std::make_shared<InstallAngleArguments>();
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
  command
      ->add_option("--end-x-m", options->end_x_m,
                   "Where the robot really ended: ahead of its start [m]; "
                   "once for each run")
      ->check(number_from(-kLargest, kLargest));
  command
      ->add_option("--end-y-m", options->end_y_m,
                   "and to its left, negative to its right [m]; once for each run")
      ->check(number_from(-kLargest, kLargest));
  command->add_option(
      "--repeat", options->repeat,
      "X,Y: the end of one more run [m], any number of times; N: how many runs were measured, to be "
      "checked against those given");
  command->add_option("--sigma-m", options->sigma_m, "How well each end coordinate is measured, 1 sigma [m]")
      ->check(number_from(0.0, kLargest))
      ->capture_default_str();
  command
      ->add_option("--sigma-heading-deg", options->sigma_heading_deg,
                   "How well the start heading is set, 1 sigma [degrees]")
      ->check(number_from(0.0, 360.0))
      ->capture_default_str();
  command
      ->add_option("--start-heading", options->start_heading,
                   "Whether one alignment served all runs, so that its error stays, or each was aligned anew")
      ->check(CLI::IsMember({"one-alignment", "each-run"}))
      ->capture_default_str();
  command->callback([options] { run(*options); });
}

}  // namespace trundle::app
