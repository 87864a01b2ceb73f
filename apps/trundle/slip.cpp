#include <memory>
#include <span>

#include <fmt/format.h>

#include "trundle/pipeline/outputs.hpp"
#include "trundle/pipeline/sentences.hpp"
#include "trundle/pipeline/slip_answer.hpp"

#include "command.hpp"
#include "shared_output.hpp"
#include "slip_correction.hpp"

namespace trundle::app {
namespace {

struct SlipArguments {
  std::string recording;
  std::string robot;
  SlipQuestion question;
  std::string method = "general";
  std::string output;
  std::string corrected;
  Common common;
};

std::string events_of(const SlipReport& report, const Robot& robot) {
  if (report.events.empty()) return {};
  const std::vector<double> by_chance = shares_by_chance(report);
  std::string text = fmt::format("{:>10} {:>10}  {:<12} {:<8} {:>10} {:>9} {:>11} {:>10}\n", "start s",
                                 "end s", "wheel", "kind", "excess m", "± m", "confidence", "by chance");
  for (std::size_t i = 0; i < by_chance.size(); ++i) {
    const SlipEvent& e = report.events[i];
    text += fmt::format("{:10.3f} {:10.3f}  {:<12} {:<8} {:10.4f} {:9.4f} {:11.3f} {:>8.1f} %\n", e.start_s,
                        e.end_s, wheel_of(e, robot), name_of(e.kind), e.excess_m, e.excess_sigma_m,
                        e.confidence, 100.0 * by_chance[i]);
  }
  return text +
         fmt::format(
             "by chance: share of those as clear that noise alone makes; of alarms it makes about {:.1f}\n",
             report.counts.by_chance);
}

std::string text_of(const SlipAnswer& answer, const Robot& robot) {
  const SlipCounts& counts = answer.report.counts;
  std::string text =
      fmt::format("{} moving intervals judged, {} within a slip ({:.2f} %); {} slips, {} of them clear\n",
                  counts.judged, counts.slipping, 100.0 * counts.flagged_share(), answer.report.events.size(),
                  clear_slips(answer.report).size());
  text += events_of(answer.report, robot);
  if (!answer.learned)
    text += "the noise is that of the robot file: --learn CLEAN measures it\n";
  else
    text += fmt::format(
        "learned from {} intervals: {} (U1 {:.2f}, U2 {:.2f}, limit {:.2f})\n",
        answer.learned->normality.moments.count, answer.learned->normality.rejected ? "not normal" : "normal",
        answer.learned->normality.u1, answer.learned->normality.u2, answer.learned->normality.limit);
  text += fmt::format("note: {}\n", unobservable_slip(robot));
  for (const Finding& problem : answer.report.findings) text += app::line_of(problem);
  return text;
}

void run(const SlipArguments& options) {
  SlipQuestion question = options.question;
  question.method = options.method == "published" ? SlipMethod::published : SlipMethod::general;
  const RobotFile robot = read_robot_file(options.robot);
  const Recording recording = read_recording(options.recording, question.reading);
  require_apart(std::span(&recording, 1), {options.output, options.corrected});
  const SlipAnswer answer = answer_slip(recording, robot, question);
  std::vector<OutputFile> files;
  if (!options.output.empty()) files.push_back({options.output, slip_csv_of(answer, robot.robot)});
  const auto integrate_into = [&](const TakePose& take) {
    corrected_odometry(recording, answer, robot.robot, take);
  };
  if (options.corrected.empty())
    integrate_into([](const StampedPose&, const Matrix3&) {});
  else
    files.push_back(trajectory_file(options.corrected, answer.provenance, integrate_into));
  write_files(files, answer.provenance.inputs);
  print(options.common, document_of(answer, robot.robot), text_of(answer, robot.robot));
}

}  // namespace

void add_slip(CLI::App& app) {
  auto options = std::make_shared<SlipArguments>();
  CLI::App* command = add_command(
      app, "slip", "Find where wheels slip, and correct the odometry for it",
      "trundle slip recording --robot robot.toml --learn clean -o slip.csv --corrected trajectory.csv",
      options->common);
  command->add_option("RECORDING", options->recording, "Recording folder")->required();
  command->add_option("--robot", options->robot, "Robot file")->required();
  command->add_option("--learn", options->question.learn, "Recordings without slip, to measure the noise on");
  command
      ->add_option("--probability", options->question.probability, "That an interval without slip is flagged")
      ->check(number_from(1e-12, 0.5))
      ->capture_default_str();
  command
      ->add_option("--method", options->method,
                   "general: any chassis; published: two wheels and a gyro, the wheel that is off spins")
      ->check(CLI::IsMember({"general", "published"}))
      ->capture_default_str();
  command
      ->add_option("--interval-s", options->question.interval_s,
                   "Readings are judged over at least this long [s]")
      ->check(number_from(0.0, 60.0))
      ->capture_default_str();
  add_spin_odds(*command, options->question.spin_odds);
  add_read_options(*command, options->question.reading);
  command->add_option("-o,--output", options->output,
                      "Slips: start_s,end_s,wheel,kind,excess_m,confidence,excess_sigma_m,by_chance");
  command->add_option("--corrected", options->corrected,
                      "Trajectory with the slips corrected: .csv, or .tum");
  command->callback([options] { run(*options); });
}

}  // namespace trundle::app
