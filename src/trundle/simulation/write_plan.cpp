#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include <fmt/format.h>

#include "trundle/io/file.hpp"
#include "trundle/io/interruption.hpp"
#include "trundle/io/staging.hpp"
#include "trundle/recording/trajectory_file.hpp"
#include "trundle/simulation/scenario_file.hpp"

namespace trundle::simulation {
namespace {

// Files hold what a careful logger would write, in steps of
constexpr double kTimeDecimals = 1e6;    // 1 µs
constexpr double kLengthDecimals = 1e6;  // 1 µm
constexpr double kAngleDecimals = 1e7;   // 0.1 µrad; of rates and of what wheels count, too

void round_to(double& value, double decimals) {
  value = std::round(value * decimals) / decimals;
}

void round_to(std::vector<double>& values, double decimals) {
  for (double& value : values) round_to(value, decimals);
}

Recording rounded(Recording recording) {
  round_to(recording.wheels.time_s, kTimeDecimals);
  for (WheelSeries& series : recording.wheels.series) round_to(series.value, kAngleDecimals);
  for (WheelSeries& series : recording.wheels.steering) round_to(series.value, kAngleDecimals);
  round_to(recording.gyro.time_s, kTimeDecimals);
  round_to(recording.gyro.yaw_rate_rad_s, kAngleDecimals);
  round_to(recording.velocity.time_s, kTimeDecimals);
  round_to(recording.velocity.forward_m_s, kAngleDecimals);
  round_to(recording.velocity.yaw_rate_rad_s, kAngleDecimals);
  round_to(recording.reference.time_s, kTimeDecimals);
  round_to(recording.reference.x_m, kLengthDecimals);
  round_to(recording.reference.y_m, kLengthDecimals);
  round_to(recording.reference.heading_rad, kAngleDecimals);
  for (Sighting& sighting : recording.sightings) {
    round_to(sighting.time_s, kTimeDecimals);
    round_to(sighting.range_m, kLengthDecimals);
    round_to(sighting.bearing_rad, kAngleDecimals);
  }
  for (Landmark& landmark : recording.landmarks) {
    round_to(landmark.position.x(), kLengthDecimals);
    round_to(landmark.position.y(), kLengthDecimals);
  }
  return recording;
}

Trajectory rounded(Trajectory trajectory) {
  for (auto& [time_s, pose] : trajectory.poses) {
    round_to(time_s, kTimeDecimals);
    round_to(pose.x, kLengthDecimals);
    round_to(pose.y, kLengthDecimals);
    round_to(pose.heading, kAngleDecimals);
  }
  return trajectory;
}

std::string comments(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += "# " + line + "\n";
  return text;
}

/// The layout of slip.csv, as it really was.
std::string slips_csv(const Scenario& scenario, const Truth& truth) {
  std::string text = "start_s,end_s,wheel,kind,excess_m\n";
  for (const SlipTruth& slip : truth.slips)
    text += fmt::format("{:.6f},{:.6f},{},{},{:.6f}\n", slip.span.start_s + scenario.start_s,
                        slip.span.end_s() + scenario.start_s,
                        scenario.nominal.wheel_names[static_cast<std::size_t>(slip.wheel)],
                        slip.spins() ? "spin" : "skid", slip.excess_m);
  return text;
}

/// What a careful person would say of the reference.
ReferenceSigmas noise_of(const ReferenceOptions& reference) {
  if (reference.rate_hz <= 0.0) return {};
  return {std::hypot(reference.position_sigma_m, reference.wander_sigma_m), reference.heading_sigma_rad};
}

void write_run(const PlannedRun& run, const std::filesystem::path& folder, const std::string& head) {
  Simulation simulation = simulate(run.scenario);
  simulation.recording.name = run.name;
  simulation.recording.session = run.session;
  simulation.recording.reference_noise = noise_of(run.scenario.reference);
  write_recording(rounded(std::move(simulation.recording)), folder);
  const auto description = folder / "recording.toml";
  write_file(description, head + read_file(description));
  write_file(folder / "truth.csv", head + recording::to_csv(rounded(simulation.truth.body)));
  if (!simulation.truth.slips.empty())
    write_file(folder / "truth_slip.csv", head + slips_csv(run.scenario, simulation.truth));
}

/// The files of the runs and of the sheet; the robot file may be the one that the scenario was read with.
std::vector<std::filesystem::path> outputs_of(const Plan& plan, const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files = {folder / "sheet.csv", folder / "truth.toml"};
  for (const PlannedRun& run : plan.runs) {
    check_interruption();
    const auto its_folder = folder_of(plan, run, folder);
    for (const char* name : {"recording.toml", "truth.csv", "truth_slip.csv"})
      files.push_back(its_folder / name);
    files.push_back(its_folder.parent_path() / "truth.toml");
  }
  return files;
}

bool is_input(const Plan& plan, const std::filesystem::path& path) {
  std::error_code missing;
  return std::ranges::any_of(plan.inputs, [&](const InputFile& input) {
    return std::filesystem::equivalent(input.path, path, missing);
  });
}

/// What a simulation writes of some scenarios only.
constexpr std::array kFilesOfARun = {"wheels.csv",    "gyro.csv",      "velocity.csv",  "sightings.csv",
                                     "reference.csv", "landmarks.csv", "truth_slip.csv"};

/// The names of what an earlier simulation may have left in the folders: not of what was really recorded.
std::set<std::string> left_in(const Plan& plan, const std::filesystem::path& folder) {
  std::set<std::string> names;
  for (const PlannedRun& run : plan.runs) {
    check_interruption();
    const auto its_folder = folder_of(plan, run, folder);
    if (!std::filesystem::exists(its_folder / "truth.csv")) continue;
    for (const char* name : kFilesOfARun)
      names.insert((its_folder / name).lexically_relative(folder).generic_string());
  }
  std::erase_if(names, [&](const std::string& name) { return is_input(plan, folder / name); });
  return names;
}

void write_all(const Plan& plan, const std::filesystem::path& folder, bool with_robot,
               const std::string& head) {
  for (const PlannedRun& run : plan.runs) {
    check_interruption();
    const auto its_folder = folder_of(plan, run, folder);
    write_run(run, its_folder, head);
    const auto beside = plan.runs.size() == 1 ? folder : its_folder.parent_path();
    write_file(beside / "truth.toml", head + to_toml(run.scenario.truth));
  }
  const Scenario& common = plan.runs.empty() ? plan.sheet->scenario : plan.runs.front().scenario;
  if (with_robot) write_file(folder / "robot.toml", head + to_toml(common.nominal));
  if (!plan.sheet) return;
  const std::string rows =
      to_csv(simulate_sheet(plan.sheet->scenario, plan.sheet->plan), plan.sheet->plan.side_m);
  write_file(folder / "sheet.csv", head + rows);
  if (plan.runs.empty()) write_file(folder / "truth.toml", head + to_toml(common.truth));
}

}  // namespace

std::filesystem::path folder_of(const Plan& plan, const PlannedRun& run,
                                const std::filesystem::path& folder) {
  return plan.runs.size() == 1 ? folder : folder / run.session / run.name;
}

void write_plan(const Plan& plan, const std::filesystem::path& folder,
                const std::vector<std::string>& provenance) {
  require_apart(plan.inputs, outputs_of(plan, folder));
  ResultFolder results(folder);
  // The robot file may be the one that the scenario was read with.
  write_all(plan, results.staged(), !is_input(plan, folder / "robot.toml"), comments(provenance));
  results.commit(left_in(plan, folder), "recording.toml");
}

}  // namespace trundle::simulation
