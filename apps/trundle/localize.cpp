#include <memory>

#include <fmt/format.h>

#include "trundle/recording/landmark_file.hpp"
#include "trundle/slam/localizer.hpp"

#include "command.hpp"
#include "shared_output.hpp"
#include "start_pose.hpp"

namespace trundle::app {
namespace {

struct Options {
  Common common;
  std::string recording;
  std::string robot;
  std::string map;
  int robot_number = 0;
  std::string filter = "particles";
  std::size_t particles = ParticleNumber{}.most;
  std::uint64_t seed = LocalizerOptions{}.seed;
  std::string start;
  double start_sigma_m = 0.5;
  double start_sigma_deg = 10.0;
  bool unknown_ids = false;
  std::string output;
};

struct Run {
  SlamInput input;
  std::size_t landmarks = 0;
  Localization result;
  Provenance provenance;
};

Provenance provenance_of(const Options& options, const Recording& recording) {
  Provenance provenance{recording.inputs, {}, options.seed};
  provenance.inputs.push_back(input_file(options.robot));
  provenance.inputs.push_back(input_file(options.map));
  provenance.options = {{"filter", options.filter},
                        {"start", options.start.empty() ? "none" : options.start}};
  if (!options.start.empty()) {
    provenance.options.emplace_back("start-sigma-m", fmt::format("{}", options.start_sigma_m));
    provenance.options.emplace_back("start-sigma-deg", fmt::format("{}", options.start_sigma_deg));
  }
  if (options.filter == name_of(LocalizerFilter::particles))
    provenance.options.emplace_back("particles", std::to_string(options.particles));
  if (options.unknown_ids) provenance.options.emplace_back("unknown-ids", "true");
  if (options.robot_number != 0)
    provenance.options.emplace_back("robot-number", std::to_string(options.robot_number));
  return provenance;
}

std::optional<PoseEstimate> start_of(const Options& options) {
  if (options.start.empty()) return std::nullopt;
  PoseEstimate start;
  start.pose = start_pose_from(options.start);
  const double sigma_rad = radians(options.start_sigma_deg);
  start.covariance.diagonal() << options.start_sigma_m * options.start_sigma_m,
      options.start_sigma_m * options.start_sigma_m, sigma_rad * sigma_rad;
  return start;
}

LocalizerOptions localizer_options_of(const Options& options) {
  LocalizerOptions to;
  to.filter =
      options.filter == name_of(LocalizerFilter::ekf) ? LocalizerFilter::ekf : LocalizerFilter::particles;
  to.start = start_of(options);
  to.particles.most = options.particles;
  to.particles.least = std::min(to.particles.least, options.particles);
  to.seed = options.seed;
  return to;
}

/// Two landmarks that are seen from one place or from two near each other are no further apart.
double reach_of(const LandmarkSensor& sensor) {
  return 2.0 * sensor.max_range_m;
}

Run localized(const Options& options) {
  const LocalizerOptions localizer_options = localizer_options_of(options);
  const Robot robot = read_robot(options.robot);
  const Recording recording = read_recording(options.recording, {.robot_number = options.robot_number});
  std::vector<std::string> names;
  std::vector<KnownLandmark> landmarks;
  for (const MapLandmark& landmark : read_landmark_map(options.map)) {
    names.push_back(landmark.name);
    landmarks.push_back({landmark.position, landmark.covariance});
  }
  Run run;
  run.landmarks = names.size();
  run.input = slam_input(recording, robot, {.hide_ids = options.unknown_ids, .names = names});
  run.input.problems.insert(run.input.problems.begin(), recording.problems.begin(), recording.problems.end());
  const LandmarkSensor& sensor = *robot.landmark_sensor;
  const KnownMap map(std::move(landmarks), reach_of(sensor));
  run.result = localize(run.input, map, sensor, localizer_options);
  if (run.result.trajectory.poses.empty())
    throw CannotAnswer(fmt::format(
        "{}: {} sightings and the {} landmarks of the map never told where the robot is; {}", recording.name,
        run.input.observations(), run.landmarks,
        run.result.counts.unmapped > 0
            ? fmt::format("{} of them name landmarks that the map does not have", run.result.counts.unmapped)
            : std::string("a --start may help")));
  run.provenance = provenance_of(options, recording);
  return run;
}

nlohmann::ordered_json to_json(const KnownStretch& stretch) {
  nlohmann::ordered_json document = {{"start_s", stretch.start_s}, {"end_s", stretch.end_s}};
  if (stretch.noticed_s) document["loss_noticed_s"] = *stretch.noticed_s;
  return document;
}

nlohmann::ordered_json document_of(const Run& run) {
  const LocalizationCounts& counts = run.result.counts;
  const StampedPose& end = run.result.trajectory.poses.back();
  nlohmann::ordered_json document = trundle::to_json(run.provenance);
  document["landmarks"] = run.landmarks;
  document["steps"] = run.input.steps.size();
  document["poses"] = run.result.trajectory.poses.size();
  document["localized_s"] = run.result.stretches.front().start_s;
  document["known"] = nlohmann::ordered_json::array();
  for (const KnownStretch& stretch : run.result.stretches) document["known"].push_back(to_json(stretch));
  document["sightings"] = {{"matched", counts.matched},
                           {"rejected", counts.rejected},
                           {"while_searching", counts.searching},
                           {"not_in_the_map", counts.unmapped},
                           {"invalid", counts.invalid}};
  document["nis"] = {{"mean", counts.mean_nis}, {"median", counts.median_nis}, {"honest_mean", 2.0}};
  if (counts.most_particles > 0) document["most_particles"] = counts.most_particles;
  document["end"] = {
      {"time_s", end.time_s}, {"x_m", end.pose.x}, {"y_m", end.pose.y}, {"heading_rad", end.pose.heading}};
  document["trajectory"] = "online estimate, where the pose is known";
  document["problems"] = nlohmann::ordered_json::array();
  for (const Problem& problem : run.input.problems) document["problems"].push_back(trundle::to_json(problem));
  return document;
}

std::string line_of(const KnownStretch& stretch) {
  std::string line = fmt::format("  {:.2f} s to {:.2f} s: the pose is known", stretch.start_s, stretch.end_s);
  if (stretch.noticed_s)
    line += fmt::format("; then the sightings stop fitting, noticed at {:.2f} s", *stretch.noticed_s);
  return line + "\n";
}

std::string text_of(const Options& options, const Run& run) {
  const LocalizationCounts& counts = run.result.counts;
  const StampedPose& end = run.result.trajectory.poses.back();
  std::string text = fmt::format("{}: {} poses on a map of {} landmarks, {} sightings in {} steps\n",
                                 options.filter, run.result.trajectory.poses.size(), run.landmarks,
                                 run.input.observations(), run.input.steps.size());
  for (const KnownStretch& stretch : run.result.stretches) text += line_of(stretch);
  text += fmt::format(
      "  sightings matched {}, rejected as outliers {}, while searching {}, not in the map {}, invalid {}\n",
      counts.matched, counts.rejected, counts.searching, counts.unmapped, counts.invalid);
  text +=
      fmt::format("  innovations squared (NIS): mean {:.2f}, median {:.2f}; honest noise has 2.00, 1.39\n",
                  counts.mean_nis, counts.median_nis);
  if (counts.most_particles > 0) text += fmt::format("  at most {} particles\n", counts.most_particles);
  text += fmt::format("end pose: x {:.4f} m, y {:.4f} m, heading {:.3f}°\n", end.pose.x, end.pose.y,
                      degrees(end.pose.heading));
  for (const Problem& problem : run.input.problems) text += app::line_of(problem);
  return text;
}

void run(const Options& options) {
  const Run run = localized(options);
  write_trajectory(options.output, run.provenance, run.result.trajectory);
  print(options.common, document_of(run), text_of(options, run));
}

}  // namespace

void add_localize(CLI::App& app) {
  auto options = std::make_shared<Options>();
  CLI::App* command = add_command(
      app, "localize", "Find and follow the robot on a map of landmarks that is known",
      "trundle localize recording --robot robot.toml --map landmarks.csv -o trajectory.csv", options->common);
  command->add_option("RECORDING", options->recording, "Recording folder")->required();
  command->add_option("--robot", options->robot, "Robot file with [landmark_sensor]")->required();
  command->add_option("--map", options->map, "landmarks.csv, with covariances or without")->required();
  command->add_option("--start", options->start,
                      "Pose at the first stamp: X,Y,DEG [m, m, degrees]; without it the pose is searched");
  command->add_option("--start-sigma-m", options->start_sigma_m, "How well --start is known [m]")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->add_option("--start-sigma-deg", options->start_sigma_deg, "How well --start is known [degrees]")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->add_option("--filter", options->filter, "What follows the pose")
      ->check(CLI::IsMember({"ekf", "particles"}))
      ->capture_default_str();
  command->add_option("--particles", options->particles, "At most so many; their spread tells how many")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  command->add_option("--seed", options->seed, "Seed of the particles' random numbers")
      ->capture_default_str();
  command->add_flag("--unknown-ids", options->unknown_ids,
                    "Forget the landmarks' names and find out which is which");
  command->add_option("--robot-number", options->robot_number, "Which robot of a UTIAS MRCLAM folder");
  command->add_option("-o,--output", options->output, "Trajectory: .csv, or .tum by its name")->required();
  command->callback([options] { run(*options); });
}

}  // namespace trundle::app
