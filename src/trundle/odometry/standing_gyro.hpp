#pragma once

#include <vector>

#include "trundle/odometry/rest.hpp"

namespace trundle::odometry {

/// A stretch over which no wheel turns while the gyro reads a steady rate that its bias does not explain.
struct SteadyReading {
  double start_s = 0.0;
  double duration_s = 0.0;
  double gyro_rad = 0.0;  ///< its integral over the stretch
  GyroBias bias;          ///< as known at its end

  double rate_rad_s() const { return gyro_rad / duration_s; }
};

/// Finds where a rest was refused by the mean of the gyro alone: the bias is beyond what was known of it, or
/// the robot was turned with its wheels still. The readings cannot say which; that they disagree is to be
/// said. Wheels, scatter of the gyro and accelerometer are judged as by RestDetector. docs/theory/gyro.md.
class StandingGyro {
 public:
  StandingGyro(const Chassis& chassis, const RestOptions& options);

  /// `at_rest`: by the RestDetector that knows the bias.
  void watch(const Increment& increment, bool at_rest, const GyroBias& bias);
  /// Those found so far; ends the present one.
  std::vector<SteadyReading> found();

 private:
  void close();
  bool beyond_bias() const;

  RestDetector detector_;
  RestOptions options_;
  double unseen_turn_rad_ = 0.0;  ///< that no counter needs to have seen
  RestState state_;
  SteadyReading present_;
  std::vector<SteadyReading> found_;
};

}  // namespace trundle::odometry
