#pragma once

#include <span>
#include <string>
#include <vector>

#include "trundle/slam/smoothing/smoother.hpp"

namespace trundle::slam {

/// A robot of several that drove in one world: what it recorded, and a first estimate of its path.
struct RobotRecording {
  const SlamInput& input;  ///< with steps at the stamps of all RobotSightings of it and by it
  const LandmarkSensor& sensor;
  SlamPrior prior = {};   ///< its start counts for the first robot alone: it is the frame of the result
  std::string name = {};  ///< for messages
  ShownObservations shown = {};  ///< with landmarks' numbers that all robots share
  Trajectory path = {};  ///< after each step, in any frame; of a robot that saw no landmark: its odometry's
  Systematic systematic = {};                ///< what its systematic errors were taken for
  double metre_sigma = 0.0;                  ///< 1σ of what its ranges and ways are too long by, as a share
  double marker_sigma_m = 0.0;               ///< 1σ of where on its marker others see it
  Vector2 marker_on_body = Vector2::Zero();  ///< what others see of it [m]
};

/// One robot seen by another.
struct RobotSighting {
  std::size_t seer = 0;
  std::size_t seer_step = 0;  ///< of its input, at the sighting's stamp
  std::size_t seen = 0;
  std::size_t seen_step = 0;     ///< likewise
  Observation observation = {};  ///< of the marker; its landmark means nothing
};

/// What is known of one of the robots, in the frame of all.
struct RobotEstimate {
  Trajectory trajectory;   ///< after each step, with covariance
  PoseEstimate last = {};  ///< after the last step, with the odometry's systematic errors
  std::vector<BiasEstimate> bias = {};
  double metre = 0.0;         ///< what its ranges and ways are too long by, as a share, beside what all are
  double metre_sigma = 0.0;   ///< 1σ of it
  std::size_t poses = 0;      ///< keyframes
  std::size_t landmarks = 0;  ///< that it saw
  std::size_t sightings = 0;  ///< of landmarks
  std::size_t outliers = 0;   ///< of them
  std::size_t robot_sightings = 0;  ///< of other robots
  std::size_t robot_outliers = 0;   ///< of them
  double robot_nis = 0.0;           ///< median |f|² of what it saw of robots; 1.39 if consistent
  double nis = 0.0;                 ///< the same of landmarks; 0: it saw nothing
};

/// The most probable trajectories and the one map, given everything that all robots saw.
struct JointSlam {
  std::vector<RobotEstimate> robots;
  std::vector<MappedLandmark> map;
  Eigen::MatrixXd map_covariance;  ///< of all of them, x and y of each
  SmootherCounts counts;           ///< its sightings are those of landmarks and robots
};

/// One least-squares problem of all robots: each has its chain of poses, systematic errors, gyro bias, sensor
/// and metre; landmarks are shared by their numbers, sightings of robots link two chains; the first robot's
/// start is the frame, those of others are unknown. docs/theory/together.md. Throws CannotAnswer where a
/// robot shares too little with the others for its place among them to be known.
[[nodiscard]] JointSlam smooth_together(std::span<const RobotRecording> robots,
                                        std::span<const RobotSighting> seen,
                                        const SmootherOptions& options = {});

}  // namespace trundle::slam
