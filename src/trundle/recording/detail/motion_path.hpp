#pragma once

#include <optional>
#include <vector>

#include "trundle/geometry/trajectory.hpp"
#include "trundle/recording/alignment/align.hpp"

namespace trundle::recording {

/// Where the body is at any time, by the sensors on board or by a trajectory: at constant twist within each
/// interval.
struct MotionPath {
  std::vector<double> time_s;
  std::vector<Pose2> poses;
  std::vector<Twist2> twists;  ///< from each pose to the next
  std::vector<bool> bridged;   ///< the same: across a gap

  /// Whether motion is known from one time to a later one.
  [[nodiscard]] bool covers(double start_s, double end_s) const;
  /// At a time from the first to before the last.
  [[nodiscard]] Pose2 at(double time) const;
};

/// By wheels alone where they tell the motion, else with the gyro; nothing where that is not enough.
[[nodiscard]] std::optional<MotionPath> motion_path(const AlignedReadings& readings, const Robot& robot);
/// By the twist of each increment; `lost`: across a gap. Nothing of none.
[[nodiscard]] std::optional<MotionPath> motion_path(const AlignedReadings& readings,
                                                    std::vector<Twist2> twists, std::vector<bool> lost);
/// Of poses of the body; neighbours that are more than `longest_gap_s` apart have a gap between them. Nothing
/// of fewer than two poses.
[[nodiscard]] std::optional<MotionPath> motion_path(const Trajectory& world_from_body, double longest_gap_s);

/// Each twist the mean of what is within so long about it, and as far ahead as back, where nothing is
/// bridged: what readings err by from one to the next averages out, and so does motion that is as quick.
[[nodiscard]] MotionPath smoothed(const MotionPath& path, double over_s);

}  // namespace trundle::recording
