#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "trundle/pipeline/evaluation_answer.hpp"
#include "trundle/pipeline/run_inputs.hpp"
#include "trundle/pipeline/slip_answer.hpp"
#include "trundle/pipeline/stage_runner.hpp"
#include "trundle/report/results.hpp"

namespace trundle::pipeline {

/// A trajectory that a stage gives, as who reads its file gets it.
struct WrittenTrajectory {
  RunTrajectory entry;
  TrackRole role = TrackRole::other;
  TrajectoryFile file;
};

struct HealthCheck {
  InfoResult info;
  std::vector<Misreading> misreadings = {};
  std::vector<std::string> gyro_clock = {};  ///< warnings of it, which hold until a calibration has set it
  std::vector<std::string> steering_clock = {};  ///< likewise
  std::optional<TimeOffset> sensor_clock = {};   ///< the landmark sensor's, of one recording
};

struct CalibratedRobot {
  RobotFile robot;
  bool held_out = false;  ///< the recording was not learned from
  CalibrationDocument document;
};

struct Odometry {
  std::vector<WrittenTrajectory> trajectories;  ///< the last is that of the robot that is used
  OdometryResult result;
};

struct Slip {
  SlipAnswer answer;
  SlipResult result;
  WrittenTrajectory corrected;
};

struct SlamStage {
  std::vector<WrittenTrajectory> trajectories;
  SlamSummary summary;
  std::vector<LandmarkRow> landmarks;
  std::optional<ParticleColumns> particles;
  std::optional<GrowthResult> growth;
  FilterColumns filter;
  SightingColumns sightings;
};

struct EvaluationStage {
  EvaluationSummary summary;
  Trajectory reference;
  std::vector<PositionError> errors;
};

// The stages, each from the values that it needs. They throw NotApplicable, CannotAnswer and InputError.

Found<HealthCheck> check_health(const RunInputs& inputs);
Found<CalibratedRobot> calibrate_robot(const RunInputs& inputs);
/// With the robot that is used and, where that is another, with the one that was given. It warns of what the
/// health check found wrong with the gyro's clock, unless the robot that is used corrects it.
Found<Odometry> integrate_odometry(const RunInputs& inputs, const RobotFile& robot, const HealthCheck* health,
                                   const WriteNow& write_now);
Found<Slip> find_slips(const RunInputs& inputs, const RobotFile& robot, const WriteNow& write_now);
/// Localization and SLAM go on from the odometry that is corrected for slip, where that was found.
Found<WrittenTrajectory> localize_on_map(const RunInputs& inputs, const RobotFile& robot, const Slip* slip);
Found<SlamStage> map_landmarks(const RunInputs& inputs, const RobotFile& robot, const Slip* slip,
                               const OnSteps& on_steps);
Found<EvaluationStage> evaluate_trajectories(const RunInputs& inputs, const RobotFile& robot,
                                             std::span<const WrittenTrajectory> trajectories);
/// As it is printed beside an error.
[[nodiscard]] std::string_view words_of(Alignment alignment);
/// The value is the page's path.
Found<std::filesystem::path> draw_page(const RunInputs& inputs, Results results);

/// What the slip stage asks, and those that go on from it.
SlipQuestion slip_question(const RunInputs& inputs);
/// A trajectory's file.
OutputFile trajectory_csv(const std::filesystem::path& path, const Provenance& provenance,
                          const Trajectory& trajectory);
WrittenTrajectory written(RunTrajectory entry, TrackRole role, const Trajectory& trajectory,
                          const OutputFile& file);
/// The bytes that a command with --json prints.
std::string printed(const nlohmann::ordered_json& document);

}  // namespace trundle::pipeline
