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
  const Odometry* odometry = nullptr;
  const Slip* slip = nullptr;
  const WrittenTrajectory* localization = nullptr;
  const SlamStage* slam = nullptr;
  const EvaluationStage* evaluation = nullptr;
};

/// In the order in which each improves on the one before.
std::vector<WrittenTrajectory> trajectories_of(const RunFindings& found);

/// For the page: what read_results gives of the folder.
Results results_of(const RunFindings& found, const RunRecord& record, const std::string& label,
                   std::vector<ResultSource> sources);

}  // namespace trundle::pipeline
