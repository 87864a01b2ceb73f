#pragma once

#include <string>
#include <vector>

#include "trundle/pipeline/stages.hpp"

namespace trundle::pipeline {

/// What the stages of a run gave; null: nothing.
struct RunFindings {
  const RobotFile& robot;  ///< that was used
  const HealthCheck* health = nullptr;
  const CalibratedRobot* calibration = nullptr;
  Odometry* odometry = nullptr;
  Slip* slip = nullptr;
  WrittenTrajectory* localization = nullptr;
  SlamStage* slam = nullptr;
  const EvaluationStage* evaluation = nullptr;
};

/// Moved out of the stages, in the order in which each improves on the one before: a long run's are large.
std::vector<WrittenTrajectory> take_trajectories(const RunFindings& found);

/// run.mcap or run.wpilog, whichever is asked for: all trajectories with every pose, the reference, the map
/// of slam, and the slips. The value is its path.
Found<std::filesystem::path> write_viewer_file(const RunInputs& inputs, const RunFindings& found,
                                               const std::vector<WrittenTrajectory>& trajectories,
                                               const WriteNow& write_now);

/// For the page, with these trajectories: what read_results gives of the folder.
Results results_of(const RunFindings& found, std::vector<WrittenTrajectory> trajectories,
                   const RunRecord& record, const std::string& label);

}  // namespace trundle::pipeline
