#include "trundle/pipeline/run.hpp"

#include <algorithm>
#include <cstdio>
#include <memory>

#include <fmt/format.h>

#include "trundle/io/words.hpp"

#include "command.hpp"
#include "progress_bar.hpp"
#include "shared_output.hpp"
#include "slip_correction.hpp"

namespace trundle::app {
namespace {

struct RunArguments {
  RunQuestion question;
  std::string filter = std::string(name_of(SlamQuestion{}.method));
  std::string viewer;
  std::string output;
  Common common;
};

std::string line_of(const Stage& stage) {
  std::string line = fmt::format("{:<14} {:<8} {}\n", name_of(stage), name_of(stage.status), stage.message);
  for (const std::string& remark : stage.remarks) line += fmt::format("{:<23} {}\n", "", remark);
  return line;
}

/// Names the recordings of a session before their stages.
std::string heading_of(std::string_view recording, std::string& last) {
  if (recording == last) return {};
  const bool first = last.empty();
  last = recording;
  return first ? std::string() : fmt::format("\n{}\n", recording);
}

/// What runs now, on a terminal; each stage as it is done, on stdout.
OnProgress progress_of(const Common& common, ProgressBar& bar) {
  return [common, &bar, last = std::string()](const RunProgress& progress) mutable {
    if (progress.of > 0) return bar.update(progress.done, progress.of);
    if (progress.finished == nullptr)
      return bar.begin(fmt::format("{}: {}", progress.recording, progress.stage));
    bar.clear();
    if (common.quiet || common.json) return;
    fmt::print("{}", printable(heading_of(progress.recording, last) + line_of(*progress.finished)));
    std::fflush(stdout);
  };
}

/// Of a session: a line for each of its recordings, then the whole.
std::string summary_of(const RunRecord& record) {
  std::string text;
  std::size_t width = std::string_view("all").size();
  for (const std::string& name : record.recordings) width = std::max(width, name.size());
  for (const Stage& stage : record.stages)
    if (!stage.recording.empty()) text += fmt::format("{:<{}}  {}\n", stage.recording, width, stage.message);
  for (const Stage& stage : record.stages)
    if (stage.kind == StageKind::evaluation && !text.empty())
      text += fmt::format("{:<{}}  {}\n", "all", width, stage.message);
  return text.empty() ? text : "\n" + text;
}

void run(const RunArguments& options) {
  RunQuestion question = options.question;
  question.output = options.output;
  question.slam.method = *slam_method_named(options.filter);
  question.viewer = viewer_format_named(options.viewer);
  ProgressBar bar(options.common);
  const RunAnswer answer = pipeline::run(question, progress_of(options.common, bar));
  if (const auto& failure = answer.no_odometry) throw Exit{failure->kind, failure->message};
  print(options.common, to_json(answer.record),
        summary_of(answer.record) + fmt::format("written to {}\n", options.output));
}

}  // namespace

void add_run(CLI::App& app) {
  auto options = std::make_shared<RunArguments>();
  RunQuestion& question = options->question;
  CLI::App* command = add_command(
      app, "run", "All of it in one go: health, calibration, odometry, slip, map, errors, one page",
      "trundle run my_tour --robot robot.toml --calibrate-on my_squares -o out/my_tour", options->common);
  command->add_option("RECORDING", question.recording, "Recording folder")->required();
  command->add_option("--robot", question.robot, "Robot file")->required();
  command->add_option("--calibrate-on", question.calibrate_on,
                      "Recordings to calibrate on, instead of RECORDING; it is held out then");
  command->add_option("--free", question.calibrate.free, "Also calibrate this parameter, e.g. reference.x");
  command->add_option("--fix", question.calibrate.fix, "Leave this parameter at its nominal value");
  command->add_option("--learn", question.learn, "Recordings without slip, to measure the noise on");
  add_spin_odds(*command, question.spin_odds);
  command->add_option("--map", question.map,
                      "Known landmarks to localize on; without it RECORDING/landmarks.csv, where it is");
  command->add_option("--filter", options->filter, "Which filter maps the landmarks")
      ->check(CLI::IsMember(slam_method_names()))
      ->capture_default_str();
  command->add_option("--particles", question.slam.particles, "Particles of the particle filters")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  command->add_option("--seed", question.slam.seed, "Seed of the particle filters' random numbers")
      ->check(whole_number())
      ->capture_default_str();
  add_viewer(*command, options->viewer);
  add_read_options(*command, question.reading);
  command->add_option("-o,--output", options->output, "Folder for all results")->required();
  command->callback([options] { run(*options); });
}

}  // namespace trundle::app
