#pragma once

#include <cstdint>
#include <vector>

#include "trundle/chassis/robot.hpp"
#include "trundle/recording/recording.hpp"
#include "trundle/simulation/path.hpp"

namespace trundle::simulation {

/// Which of the two robots drives the path exactly.
enum class Steering {
  odometry,  ///< the nominal one: its wheels turn as the path asks of the nominal robot; the true one ends
             ///< elsewhere
  truth,     ///< the true one: the wheels turn as the true motion makes them
};

struct EncoderOptions {
  double rate_hz = 20.0;
  WheelUnit unit = WheelUnit::ticks;
  bool quantised = true;  ///< ticks are whole; false: for tests that need exact numbers
  bool wrapped = true;    ///< at the wheel's tick_bits
};

/// Used when the robot has steered wheels.
struct SteeredOptions {
  /// Over which velocities, and with them the angles, pass from those of one segment to those of the next; at
  /// least one sampling interval.
  double ramp_s = 0.25;
  WheelUnit unit = WheelUnit::radians;  ///< of the readings; or ticks, which are whole
};

/// Used when the true robot has a gyro. A reading is the mean rate since the reading before.
struct GyroOptions {
  double rate_hz = 100.0;
};

struct SightingOptions {
  double rate_hz = 0.0;                  ///< 0: no sightings
  double field_of_view_rad = 2.0 * kPi;  ///< around the sensor's x axis
  double detection = 1.0;                ///< probability that a landmark in view is reported
  bool hide_names = false;               ///< sightings come unnamed and in random order
  bool give_map = true;                  ///< the recording holds the landmarks' true positions
};

struct TimeSpan {
  double start_s = 0.0;
  double duration_s = 0.0;

  [[nodiscard]] double end_s() const { return start_s + duration_s; }
};

/// The reference stream: poses of the reference sensor in the world.
struct ReferenceOptions {
  double rate_hz = 0.0;  ///< 0: no stream
  bool with_heading = true;
  double position_sigma_m = 0.0;  ///< white, of x and of y
  double heading_sigma_rad = 0.0;
  double wander_sigma_m = 0.0;  ///< slow error of the position, first-order Gauss–Markov, of x and of y
  double wander_time_s = 10.0;  ///< over which it is forgotten
  double outlier_share = 0.0;   ///< of samples that are off by up to outlier_m in x and in y
  double outlier_m = 0.5;
  std::vector<TimeSpan> gaps = {};  ///< true time; nothing is reported inside
};

/// What is measured of the run as a whole, between the reference sensor's first and last pose.
struct PartialReferenceOptions {
  bool end_pose = false;  ///< in the frame of the start pose
  bool distance = false;  ///< straight line from start to end
  bool turns = false;     ///< net full turns
  bool closed = false;    ///< claims that the run ended where and how it started; the claim is not checked
  double position_sigma_m = 0.001;
  double heading_sigma_rad = 0.001;
};

/// A wheel that turns more, or less, than the ground passes below it.
struct SlipBurst {
  int wheel = 0;
  TimeSpan span;            ///< true time
  double factor = 1.0;      ///< wheel travel = factor · ground travel; 0: the wheel is locked
  double excess_m_s = 0.0;  ///< and this much more, in the wheel's own direction
};

/// Bursts at random times on random wheels, none overlapping another.
struct RandomSlips {
  int count = 0;
  double shortest_s = 0.3;
  double longest_s = 1.0;
  double least_factor = 1.3;
  double greatest_factor = 2.0;
};

/// Everything that one simulated run depends on. Equal scenarios give equal recordings.
struct Scenario {
  Robot nominal;  ///< the robot as its file says
  Robot truth;    ///< as it is: geometry, diameters, gyro, noise, sensor poses, time offsets
  Pose2 start;    ///< world_from_body of both
  Path path;
  Steering steering = Steering::odometry;
  bool whole_intervals =
      true;  ///< segments last whole sampling intervals: counts without noise integrate exactly
  EncoderOptions encoders;
  SteeredOptions steered;
  GyroOptions gyro;
  SightingOptions sightings;
  ReferenceOptions reference;
  PartialReferenceOptions partial;
  std::vector<Landmark> landmarks;
  std::vector<SlipBurst> slips;
  RandomSlips random_slips;
  double start_s = 0.0;  ///< stamp of true time 0
  std::uint64_t seed = 1;
};

/// A slip as it was.
struct SlipTruth {
  int wheel = 0;
  TimeSpan span;          ///< true time
  double excess_m = 0.0;  ///< wheel travel − ground travel
  double ground_m = 0.0;  ///< what the ground passed below the wheel

  [[nodiscard]] bool spins() const { return excess_m * ground_m >= 0.0; }  ///< else it skids
};

/// What really happened.
struct Truth {
  Trajectory body;  ///< world_from_body by stamp (true time + start_s); constant twist between neighbours, so
                    ///< pose_at() is exact
  std::vector<SlipTruth> slips;
  double last_gyro_bias_rad_s = 0.0;  ///< after its walk
};

struct Simulation {
  Recording recording;
  Truth truth;
};

/// Drives the path and reads the sensors. Each sensor has its own stream of random numbers: adding one does
/// not change the readings of another. Throws CannotAnswer when the robot steers by odometry that cannot see
/// its motion. Equations: docs/theory/simulation.md.
[[nodiscard]] Simulation simulate(const Scenario& scenario);

/// `count` landmarks uniform in a box around the origin, at least `spacing_m` apart where that can be met,
/// named 1, 2, ...
[[nodiscard]] std::vector<Landmark> random_landmarks(int count, double box_x_m, double box_y_m,
                                                     double spacing_m, Random& random);

}  // namespace trundle::simulation
