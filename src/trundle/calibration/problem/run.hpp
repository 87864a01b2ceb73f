#pragma once

#include <array>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "trundle/calibration/problem/bias_walk.hpp"
#include "trundle/odometry/odometer.hpp"
#include "trundle/recording/alignment/align.hpp"
#include "trundle/recording/time_offset.hpp"

namespace trundle::calibration {

/// What the reference showed at one time; NaN where not measured.
struct ReferenceSample {
  Vector3 value = Vector3::Constant(kNotMeasured);  ///< x [m], y [m], heading [rad] of the reference sensor
  Vector3 rate = Vector3::Zero();  ///< its time derivative over a fifth of a second, for time offsets

  bool has_position() const { return std::isfinite(value.x()) && std::isfinite(value.y()); }
  bool has_heading() const { return std::isfinite(value.z()); }
  bool empty() const { return !has_position() && !has_heading(); }
};

/// Interpolated between samples, each measured quantity; nothing across gaps over half a second.
ReferenceSample sample_reference(const ReferenceStream& reference, double time_s);

/// Whether the reference is known there: anywhere between samples that lie close, else beside one of them,
/// where no other row of the wheels (`row_s` apart) is nearer: elsewhere a cubic would see motion before it
/// begins.
bool is_seen(const ReferenceStream& reference, double time_s, double row_s);

/// A recording made ready for calibration: readings aligned, and the places ('epochs') where odometry is held
/// against the reference. Epochs are so far apart that the reference's errors there are nearly independent.
struct Run {
  std::string name;
  std::string session;
  AlignedReadings readings;
  GyroStream gyro;                            ///< for other time offsets than that of `readings`
  ReferenceStream reference;                  ///< on the clock of `readings`, as far as the motion shows
  std::optional<TimeOffset> reference_clock;  ///< by which it was off, as the motion as a whole shows
  /// Where that motion shows it, off or not; nothing: it does not show it.
  std::optional<TimeOffset> seen_reference_clock;
  /// By which the estimate moved the reference's stamps beyond that, and 1σ of where they belong [s].
  double clock_moved_s = 0.0;
  double clock_sigma_s = std::numeric_limits<double>::infinity();
  /// Where the body looks at the first epoch, as the estimate has it; nothing: it is not sought, as where the
  /// reference has headings.
  std::optional<double> start_heading_rad = {};
  /// By how much the bias of the gyro is taken out of `gyro` and `readings` that this run has beyond the one
  /// that runs share [rad/s].
  double gyro_bias_moved_rad_s = 0.0;
  BiasWalk gyro_walk = {};               ///< of its bias; no harmonics where the run does not show it
  Eigen::VectorXd gyro_walk_moved = {};  ///< by which harmonics, in their sigmas, it is taken out of both
  PartialReference partial;
  std::vector<RelativeMotion> relative_motions;
  /// Number of increments before each epoch; the first epoch is the start. Empty: no reference stream.
  std::vector<std::size_t> epochs;
  /// Epochs before which the reference moved as the robot cannot have: the run is continued from the new
  /// place. Sorted.
  std::vector<std::size_t> jumps;

  double epoch_time(std::size_t epoch) const {
    return epochs[epoch] == 0 ? readings.start_s : readings.increments[epochs[epoch] - 1].time_s;
  }
  bool measures_length() const;  ///< a reference in metres: the only thing that can show a wheel diameter
  bool measures_anything() const;
  /// Whether it has a gyro, and is so long that a bias, by which headings are off in proportion to the time,
  /// is distinguished from noise, by which they are off as its root.
  bool shows_gyro_bias() const;
};

/// The next interval, which is returned; of a gap the course between its ends is not known
/// (docs/theory/odometry.md, eq. 7).
Increment step_along(const Run& run, std::size_t interval, Odometer& odometer);

/// world_from_body by the reference after so many increments; nothing where position or heading is missing.
std::optional<Pose2> body_by_reference(const Run& run, std::size_t increments, const Robot& robot);

/// Of the poses that odometry of the run's readings has, the first one at their start: those from which the
/// motion is interpolated at a stamp of the reference, and their neighbours.
[[nodiscard]] std::vector<bool> poses_about_reference(const Run& run, const Robot& robot);

/// The gyro's stamps are moved to where the robot has them now.
void set_gyro_clock(const Robot& robot, Run& run);

Run prepare_run(const Recording& recording, const Robot& robot);
/// The same of readings that align() gave.
Run prepare_run(const Recording& recording, const Robot& robot, AlignedReadings readings);

}  // namespace trundle::calibration
