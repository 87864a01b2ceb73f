#pragma once

#include <functional>
#include <string>
#include <vector>

#include "trundle/odometry/odometer.hpp"
#include "trundle/recording/alignment/align.hpp"

namespace trundle::odometry {

/// Takes poses in order, each with its covariance: the total one, or zero where none is asked for.
using TakePose = std::function<void(const StampedPose& pose, const Matrix3& covariance)>;

struct IntegrateOptions {
  Pose2 start = {};                            ///< pose at the first stamp
  Matrix3 start_covariance = Matrix3::Zero();  ///< of (x, y, heading) in world axes
  bool with_covariance = true;                 ///< false: much faster
  /// Learns the gyro's bias where the robot stands still (needs the covariance). Where the calibration knows
  /// how far the bias moves from session to session, it starts with that sigma, else with the gyro's.
  bool learn_gyro_bias = true;
  bool smooth = false;  ///< every pose by what was learned before and after it (needs learn_gyro_bias)
  bool keep_white_covariances = false;  ///< of every pose, not of the last alone (needs the covariance)
  TakePose take = {};                   ///< has the poses as they come: the result keeps none of them
  /// Of the poses, by their numbers: those that the result keeps. None: all.
  std::function<bool(std::size_t pose)> keeps = {};
  /// What stands for each increment, asked for one after the other: corrected readings.
  std::function<Increment(const Increment&)> corrected = {};
};

/// What was believed of the gyro's bias at a time.
struct GyroBiasAt {
  double time_s = 0.0;
  double rad_s = 0.0;
  double sigma_rad_s = 0.0;
  bool at_rest = false;
};

/// A trajectory with its evidence.
struct IntegratedOdometry {
  Trajectory trajectory;  ///< with the total covariance: white + parameter part
  std::size_t poses = 0;  ///< in it, or taken
  double start_s = 0.0;   ///< stamp of the first of them
  StampedPose end;        ///< the last
  Matrix3 end_covariance = Matrix3::Zero();
  Matrix3 end_white_covariance = Matrix3::Zero();  ///< the part from noise alone, at the end
  std::vector<Matrix3> white_covariances;          ///< the same of each pose, where they are kept
  /// The part from the calibrated parameters, at the end; zero when the robot has no calibration.
  Matrix3 end_parameter_covariance = Matrix3::Zero();
  std::vector<std::string> parameters;  ///< whose uncertainty was carried along
  PoseSensitivity end_sensitivity;      ///< ∂(end pose)/∂p in world axes, columns as `parameters`
  double path_length_m = 0.0;
  int degrees_of_freedom = 0;  ///< measured rows beyond those that the motion needs: what could show slip
  std::size_t bridged = 0;     ///< intervals that span a gap
  double rest_s = 0.0;         ///< how long the robot stood still; only where the gyro's bias is learned
  GyroBias end_gyro_bias;      ///< the same
  /// Every second, and where rests begin and end; the same.
  std::vector<GyroBiasAt> gyro_bias;
  std::vector<Finding> findings;
};

/// The odometry of a recording: a loop over Odometer::step, from `start` at the first stamp.
/// The parameters' covariance is that of robot.calibration where present.
/// Throws CannotAnswer when the chassis, or what the recording holds of it, cannot determine the motion,
/// InputError when the calibration names a parameter that the robot does not have.
IntegratedOdometry integrate(const AlignedReadings& readings, const Robot& robot,
                             const IntegrateOptions& options = {});
IntegratedOdometry integrate(const Recording& recording, const Robot& robot,
                             const IntegrateOptions& options = {});

}  // namespace trundle::odometry
