#include <memory>
#include <span>

#include <fmt/format.h>

#include "trundle/pipeline/outputs.hpp"
#include "trundle/pipeline/slam_answer.hpp"
#include "trundle/pipeline/together_answer.hpp"

#include "command.hpp"
#include "progress_bar.hpp"
#include "shared_output.hpp"
#include "slip_correction.hpp"
#include "start_pose.hpp"

namespace trundle::app {
namespace {

struct SlamArguments {
  Common common;
  std::vector<std::string> recordings;
  std::vector<std::string> robots;
  std::vector<int> robot_numbers;
  bool together = false;
  SlamQuestion question;
  SlipCorrection slip;
  std::string filter = std::string(name_of(SlamQuestion{}.method));
  std::string estimate;
  std::string output;
  std::string viewer;
  bool timing = false;
};

std::string smoother_line(const SmootherCounts& counts) {
  return fmt::format(
      "  smoothed {} poses: {} of {} sightings are outliers; cost {:.1f}, {} degrees of freedom; {} after {} "
      "iterations\n",
      counts.poses, counts.outliers, counts.sightings, counts.cost, counts.degrees_of_freedom,
      counts.converged ? "converged" : "not converged", counts.iterations);
}

std::string text_of(const SlamArguments& options, const SlamAnswer& answer) {
  const SlamCounts& counts = answer.result.counts;
  const StampedPose& end = answer.trajectory().poses.back();
  std::string text = fmt::format("{}: {} landmarks from {} sightings in {} steps\n", options.filter,
                                 answer.map().size(), answer.input.observations(), answer.input.steps.size());
  text += fmt::format("  matched {}, new {}, rejected as outliers {}, invalid {}\n", counts.matched,
                      counts.created, counts.rejected, counts.invalid);
  text += app::line_of_nis(counts.mean_nis, counts.median_nis);
  if (answer.result.path)
    text +=
        fmt::format("  resampled in {} steps; effective particles at worst {:.1f} of {}\n", counts.resampled,
                    counts.smallest_effective_share * static_cast<double>(options.question.particles),
                    options.question.particles);
  if (answer.smoothed) text += smoother_line(answer.smoothed->counts);
  text += fmt::format("end pose: x {:.4f} m, y {:.4f} m, heading {:.3f}°\n", end.pose.x, end.pose.y,
                      degrees(end.pose.heading));
  text += fmt::format("written to {}: trajectory.csv ({}), {}landmarks.csv, steps.csv, innovations.csv\n",
                      options.output,
                      answer.smoothed ? "smoothed), online.csv (online estimate" : "online estimate",
                      answer.result.path ? "path.csv (best particle's whole path), " : "");
  for (const Finding& problem : answer.input.findings) text += app::line_of(problem);
  for (const Finding& finding : answer.inconsistencies) text += app::line_of(finding);
  return text;
}

void print_times(const StepTimes& times) {
  print_error(fmt::format(
      "time of a step with sightings: median {:.3f} ms, 99th percentile {:.3f} ms, longest {:.3f} ms\n",
      1e3 * times.median_s, 1e3 * times.p99_s, 1e3 * times.longest_s));
}

/// All that no result may go over: what was read, and the checkpoint that was written.
std::vector<InputFile> inputs_of(const SlamAnswer& answer, const SlamCheckpoints& checkpoints) {
  std::vector<InputFile> inputs = answer.provenance.inputs;
  for (const std::filesystem::path& path : {checkpoints.resume, checkpoints.write})
    inputs.push_back({path.string(), {}});
  return inputs;
}

SlamQuestion question_of(const SlamArguments& options) {
  SlamQuestion question = options.question;
  question.slip = app::question_of(options.slip, question.reading);
  question.method = *slam_method_named(options.filter);
  question.start = start_pose_from(question.start_text);
  if (!options.estimate.empty())
    question.estimate = options.estimate == "best" ? PointEstimate::best : PointEstimate::mean;
  return question;
}

/// For a viewer: the names of `trundle run`.
Shown shown_slam(const SlamAnswer& answer, const Recording& recording) {
  Shown all{.provenance = answer.provenance, .time_origin_s = recording.time_origin_s, .trajectories = {}};
  all.trajectories.push_back(shown("slam online", answer.result.online));
  if (answer.result.path) all.trajectories.push_back(shown("slam path", *answer.result.path));
  if (answer.smoothed) all.trajectories.push_back(shown("slam", answer.smoothed->trajectory));
  all.landmarks = landmark_rows_of(answer);
  return all;
}

/// The recordings of several robots; of a folder that holds several, each of them or those of the numbers.
std::vector<Recording> team_of(const SlamArguments& options, ReadOptions reading) {
  std::vector<Recording> team;
  for (const std::string& folder : options.recordings) {
    std::vector<int> numbers = mrclam_robots(folder);
    if (!numbers.empty() && !options.robot_numbers.empty()) numbers = options.robot_numbers;
    if (numbers.empty()) numbers = {0};
    for (const int number : numbers) {
      reading.robot_number = number;
      team.push_back(read_recording(folder, reading));
    }
  }
  return team;
}

/// Once for all, once for each, or in the folders of the recordings.
std::vector<RobotFile> robots_of(const SlamArguments& options, std::size_t count) {
  std::vector<std::string> files = options.robots;
  if (files.empty() && options.recordings.size() == count)
    for (const std::string& folder : options.recordings)
      files.push_back((std::filesystem::path(folder) / "robot.toml").string());
  if (files.size() == 1) files.resize(count, files.front());
  if (files.size() != count)
    throw CLI::ValidationError(
        "--robot",
        fmt::format("is given {} times for {} robots: once for all, or once for each", files.size(), count));
  std::vector<RobotFile> robots;
  for (const std::string& file : files) robots.push_back(read_robot_file(file));
  return robots;
}

std::string text_of(const SlamArguments& options, const TogetherAnswer& answer) {
  std::string text =
      fmt::format("{} robots together: {} landmarks\n", answer.names.size(), answer.joint.map.size());
  for (std::size_t i = 0; i < answer.names.size(); ++i) {
    const RobotEstimate& robot = answer.joint.robots[i];
    const Pose2& end = robot.trajectory.poses.back().pose;
    text += fmt::format(
        "  {}: {} landmarks in {} sightings ({} outliers), other robots in {} ({} outliers); end pose: x "
        "{:.4f} m, y "
        "{:.4f} m, heading {:.3f}°\n",
        answer.names[i], robot.landmarks, robot.sightings, robot.outliers, robot.robot_sightings,
        robot.robot_outliers, end.x, end.y, degrees(end.heading));
  }
  text += smoother_line(answer.joint.counts);
  text += fmt::format(
      "written to {}: landmarks.csv, landmarks_covariance.csv, slam.json, and in a folder for each robot "
      "trajectory.csv and growth.json\n",
      options.output);
  for (const Finding& problem : answer.findings) text += app::line_of(problem);
  for (const Finding& finding : answer.inconsistencies) text += app::line_of(finding);
  return text;
}

void run_together(const SlamArguments& options, const SlamQuestion& question) {
  std::vector<Recording> recordings = team_of(options, question.reading);
  if (recordings.size() < 2)
    throw CLI::ValidationError("--together", "needs the recordings of two robots at least");
  require_apart(recordings, {options.output});
  const std::vector<RobotFile> robots = robots_of(options, recordings.size());
  std::vector<TeamRobot> team;
  for (std::size_t i = 0; i < recordings.size(); ++i) team.push_back({std::move(recordings[i]), robots[i]});
  ResultFolder results(options.output);
  const TogetherAnswer answer = answer_together(std::move(team), question);
  write_set(results, options.output, files_of(answer, options.output), answer.provenance.inputs,
            together_file_names(answer), "slam.json");
  print(options.common, document_of(answer), text_of(options, answer));
}

/// What several robots need is refused for one, and the other way round.
void check_team(const CLI::App& command, SlamArguments& options) {
  if (options.question.window_s && options.filter != name_of(SlamMethod::smoother))
    throw CLI::ValidationError("--window", "needs --filter smoother");
  if (options.together) {
    for (const char* name : {"--checkpoint", "--resume", "--timing", "--export", "--window"})
      if (command.get_option(name)->count() > 0) throw CLI::ExcludesError("--together", name);
    return;
  }
  if (options.recordings.size() > 1)
    throw CLI::ValidationError("RECORDING", "is given several times: for several robots there is --together");
  if (options.robots.size() > 1)
    throw CLI::ValidationError("--robot", "is given several times for one robot");
  if (options.robot_numbers.size() > 1)
    throw CLI::ValidationError("--robot-number", "is given several times for one robot");
  if (options.robots.empty()) throw CLI::RequiredError("--robot");
}

void run(const SlamArguments& options) {
  SlamQuestion question = question_of(options);
  if (options.together) return run_together(options, question);
  if (!options.robot_numbers.empty()) question.reading.robot_number = options.robot_numbers.front();
  const RobotFile robot = read_robot_file(options.robots.front());
  const Recording recording = read_recording(options.recordings.front(), question.reading);
  require_apart(std::span(&recording, 1), {options.output, question.checkpoints.write});
  ResultFolder results(options.output);
  ProgressBar bar(options.common);
  bar.begin(options.filter);
  question.on_steps = [&](std::size_t done, std::size_t of) { bar.update(done, of); };
  const SlamAnswer answer = answer_slam(recording, robot, question);
  bar.clear();
  std::vector<OutputFile> files = files_of(answer, options.output);
  if (const auto format = viewer_format_named(options.viewer))
    files.push_back(viewer_file(std::filesystem::path(options.output) / ("slam." + options.viewer), *format,
                                shown_slam(answer, recording)));
  write_set(results, options.output, files, inputs_of(answer, question.checkpoints), slam_file_names(),
            "slam.json");
  print(options.common, document_of(answer), text_of(options, answer));
  if (options.timing) print_times(answer.result.step_times);
}

void add_particle_options(CLI::App& command, SlamArguments& options) {
  command.add_option("--particles", options.question.particles, "Particles of the particle filters")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  command
      .add_option("--swarm-iterations", options.question.swarm.iterations,
                  "Rounds of the swarm in a step: mapso, mapso_proposal")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command
      .add_option(
          "--swarm-agreement", options.question.swarm.target_agreement,
          "Stop the swarm earlier, once the mean of exp(-d²/2) over particles and sightings is above; 0: "
          "never")
      ->check(number_from(0.0, 1.0))
      ->capture_default_str();
  command
      .add_option("--estimate", options.estimate,
                  "Pose of the particle filters: their mean or the best particle; default: best for mapso, "
                  "mean for the others")
      ->check(CLI::IsMember({"mean", "best"}));
  command.add_option("--seed", options.question.seed, "Seed of the particle filters' random numbers")
      ->check(whole_number())
      ->capture_default_str();
  command
      .add_option("--threads", options.question.threads,
                  "Threads of the particle filters; results do not depend on it")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
}

void add_checkpoints(CLI::App& command, SlamCheckpoints& checkpoints) {
  CLI::Option* checkpoint = command.add_option("--checkpoint", checkpoints.write,
                                               "File to store the run in, near the end of the recording");
  command
      .add_option("--checkpoint-every-s", checkpoints.every_s,
                  "Store it also whenever so much of the recording's time has passed")
      ->needs(checkpoint)
      ->check(number_from(kSmallest, kLargest));
  command.add_option("--resume", checkpoints.resume,
                     "Go on from a checkpoint of the same recording, or of its beginning");
}

}  // namespace

void add_slam(CLI::App& app) {
  auto options = std::make_shared<SlamArguments>();
  CLI::App* command =
      add_command(app, "slam", "Estimate the trajectory and a map of landmarks from odometry and sightings",
                  "trundle slam recording --robot robot.toml -o out", options->common);
  command
      ->add_option("RECORDING", options->recordings, "Recording folder; with --together one for each robot")
      ->required();
  command
      ->add_option("--robot", options->robots,
                   "Robot file with [landmark_sensor]; with --together once for all robots or once for each; "
                   "without it robot.toml in each recording")
      ->allow_extra_args(false);
  command->add_flag(
      "--together", options->together,
      "Several robots in one world: the most probable trajectories and one map of all, from a filter and a "
      "smoother for each");
  command->add_option("--filter", options->filter, "Which filter")
      ->check(CLI::IsMember(slam_method_names()))
      ->capture_default_str();
  add_particle_options(*command, *options);
  command
      ->add_option("--start", options->question.start_text,
                   "Pose at the first stamp: X,Y,DEG [m, m, degrees]")
      ->capture_default_str();
  command
      ->add_option("--marker-sigma", options->question.marker_sigma_m,
                   "With --together: 1σ of where on its marker a robot is seen by others, beside the "
                   "sensor's noise [m]")
      ->check(number_from(0.0, 100.0));
  command->add_flag("--timing", options->timing, "At the end, on stderr: how long a step took");
  command->add_flag("--smooth", options->question.smooth,
                    "Then the most probable trajectory and map given everything seen, before and after");
  command
      ->add_option("--smoother-runs", options->question.smoother_runs,
                   "Where sightings lack names: runs of a filter that the smoother starts from, to keep the "
                   "most probable")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  command->add_flag("--unknown-ids", options->question.unknown_ids,
                    "Forget the landmarks' names and find out which is which");
  command
      ->add_option(
          "--systematic-sigma", options->question.systematic_sigma,
          "Estimate the odometry's systematic errors with this prior: share of travel, share of turns, "
          "turn per metre [1, 1, rad/m]")
      ->check(number_from(0.0, 10.0));
  command
      ->add_option("--window", options->question.window_s,
                   "Of --filter smoother: marginalise poses that are older, so that memory and the time of a "
                   "step stay bounded [s]")
      ->check(number_from(0.0, kLargest));
  add_slip_correction(*command, options->slip);
  command->add_option("--robot-number", options->robot_numbers, kRobotNumberHelp)
      ->allow_extra_args(false)
      ->check(CLI::Range(1, 1000));
  add_log_options(*command, options->question.reading);
  add_checkpoints(*command, options->question.checkpoints);
  command->add_option("-o,--output", options->output, "Folder for the results")->required();
  add_viewer(*command, options->viewer);
  command->callback([command, options] {
    check_team(*command, *options);
    run(*options);
  });
}

}  // namespace trundle::app
