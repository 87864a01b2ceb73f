#pragma once

#include <optional>
#include <string>
#include <vector>

#include "trundle/chassis/robot.hpp"
#include "trundle/inspection/overview.hpp"
#include "trundle/recording/recording.hpp"

namespace trundle::inspection {

/// Whether it was found that a wheel's readings are not its turns.
[[nodiscard]] bool has_dead_counts(const std::vector<Finding>& problems);

/// What is wrong with a recording beyond its rows: counters that start again, encoders that are stuck.
/// Where no robot says a counter's bits they are guessed from its range.
std::vector<Finding> inspect(const Recording& recording, const Robot* robot = nullptr);

/// The same where the recording suits the robot: what aligning found, encoders that are stuck although the
/// other sensors see the wheel roll, a gyro that turns the other way than the wheels or in degrees.
std::vector<Finding> inspect(const Recording& recording, const Robot& robot, const Overview& overview);

/// A column, a unit or a clock is not what it was taken for: what else may be found follows from it.
bool is_misreading(const Finding& finding);

/// A wheel or the gyro has the wrong sign, or a column is another wheel's. A calibration may put it right.
bool is_miswiring(const Finding& finding);

/// One stream at a glance.
struct StreamSummary {
  std::string stream;
  std::vector<std::string> columns;  ///< of wheels
  std::size_t rows = 0;
  double start_s = 0.0;
  double end_s = 0.0;
  double rate_hz = 0.0;  ///< without gaps; 0: unknown
  std::size_t gaps = 0;  ///< steps longer than max(0.5 s, 5 median steps)
  double longest_step_s = 0.0;
};
std::vector<StreamSummary> summaries_of(const Recording& recording);

/// What the steering of one wheel reads, before zero and scale of the robot file. In degrees; in ticks where
/// nothing says how many are a revolution.
struct SteeringSummary {
  std::string wheel;
  bool in_ticks = false;
  double rate_hz = 0.0;  ///< of its readings, without gaps; 0: unknown
  double least = 0.0;
  double greatest = 0.0;
  double fastest_per_s = 0.0;          ///< change from one reading to the next, the short way round
  std::optional<double> at_rest = {};  ///< median where no wheel moved since the row before; nothing: nowhere
};
/// Of each steering that was read at all. `robot`: for its ticks.
std::vector<SteeringSummary> steerings_of(const Recording& recording, const Robot* robot);

/// What is missing in a recording for calibration and odometry, and what to add, in sentences. Without a
/// robot: in general.
std::vector<std::string> missing_in(const Recording& recording, const Robot* robot);
/// Of that, what the robot file lacks of sensors that were recorded.
std::vector<std::string> unused_in(const Recording& recording, const Robot& robot);

/// What the robot's sensors can and cannot determine, in sentences.
struct Abilities {
  std::vector<std::string> can;
  std::vector<std::string> cannot;
};
Abilities abilities_of(const Robot& robot, bool with_gyro);

}  // namespace trundle::inspection
