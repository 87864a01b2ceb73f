#include "trundle/slam/slam.hpp"

#include <array>
#include <memory>

#include <fmt/format.h>

#include "trundle/slam/smoother.hpp"

#include "command.hpp"
#include "shared_output.hpp"
#include "start_pose.hpp"

namespace trundle::app {
namespace {

struct Options {
  Common common;
  std::string recording;
  std::string robot;
  int robot_number = 0;
  std::string filter = "fastslam2";
  std::size_t particles = SlamOptions{}.particles;
  std::uint64_t seed = SlamOptions{}.seed;
  std::string start = "0,0,0";
  std::optional<double> systematic_sigma;
  bool unknown_ids = false;
  bool smooth = false;
  std::string output;
};

struct Run {
  SlamInput input;
  SlamResult result;
  std::optional<SmoothedSlam> smoothed;
  Provenance provenance;

  const Trajectory& trajectory() const { return smoothed ? smoothed->trajectory : result.online; }
  const std::vector<MappedLandmark>& map() const { return smoothed ? smoothed->map : result.map; }
  const PoseEstimate& last() const { return smoothed ? smoothed->last : result.last; }
};

Provenance provenance_of(const Options& options, const Recording& recording) {
  Provenance provenance{recording.inputs, {}, options.seed};
  provenance.inputs.push_back(input_file(options.robot));
  provenance.options = {{"filter", options.filter}, {"start", options.start}};
  if (options.filter != name_of(SlamMethod::ekf))
    provenance.options.emplace_back("particles", std::to_string(options.particles));
  if (options.unknown_ids) provenance.options.emplace_back("unknown-ids", "true");
  if (options.systematic_sigma)
    provenance.options.emplace_back("systematic-sigma", fmt::format("{}", *options.systematic_sigma));
  if (options.smooth) provenance.options.emplace_back("smooth", "true");
  if (options.robot_number != 0)
    provenance.options.emplace_back("robot-number", std::to_string(options.robot_number));
  return provenance;
}

/// Names of landmarks that have none: 1, 2, ... in order of first sight.
std::vector<std::string> numbers_for(const std::vector<MappedLandmark>& map) {
  std::vector<std::string> names;
  for (std::size_t i = 1; i <= map.size(); ++i) names.push_back(std::to_string(i));
  return names;
}

Run filtered(const Options& options) {
  const Pose2 start = start_pose_from(options.start);
  if (options.unknown_ids && options.filter != name_of(SlamMethod::ekf))
    throw CLI::ValidationError("--unknown-ids", "only --filter ekf finds out which landmark is which");
  const Robot robot = read_robot(options.robot);
  const Recording recording = read_recording(options.recording, {.robot_number = options.robot_number});
  Run run;
  run.input = slam_input(recording, robot, {.hide_ids = options.unknown_ids});
  run.input.problems.insert(run.input.problems.begin(), recording.problems.begin(), recording.problems.end());
  if (run.input.observations() == 0)
    throw CannotAnswer(fmt::format("{}: no sightings while the robot's odometry runs", recording.name));
  SlamPrior prior{.start = start,
                  .systematic_sigma = Systematic::Constant(options.systematic_sigma.value_or(0.0))};
  run.result = slam(run.input, *robot.landmark_sensor,
                    {.method = *slam_method_named(options.filter),
                     .particles = options.particles,
                     .seed = options.seed,
                     .prior = prior});
  if (!options.systematic_sigma) prior.systematic_sigma = kUsualSystematicSigma;
  if (options.smooth) run.smoothed = smooth(run.input, *robot.landmark_sensor, run.result, {.prior = prior});
  run.provenance = provenance_of(options, recording);
  if (options.unknown_ids) run.input.landmarks = numbers_for(run.result.map);
  return run;
}

/// A name as a cell: in quotes where it holds the delimiter.
std::string cell_of(const std::string& name) {
  return name.find(',') == std::string::npos ? name : '"' + name + '"';
}

std::string csv_of(const std::vector<MappedLandmark>& map, const std::vector<std::string>& names) {
  std::string text = "landmark,x_m,y_m,var_xx,var_xy,var_yy,sightings\n";
  for (const MappedLandmark& m : map)
    text +=
        fmt::format("{},{},{},{},{},{},{}\n", cell_of(names[static_cast<std::size_t>(m.id)]), m.position.x(),
                    m.position.y(), m.covariance(0, 0), m.covariance(0, 1), m.covariance(1, 1), m.sightings);
  return text;
}

std::string_view name_of(Decision decision) {
  constexpr std::array<std::string_view, 4> kNames = {"matched", "created", "rejected", "invalid"};
  return kNames[static_cast<std::size_t>(decision)];
}

std::string csv_of_steps(const Run& run) {
  std::string text = "time_s,sightings,effective_particles,resampled\n";
  for (std::size_t k = 0; k < run.input.steps.size(); ++k) {
    const StepReport& report = run.result.reports[k];
    text += fmt::format("{},{},{},{}\n", run.input.steps[k].time_s, report.observations.size(),
                        report.effective_particles, report.resampled ? 1 : 0);
  }
  return text;
}

/// What the observation itself says, else what it was taken for.
std::string name_in(const Run& run, const Observation& observation, const ObservationReport& report) {
  const LandmarkId id = observation.landmark >= 0 ? observation.landmark : report.landmark;
  return id < 0 ? "" : cell_of(run.input.landmarks[static_cast<std::size_t>(id)]);
}

std::string csv_of_innovations(const Run& run) {
  std::string text = "time_s,landmark,decision,range_innovation_m,bearing_innovation_rad,nis\n";
  for (std::size_t k = 0; k < run.input.steps.size(); ++k) {
    const SlamStep& step = run.input.steps[k];
    for (std::size_t i = 0; i < step.observations.size(); ++i) {
      const ObservationReport& report = run.result.reports[k].observations[i];
      text += fmt::format("{},{},{},", step.time_s, name_in(run, step.observations[i], report),
                          name_of(report.decision));
      text += report.nis > 0.0
                  ? fmt::format("{},{},{}\n", report.innovation.x(), report.innovation.y(), report.nis)
                  : std::string(",,\n");
    }
  }
  return text;
}

void write_results(const Options& options, const Run& run) {
  const std::filesystem::path folder = options.output;
  const std::string head = head_of(run.provenance);
  write_file(folder / "trajectory.csv", head + to_csv(run.trajectory()));
  write_file(folder / "landmarks.csv", head + csv_of(run.map(), run.input.landmarks));
  if (run.smoothed) write_file(folder / "online.csv", head + to_csv(run.result.online));
  write_file(folder / "steps.csv", head + csv_of_steps(run));
  write_file(folder / "innovations.csv", head + csv_of_innovations(run));
  if (run.result.path) write_file(folder / "path.csv", head + to_csv(*run.result.path));
}

nlohmann::ordered_json systematic_of(const Run& run) {
  const PoseEstimate& last = run.last();
  const Vector3 sigma = last.systematic_covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  nlohmann::ordered_json document = nlohmann::ordered_json::array();
  constexpr std::array kNames = {"travel", "turn", "turn_per_m"};
  for (int i = 0; i < 3; ++i)
    document.push_back(
        {{"name", kNames[static_cast<std::size_t>(i)]}, {"value", last.systematic[i]}, {"sigma", sigma[i]}});
  return document;
}

nlohmann::ordered_json smoother_of(const SmootherCounts& counts) {
  return {{"poses", counts.poses},
          {"sightings", counts.sightings},
          {"outliers", counts.outliers},
          {"cost", counts.cost},
          {"degrees_of_freedom", counts.degrees_of_freedom},
          {"iterations", counts.iterations},
          {"starts", counts.starts},
          {"converged", counts.converged}};
}

nlohmann::ordered_json document_of(const Run& run) {
  const SlamCounts& counts = run.result.counts;
  const StampedPose& end = run.trajectory().poses.back();
  nlohmann::ordered_json document = app::to_json(run.provenance);
  document["steps"] = run.input.steps.size();
  document["landmarks"] = run.map().size();
  document["sightings"] = {{"matched", counts.matched},
                           {"created", counts.created},
                           {"rejected", counts.rejected},
                           {"invalid", counts.invalid}};
  document["nis"] = {{"mean", counts.mean_nis}, {"median", counts.median_nis}, {"honest_mean", 2.0}};
  document["resampled_steps"] = counts.resampled;
  document["smallest_effective_share"] = counts.smallest_effective_share;
  document["end"] = {
      {"time_s", end.time_s}, {"x_m", end.pose.x}, {"y_m", end.pose.y}, {"heading_rad", end.pose.heading}};
  document["trajectory"] = run.smoothed ? "smoothed" : "online estimate";
  if (run.smoothed) {
    document["online"] = "online estimate";
    document["smoother"] = smoother_of(run.smoothed->counts);
  }
  if (run.result.path) document["path"] = "whole path of the best particle";
  document["systematic_errors"] = systematic_of(run);
  document["problems"] = nlohmann::ordered_json::array();
  for (const Problem& problem : run.input.problems) document["problems"].push_back(to_json(problem));
  return document;
}

std::string smoother_line(const SmootherCounts& counts) {
  return fmt::format(
      "  smoothed {} poses: {} of {} sightings are outliers; cost {:.1f}, {} degrees of freedom; {} after {} "
      "iterations\n",
      counts.poses, counts.outliers, counts.sightings, counts.cost, counts.degrees_of_freedom,
      counts.converged ? "converged" : "not converged", counts.iterations);
}

std::string text_of(const Options& options, const Run& run) {
  const SlamCounts& counts = run.result.counts;
  const StampedPose& end = run.trajectory().poses.back();
  std::string text = fmt::format("{}: {} landmarks from {} sightings in {} steps\n", options.filter,
                                 run.map().size(), run.input.observations(), run.input.steps.size());
  text += fmt::format("  matched {}, new {}, rejected as outliers {}, invalid {}\n", counts.matched,
                      counts.created, counts.rejected, counts.invalid);
  text +=
      fmt::format("  innovations squared (NIS): mean {:.2f}, median {:.2f}; honest noise has 2.00, 1.39\n",
                  counts.mean_nis, counts.median_nis);
  if (run.result.path)
    text += fmt::format(
        "  resampled in {} steps; effective particles at worst {:.1f} of {}\n", counts.resampled,
        counts.smallest_effective_share * static_cast<double>(options.particles), options.particles);
  if (run.smoothed) text += smoother_line(run.smoothed->counts);
  text += fmt::format("end pose: x {:.4f} m, y {:.4f} m, heading {:.3f}°\n", end.pose.x, end.pose.y,
                      degrees(end.pose.heading));
  text +=
      fmt::format("written to {}: trajectory.csv ({}), {}landmarks.csv, steps.csv, innovations.csv\n",
                  options.output, run.smoothed ? "smoothed), online.csv (online estimate" : "online estimate",
                  run.result.path ? "path.csv (best particle's whole path), " : "");
  for (const Problem& problem : run.input.problems) text += line_of(problem);
  return text;
}

void run(const Options& options) {
  const Run run = filtered(options);
  write_results(options, run);
  print(options.common, document_of(run), text_of(options, run));
}

}  // namespace

void add_slam(CLI::App& app) {
  auto options = std::make_shared<Options>();
  CLI::App* command =
      add_command(app, "slam", "Estimate the trajectory and a map of landmarks from odometry and sightings",
                  "trundle slam recording --robot robot.toml --filter fastslam2 -o out", options->common);
  command->add_option("RECORDING", options->recording, "Recording folder")->required();
  command->add_option("--robot", options->robot, "Robot file with [landmark_sensor]")->required();
  command->add_option("--filter", options->filter, "Which filter")
      ->check(CLI::IsMember(slam_method_names()))
      ->capture_default_str();
  command->add_option("--particles", options->particles, "Particles of the particle filters")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  command->add_option("--seed", options->seed, "Seed of the particle filters' random numbers")
      ->capture_default_str();
  command->add_option("--start", options->start, "Pose at the first stamp: X,Y,DEG [m, m, degrees]")
      ->capture_default_str();
  command->add_flag("--smooth", options->smooth,
                    "Then the most probable trajectory and map given everything seen, before and after");
  command->add_flag("--unknown-ids", options->unknown_ids,
                    "Forget the landmarks' names and find out which is which (--filter ekf)");
  command
      ->add_option(
          "--systematic-sigma", options->systematic_sigma,
          "Estimate the odometry's systematic errors with this prior: share of travel, share of turns, "
          "turn per metre [1, 1, rad/m]")
      ->check(CLI::NonNegativeNumber);
  command->add_option("--robot-number", options->robot_number, "Which robot of a UTIAS MRCLAM folder");
  command->add_option("-o,--output", options->output, "Folder for the results")->required();
  command->callback([options] { run(*options); });
}

}  // namespace trundle::app
