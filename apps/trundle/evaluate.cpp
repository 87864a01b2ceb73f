#include <optional>

#include <fmt/format.h>

#include "trundle/io/words.hpp"
#include "trundle/pipeline/evaluation_answer.hpp"

#include "command.hpp"

namespace trundle::app {
namespace {

struct EvaluateArguments {
  Common common;
  std::string estimate;
  std::string reference;
  std::string alignment = "start";
  double longest_gap_s = EvaluateOptions{}.longest_gap_s;
  std::optional<std::string> robot;
  std::optional<double> time_offset_s;
};

Alignment alignment_named(const std::string& name) {
  if (name == "none") return Alignment::none;
  return name == "se2" ? Alignment::se2 : Alignment::start;
}

std::string text_of(const RelativePoseError& error) {
  if (error.pairs == 0) return fmt::format("  {:>5g} m   the path is too short\n", error.distance_m);
  return fmt::format("  {:>5g} m   {:.4f} m rms   {:.3f} % mean   {:.3f} deg rms   {} pairs\n",
                     error.distance_m, error.translation_rms_m, error.translation_mean_percent,
                     degrees(error.heading_rms_rad), error.pairs);
}

std::string text_of(const ReferenceSigmas& noise) {
  if (!noise.stated()) return "the reference is taken as exact, as it states no position_sigma_m";
  return fmt::format("the reference's own {:g} m and {:g} deg are counted", noise.position_sigma_m,
                     degrees(noise.heading_sigma_rad));
}

std::string text_of(const Nees& nees, const ReferenceSigmas& noise) {
  std::string text = fmt::format(
      "NEES            {:.2f} mean (expected if consistent: {}), {:.1f} % of {} poses inside 95 %; {}\n",
      nees.mean, nees.degrees_of_freedom, 100.0 * nees.share_inside_95, nees.poses, text_of(noise));
  if (nees.before_motion > 0)
    text += fmt::format("                from where the estimate moves: {} before it left out\n",
                        counted(nees.before_motion, "pose"));
  return text;
}

std::string_view words_of(Alignment alignment) {
  switch (alignment) {
    case Alignment::start:
      return "start-aligned (first common pose)";
    case Alignment::se2:
      return "best fit (SE2)";
    case Alignment::none:
      return "as given, not aligned";
  }
  return {};
}

std::string text_of(const EvaluationAnswer& answer) {
  const Evaluation& e = answer.evaluation;
  std::string text = fmt::format("Compared        {} poses over {:.1f} s, {:.2f} m; {}\n", e.compared,
                                 e.overlap_s(), e.path_m, words_of(e.alignment));
  if (answer.clock) text += fmt::format("Clock           {}\n", sentence_of(*answer.clock));
  text += fmt::format("Position error  {:.4f} m rms, {:.4f} mean, {:.4f} median, {:.4f} max\n",
                      e.position_m.rms, e.position_m.mean, e.position_m.median, e.position_m.max);
  if (e.heading_rms_rad) text += fmt::format("Heading error   {:.3f} deg rms\n", degrees(*e.heading_rms_rad));
  text += fmt::format("At the end      {:.4f} m", e.final_position_m);
  if (e.final_percent) text += fmt::format(", {:.3f} % of the path", *e.final_percent);
  if (e.final_heading_rad) text += fmt::format(", {:.3f} deg", degrees(*e.final_heading_rad));
  text += '\n';
  if (!e.relative.empty()) text += "Relative error over\n";
  for (const RelativePoseError& error : e.relative) text += text_of(error);
  if (e.nees) text += text_of(*e.nees, e.reference_noise);
  return text;
}

void run(const EvaluateArguments& options) {
  const TrajectoryFile estimate = read_trajectory_file(options.estimate);
  std::optional<RobotFile> robot_file;
  if (options.robot) robot_file = read_robot_file(*options.robot);
  const RobotFile* const robot = robot_file ? &*robot_file : nullptr;
  const TrajectoryFile reference = on_clock_of(
      estimate, options.reference,
      {.robot = robot, .longest_gap_s = options.longest_gap_s, .time_offset_s = options.time_offset_s});
  const EvaluationAnswer answer = answer_evaluation(
      estimate, reference,
      {.alignment = alignment_named(options.alignment), .longest_gap_s = options.longest_gap_s}, robot);
  print(options.common, document_of(answer), text_of(answer));
}

}  // namespace

void add_evaluate(CLI::App& app) {
  auto options = std::make_shared<EvaluateArguments>();
  CLI::App* command =
      add_command(app, "evaluate", "How far an estimated trajectory is from a reference",
                  "trundle evaluate trajectory.csv data/demo/session_03/tour --align se2", options->common);
  const std::string forms = "trajectory.csv, .tum, reference.csv, or a recording folder (its reference)";
  command->add_option("estimate", options->estimate, "The estimate: " + forms)->required();
  command->add_option("reference", options->reference, "What it is compared with: " + forms)->required();
  command
      ->add_option("--align", options->alignment,
                   "none: one frame already; start: first common poses laid on each other, heading "
                   "included; se2: least squares over all positions")
      ->check(CLI::IsMember({"none", "start", "se2"}))
      ->capture_default_str();
  command
      ->add_option("--longest-gap-s", options->longest_gap_s,
                   "The estimate is not interpolated across longer gaps [s]")
      ->check(number_from(kSmallest, kLargest))
      ->capture_default_str();
  command->add_option("--robot", options->robot,
                      "Robot file: the estimate is its body's, the reference that of its [reference_sensor]");
  command
      ->add_option("--time-offset-s", options->time_offset_s,
                   "Added to the reference's stamps, instead of what the motion shows where they are off; "
                   "0: they stay as they are [s]")
      ->check(number_from(-kLargest, kLargest));
  command->callback([options] { run(*options); });
}

}  // namespace trundle::app
