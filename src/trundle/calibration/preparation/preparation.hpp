#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "trundle/calibration/preparation/channel_assignment.hpp"
#include "trundle/calibration/problem/run.hpp"

namespace trundle::calibration {

/// Recordings made ready for calibration, and a robot near enough to them for a search to start from. What
/// had to be done for it, in words; empty: nothing.
struct Preparation {
  ChannelAssignment channels;  ///< with the robot as given, its channels put right
  /// That robot, with the velocity's lag, the clocks of steering and gyro, the gyro's noise and the wheels'
  /// scale as the runs show.
  Robot start;
  std::vector<Run> runs;                      ///< those that tell something
  std::optional<std::string> velocity_lag;    ///< how it was set, if it was
  std::optional<std::string> steering_clock;  ///< the same
  std::optional<std::string> gyro_clock;      ///< the same
  std::optional<std::string> clocks_apart;    ///< of steering and gyro, if nothing tells which is wrong
  std::optional<std::string> gyro_noise;      ///< the same
  /// The same of the reference's clock, where runs share it.
  std::optional<std::string> reference_clock;
  std::string sensor_heading;       ///< what is wrong with where the reference sensor looks
  std::string scale;                ///< what is wrong with the wheels' sizes
  std::vector<std::string> silent;  ///< runs that were left out, and why
};

struct PrepareOptions {
  /// One offset of the reference's clock is to be estimated for all runs: it starts where they have it in the
  /// mean.
  bool frees_reference_clock = false;
  bool keeps_lag = false;  ///< of a velocity, as the robot file has it
};

/// Throws CannotAnswer where gyro and wheels turn opposite ways and no reference tells which is right, or
/// where a unit is wrong.
[[nodiscard]] Preparation prepare(std::span<const Recording> recordings, const Robot& given,
                                  const PrepareOptions& options = {});

/// Sets the gyro's noise by the rests, where it is louder there than the robot says: in motion it is no
/// quieter. Returns what was
/// done, in words.
std::optional<std::string> set_gyro_noise(std::span<const Recording> recordings, Robot& robot);

/// All of them, by a robot.
[[nodiscard]] std::vector<Run> prepare_runs(std::span<const Recording> recordings, const Robot& robot);

}  // namespace trundle::calibration
