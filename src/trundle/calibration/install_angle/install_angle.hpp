#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "trundle/chassis/robot.hpp"
#include "trundle/recording/recording.hpp"

namespace trundle::calibration {

/// An L-shaped run of a robot with two passive wheels: straight ahead until pod 2, which rolls along body x,
/// has seen `side_m` and pod 1 nothing; then sideways until pod 1 has seen as much and pod 2 nothing. The
/// robot does not turn. Driven backwards or to the other side, it is the same with signs.
struct LRun {
  double side_m = 0.0;   ///< > 0, as pod 2 reads it
  double end_x_m = 0.0;  ///< where the robot really ends, in the frame of its start pose
  double end_y_m = 0.0;
  double leg_ratio = 1.0;  ///< second leg as pod 1 reads it over the first as pod 2 does, where they differ

  bool mirrored() const { return end_x_m * end_y_m < 0.0; }
};

/// What the error of the start heading is alike in.
enum class StartHeading {
  one_alignment,  ///< one line served all runs: its error is in all of them, and averaging leaves it
  each_run,       ///< aligned anew for every run: it averages
};

struct InstallAngleOptions {
  double sigma_m = kDefaultPositionSigma;           ///< of each end coordinate [m]
  double sigma_heading_rad = kDefaultHeadingSigma;  ///< of how well the start heading was set [rad]
  StartHeading start_heading = StartHeading::one_alignment;
};

struct InstallAngle {
  double alpha_rad =
      0.0;  ///< mounting error of pod 1: its rolling direction is θ = 90° − α from that of pod 2
  double theta_rad = 0.0;
  /// Of both, from the measuring sigmas; where the runs scatter by more, from their scatter.
  double sigma_rad = 0.0;
  bool sigma_from_scatter = false;
  double scale = 1.0;                 ///< X/S: what pod 2 really rolls for each metre that it reads
  double scale_sigma = 0.0;           ///< from the measuring sigmas
  std::vector<double> run_alpha_rad;  ///< of each run alone
  double measuring_rad = 0.0;  ///< 1σ by which runs differ from each other as far as measuring explains it
  std::optional<double> scatter_rad;  ///< standard deviation of runs of one sense; nothing: no repeats
  int scatter_freedom = 0;            ///< degrees of freedom of that
  /// Half of what mirrored runs give more than the others [rad]: by so much pod 1 rolls further than pod 2
  /// for what it reads (0.01 is 1 %). It cancels in `alpha_rad`; in runs of one sense it does not. Nothing:
  /// one sense only.
  std::optional<double> between_senses_rad;
  double between_senses_sigma_rad = 0.0;  ///< the start heading that all runs share cancels in it
  std::vector<std::string> warnings;
};

/// θ = 2 θ₁ with θ₁ the direction from start to end: docs/theory/dead-wheels.md, eq. 2 to 4. Throws
/// InputError for numbers that are none, CannotAnswer where the ends are not those of an L or the sigmas
/// leave the angle open.
InstallAngle install_angle(std::span<const LRun> runs, const InstallAngleOptions& options = {});

/// The L-shaped run that a recording holds, its end from the reference. Throws InputError for a robot that
/// has not exactly two wheels, at right angles more or less; CannotAnswer for a run that is no L and without
/// an end pose.
LRun l_run_of(const Recording& recording, const Robot& robot);

}  // namespace trundle::calibration
