#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "trundle/pipeline/slam_answer.hpp"
#include "trundle/slam/smoothing/together.hpp"

namespace trundle::pipeline {

/// A robot of several that drove in one world, all by one clock.
struct TeamRobot {
  Recording recording;
  RobotFile robot;
};

/// What `trundle slam --together` gives.
struct TogetherAnswer {
  Provenance provenance;
  std::vector<std::string> names = {};            ///< of the robots: their recordings', each once
  std::vector<SystematicErrors> systematic = {};  ///< by robot: what its errors are
  std::vector<double> gyro_bias_rad_s = {};       ///< by robot: the robot file's; 0 without a gyro
  std::vector<std::string> landmarks = {};        ///< name of each LandmarkId
  JointSlam joint = {};
  /// The online estimates of robots that saw landmarks, each of the robot alone, from where all together
  /// place its start, by the clock of the first.
  std::vector<GrowthResult> growth = {};
  std::vector<Finding> findings = {};
  double metre_sigma = 0.0;                   ///< as of SlamAnswer, of what all have in common
  std::vector<Finding> inconsistencies = {};  ///< of the run, with its own sigmas
};

/// Each robot alone first (answer_slam, with --smooth), then all at once (smooth_together). Sightings whose
/// name is another recording's `seen_as` are of that robot. Throws as those, and InputError where two
/// recordings are seen under one name.
TogetherAnswer answer_together(std::vector<TeamRobot> team, const SlamQuestion& question);

nlohmann::ordered_json document_of(const TogetherAnswer& answer);

/// What files_of() may write, and what `slam` of one robot does; from the folder.
std::vector<std::string> together_file_names(const TogetherAnswer& answer);

/// slam.json, landmarks.csv, landmarks_covariance.csv, and in a folder for each robot trajectory.csv and
/// growth.json.
std::vector<OutputFile> files_of(const TogetherAnswer& answer, const std::filesystem::path& folder);

}  // namespace trundle::pipeline
