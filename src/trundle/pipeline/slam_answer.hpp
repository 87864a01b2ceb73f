#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "trundle/pipeline/files.hpp"
#include "trundle/pipeline/provenance.hpp"
#include "trundle/pipeline/slam_checkpoint.hpp"
#include "trundle/pipeline/slip_answer.hpp"
#include "trundle/recording/recording.hpp"
#include "trundle/report/growth_result.hpp"
#include "trundle/report/slam_result.hpp"
#include "trundle/slam/slam.hpp"
#include "trundle/slam/smoothing/smoother.hpp"

namespace trundle::pipeline {

/// What `trundle slam` is asked, besides recording and robot.
struct SlamQuestion {
  SlamMethod method = SlamOptions{}.method;
  std::size_t particles = SlamOptions{}.particles;
  std::uint64_t seed = SlamOptions{}.seed;
  Pose2 start = {};                  ///< pose at the first stamp
  std::string start_text = "0,0,0";  ///< the same as it was given
  /// Prior of the odometry's systematic errors [1, 1, rad/m]; nothing: filters take them for 0, the smoother
  /// for unknown as usual.
  std::optional<double> systematic_sigma = {};
  std::optional<PointEstimate> estimate = {};  ///< of the particle filters; nothing: as is usual
  SwarmOptions swarm = {};                     ///< of the filters that have one
  std::optional<double> window_s = {};    ///< of the smoother that goes along: older poses are marginalised
  bool unknown_ids = false;               ///< forget the landmarks' names and find out which is which
  std::optional<SlipQuestion> slip = {};  ///< then the odometry is corrected for slip first, found so
  bool smooth = false;                    ///< then also the most probable trajectory and map of all
  std::size_t smoother_runs = 5;          ///< of a filter, from which that starts where names are missing
  std::size_t threads = 1;                ///< results do not depend on it
  ReadOptions reading = {};               ///< how its recordings are read
  SlamCheckpoints checkpoints = {};
  OnSteps on_steps = {};
  // Of several robots together:
  std::vector<std::string> names = {};  ///< landmarks' names that all share: SlamInputOptions::names
  double marker_sigma_m = 0.0;          ///< 1σ of where on its marker a robot is seen
  std::vector<double> also_at_s = {};   ///< SlamInputOptions::also_at_s
};

struct SlamAnswer {
  Provenance provenance;
  SlamInput input;  ///< with the findings of reading the recording, and names for all landmarks
  SlamResult result;
  std::optional<SmoothedSlam> smoothed;
  double gyro_bias_rad_s = 0.0;               ///< the robot file's, where it has a gyro
  double metre_sigma = 0.0;                   ///< Metre::sigma, which covariances of poses have in them
  std::vector<Finding> inconsistencies = {};  ///< of the run, with its own sigmas; notes last

  bool is_doubtful() const {
    return !inconsistencies.empty() && inconsistencies.front().severity == Severity::warning;
  }
  /// The smoothed ones where there are such.
  const Trajectory& trajectory() const { return smoothed ? smoothed->trajectory : result.online; }
  const std::vector<MappedLandmark>& map() const { return smoothed ? smoothed->map : result.map; }
  const Eigen::MatrixXd& map_covariance() const {
    return smoothed ? smoothed->map_covariance : result.map_covariance;
  }
  const std::vector<BiasEstimate>& bias() const { return smoothed ? smoothed->bias : result.bias; }
  const PoseEstimate& last() const { return smoothed ? smoothed->last : result.last; }
};

/// `slip_found`: the answer to question.slip, where it is there already.
/// Throws as slam_input and slam, CannotAnswer where nothing is seen while the odometry runs, and InputError
/// where the checkpoint is none, or of another recording, robot file or other options.
SlamAnswer answer_slam(const Recording& recording, const RobotFile& robot, const SlamQuestion& question,
                       const SlipAnswer* slip_found = nullptr);

/// The same in two steps: the recording cut into those of a filter, its slips corrected where that is asked;
/// and the estimate.
SlamAnswer begun_slam(const Recording& recording, const RobotFile& robot, const SlamQuestion& question,
                      const SlipAnswer* slip_found = nullptr);
SlamAnswer finished_slam(const Recording& recording, const RobotFile& robot, const SlamQuestion& question,
                         SlamAnswer begun);

/// What was asked, as all outputs name it.
void add_options_of(const SlamQuestion& question, Provenance& provenance);
/// What the odometry errs by all along, of `last`.
nlohmann::ordered_json systematic_json(const SystematicErrors& errors, const PoseEstimate& last);
nlohmann::ordered_json smoother_json(const SmootherCounts& counts);

/// What `trundle slam --json` prints.
nlohmann::ordered_json document_of(const SlamAnswer& answer);

/// What the page draws of that.
SlamSummary slam_summary_of(const SlamAnswer& answer);

/// How the online estimate grew: growth.json. Nothing of a filter that keeps no such.
std::optional<GrowthResult> growth_of(const SlamAnswer& answer);

/// The map, with the names of its landmarks, as landmarks.csv has it.
std::vector<LandmarkRow> landmark_rows_of(const SlamAnswer& answer);

/// trajectory.csv, landmarks.csv, where the filter knows it landmarks_covariance.csv, steps.csv,
/// innovations.csv and, where there is one, path.csv; online.csv where trajectory.csv is the smoothed one.
std::vector<OutputFile> files_of(const SlamAnswer& answer, const std::filesystem::path& folder);
/// Of all that it may give.
std::vector<std::string> slam_file_names();

}  // namespace trundle::pipeline
