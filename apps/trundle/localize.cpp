#include <memory>
#include <span>

#include <fmt/format.h>

#include "trundle/pipeline/localize_answer.hpp"
#include "trundle/pipeline/outputs.hpp"

#include "command.hpp"
#include "shared_output.hpp"
#include "slip_correction.hpp"
#include "start_pose.hpp"

namespace trundle::app {
namespace {

struct LocalizeArguments {
  Common common;
  std::string recording;
  std::string robot;
  std::string map;
  std::string filter = std::string(name_of(LocalizerOptions{}.filter));
  LocalizeQuestion question;
  SlipCorrection slip;
  std::string output;
  std::string steps;
  std::string innovations;
};

std::string line_of(const KnownStretch& stretch) {
  std::string line = fmt::format("  {:.2f} s to {:.2f} s: the pose is known", stretch.start_s, stretch.end_s);
  if (stretch.noticed_s)
    line += fmt::format("; then the sightings stop fitting, noticed at {:.2f} s", *stretch.noticed_s);
  return line + "\n";
}

std::string text_of(const LocalizeArguments& options, const LocalizeAnswer& answer) {
  const LocalizationCounts& counts = answer.result.counts;
  const StampedPose& end = answer.result.trajectory.poses.back();
  std::string text = fmt::format("{}: {} poses on a map of {} landmarks, {} sightings in {} steps\n",
                                 options.filter, answer.result.trajectory.poses.size(), answer.landmarks,
                                 answer.input.observations(), answer.input.steps.size());
  for (const double time_s : answer.result.refuted_s)
    text += fmt::format("  {:.2f} s: what the pose was thought to be till then is refuted, and withdrawn\n",
                        time_s);
  for (const KnownStretch& stretch : answer.result.stretches) text += line_of(stretch);
  text += fmt::format(
      "  sightings matched {}, rejected as outliers {}, while searching {}, not in the map {}, invalid {}\n",
      counts.matched, counts.rejected, counts.searching, counts.unmapped, counts.invalid);
  text += app::line_of_nis(counts.mean_nis, counts.median_nis);
  if (counts.most_particles > 0) text += fmt::format("  at most {} particles\n", counts.most_particles);
  text += fmt::format("end pose: x {:.4f} m, y {:.4f} m, heading {:.3f}°\n", end.pose.x, end.pose.y,
                      degrees(end.pose.heading));
  for (const Finding& problem : answer.input.findings) text += app::line_of(problem);
  return text;
}

LocalizeQuestion question_of(const LocalizeArguments& options) {
  LocalizeQuestion question = options.question;
  question.slip = app::question_of(options.slip, question.reading);
  question.filter =
      options.filter == name_of(LocalizerFilter::ekf) ? LocalizerFilter::ekf : LocalizerFilter::particles;
  if (!question.start_text.empty()) question.start = start_pose_from(question.start_text);
  return question;
}

void run(const LocalizeArguments& options) {
  const LocalizeQuestion question = question_of(options);
  const RobotFile robot = read_robot_file(options.robot);
  const Recording recording = read_recording(options.recording, question.reading);
  require_apart(std::span(&recording, 1), {options.output, options.steps, options.innovations});
  const LocalizeAnswer answer = answer_localize(recording, robot, read_map_file(options.map), question);
  std::vector<OutputFile> files = {
      trajectory_file(options.output, answer.provenance, answer.result.trajectory)};
  if (!options.steps.empty()) files.push_back({options.steps, steps_csv_of(answer)});
  if (!options.innovations.empty()) files.push_back({options.innovations, innovations_csv_of(answer)});
  write_files(files, answer.provenance.inputs);
  print(options.common, document_of(answer), text_of(options, answer));
}

}  // namespace

void add_localize(CLI::App& app) {
  auto options = std::make_shared<LocalizeArguments>();
  CLI::App* command = add_command(
      app, "localize", "Find and follow the robot on a map of landmarks that is known",
      "trundle localize recording --robot robot.toml --map landmarks.csv -o trajectory.csv", options->common);
  command->add_option("RECORDING", options->recording, "Recording folder")->required();
  command->add_option("--robot", options->robot, "Robot file with [landmark_sensor]")->required();
  command->add_option("--map", options->map, "landmarks.csv, with covariances or without")->required();
  CLI::Option* start = command->add_option(
      "--start", options->question.start_text,
      "Pose at the first stamp: X,Y,DEG [m, m, degrees]; without it the pose is searched");
  command->add_option("--start-sigma-m", options->question.start_sigma_m, "How well --start is known [m]")
      ->needs(start)
      ->check(number_from(0.0, 1e6))
      ->capture_default_str();
  command
      ->add_option("--start-sigma-deg", options->question.start_sigma_deg,
                   "How well --start is known [degrees]")
      ->needs(start)
      ->check(number_from(0.0, 360.0))
      ->capture_default_str();
  command->add_option("--filter", options->filter, "What follows the pose")
      ->check(CLI::IsMember({"ekf", "particles"}))
      ->capture_default_str();
  command->add_option("--particles", options->question.particles, "At most so many; adapted to their spread")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  command->add_option("--seed", options->question.seed, "Seed of the particles' random numbers")
      ->check(whole_number())
      ->capture_default_str();
  command->add_flag("--unknown-ids", options->question.unknown_ids,
                    "Forget the landmarks' names and find out which is which");
  add_slip_correction(*command, options->slip);
  add_read_options(*command, options->question.reading);
  command->add_option("--steps", options->steps,
                      "CSV of every step: whether the pose is known, sightings, alarm, particles");
  command->add_option("--innovations", options->innovations,
                      "CSV of every sighting: what it was taken for, its innovation and NIS");
  command->add_option("-o,--output", options->output, "Trajectory: .csv, or .tum by its name")->required();
  command->callback([options] { run(*options); });
}

}  // namespace trundle::app
