#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "trundle/recording/recording.hpp"
#include "trundle/report/slam_result.hpp"
#include "trundle/slam/report.hpp"
#include "trundle/slip/slip_odometer.hpp"

namespace trundle::pipeline {

/// One line of input of `trundle live`: docs/live.md.
struct LiveLine {
  double time_s = 0.0;
  std::vector<std::pair<std::string, double>> wheels;  ///< by the names of their columns
  std::optional<double> yaw_rate_rad_s = {};
  std::vector<Sighting> sightings = {};  ///< all of the line's stamp
  bool wants_map = false;
};

/// Throws InputError with `place`, what stands there, what was expected.
LiveLine parse_live_line(std::string_view line, std::string_view place);

/// Pose with the slips that were found by now corrected, and what was found.
struct LiveSlip {
  Pose2 pose;
  Matrix3 covariance;
  bool slipping = false;               ///< as far as is known by now
  std::optional<SlipVerdict> verdict;  ///< on the interval that this reading completes; else to be revised
};

/// Where the robot is among what it has seen.
struct LiveSlamPose {
  Pose2 pose;
  Matrix3 covariance;
  std::size_t landmarks = 0;  ///< of the map
};

/// What became of one sighting: a row of innovations.csv.
struct LiveSightingReport {
  std::string landmark;  ///< empty: none of the map
  ObservationReport report;
};

/// What is known after sightings have counted: a row of the trajectory of `trundle slam`.
struct LiveSighted {
  double time_s = 0.0;  ///< on the odometry's clock
  LiveSlamPose slam;
  std::vector<LiveSightingReport> sightings;
};

/// What is known after one reading of the wheels.
struct LiveEstimate {
  double time_s = 0.0;
  Pose2 pose;  ///< from the readings as they are
  Matrix3 covariance;
  bool at_rest = false;
  std::optional<GyroBias> gyro_bias;
  std::optional<LiveSlip> slip;           ///< where the robot's sensors can show it
  std::optional<LiveSlamPose> slam = {};  ///< once something has been seen

  /// What a controller takes: corrected for slip where that is known.
  const Pose2& best_pose() const { return slip ? slip->pose : pose; }
  const Matrix3& best_covariance() const { return slip ? slip->covariance : covariance; }
  bool slipping() const { return slip && slip->slipping; }
};

/// One line of output, without its end. docs/live.md.
std::string line_of(const LiveEstimate& estimate, const Robot& robot);
std::string line_of(const LiveSighted& sighted);
/// The map, asked for at a stamp.
std::string line_of(double time_s, const std::vector<LandmarkRow>& map);

}  // namespace trundle::pipeline
