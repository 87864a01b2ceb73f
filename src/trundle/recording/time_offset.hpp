#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "trundle/chassis/robot.hpp"
#include "trundle/geometry/trajectory.hpp"
#include "trundle/recording/alignment/align.hpp"

namespace trundle::recording {

/// How far a sensor's clock is from the wheels', found in a log.
struct TimeOffset {
  double offset_s =
      0.0;  ///< to be the gyro's time_offset_s in the robot file, that of the wheels being what it is
  double sigma_s = 0.0;  ///< with the scatter of this log, whatever causes it
  double correlation =
      0.0;  ///< of the two sensors' turns at that offset; negative: one of them has the wrong sign
  double least_s = 0.005;  ///< what is less does no harm (at 1 rad/s 0.3°), or is within what stamps say
};

struct TimeOffsetOptions {
  double largest_s = 0.5;          ///< searched on both sides of what the robot file says
  double window_s = 0.1;           ///< over which turns are compared
  double largest_sigma_s = 0.05;   ///< an offset known less well counts as untold
  double least_correlation = 0.5;  ///< with less the sensors do not speak of the same motion
};

/// The offset at which the turns of the gyro explain those of the wheels best, their scale and the gyro's
/// bias being free; windows where a wheel slips are left out. docs/theory/alignment.md. Where wheels do not
/// see turns: as gyro_and_reference_clocks() has it. Nothing where it cannot be determined: the robot hardly
/// turns or always at one rate, the turns do not agree, nothing else measures turns, or no gyro was recorded.
/// Throws as align() does.
std::optional<TimeOffset> gyro_time_offset(const Recording& recording, const Robot& robot,
                                           const TimeOffsetOptions& options = {});

struct GyroClocks {
  bool is_possible = false;  ///< the gyro alone sees turns, and a reference shows them
  std::optional<TimeOffset> gyro = {}, reference = {};  ///< each to be its sensor's time_offset_s
  /// How much farther the gyro's clock is from what the robot file says than the reference's: where the speed
  /// hardly changes both may be anything together, and this is told.
  std::optional<TimeOffset> apart = {};
};

/// Where wheels do not see the robot turn, as passive pods do not: the ways that a reference shows tell its
/// clock, and its turns the gyro's. Both are found together. docs/theory/joint-clocks.md. Throws as align()
/// does.
GyroClocks gyro_and_reference_clocks(const Recording& recording, const Robot& robot,
                                     const TimeOffsetOptions& options = {});

/// How far the steering's clock is from that of the wheels, found in a log.
struct SteeringClocks {
  bool is_possible = false;                 ///< a steering that turns the robot, and turns measured otherwise
  std::string_view by = {};                 ///< what measured these: "wheels", "gyro", "reference"
  std::optional<TimeOffset> steering = {};  ///< to be steering_time_offset_s of the first steered wheel
  /// Of the sensor that measured the turns, found along with it: to be its time_offset_s.
  std::optional<TimeOffset> gyro = {}, reference = {};
  /// How much farther the steering's clock is from what the robot file says than that of the sensor that
  /// measures the turns: where the speed hardly changes both may be anything together, and this is told.
  std::optional<TimeOffset> apart = {};
};

/// The offset at which the turns that the steering makes of the way explain best those that are measured
/// otherwise: by wheels that are not steered, else the gyro, else the headings of the reference, whose own
/// clock is found along with it. All steered wheels have one clock. docs/theory/joint-clocks.md. Nothing
/// where it cannot be determined. Throws as align() does.
SteeringClocks steering_clocks(const Recording& recording, const Robot& robot,
                               const TimeOffsetOptions& options = {});

/// Of the first steered wheel; 0 where there is none.
[[nodiscard]] double steering_time_offset_s(const Chassis& chassis);
/// Adds to those of all steered wheels.
void move_steering_clock(double by_s, Chassis& chassis);

/// How far the reference's clock is from that of the sensors on board, found in one log.
inline constexpr TimeOffsetOptions kReferenceClock = {
    .largest_s = 10.0, .window_s = 0.2, .least_correlation = 0.8};

/// The offset at which the ways and turns that the reference shows explain those of the robot best, each with
/// a scale and a drift of its own, to be reference.time_offset_s. Searched on at most a sixth of the log.
/// docs/theory/alignment.md. Nothing where it cannot be determined: too little of the reference, or of its
/// motion.
std::optional<TimeOffset> reference_time_offset(const ReferenceStream& reference,
                                                const AlignedReadings& readings, const Robot& robot,
                                                const TimeOffsetOptions& options = kReferenceClock);

/// The same where a trajectory tells how the body moved, but for its gaps that are longer. A heading of the
/// reference that was not measured is NaN.
std::optional<TimeOffset> reference_time_offset(const Trajectory& reference,
                                                const Trajectory& world_from_body, double longest_gap_s,
                                                const Robot& robot,
                                                const TimeOffsetOptions& options = kReferenceClock);

/// What one log shows of the reference and of the motion on board.
struct ReferenceLog {
  const ReferenceStream& reference;
  const AlignedReadings& readings;
};
/// The same of several logs that have one clock: together they tell what each is too short for.
std::optional<TimeOffset> reference_time_offset(std::span<const ReferenceLog> logs, const Robot& robot,
                                                const TimeOffsetOptions& options = kReferenceClock);

inline constexpr TimeOffsetOptions kSightingClock = {
    .largest_s = 1.0, .window_s = 0.2, .least_correlation = 0.8};

/// The offset at which the robot's motion explains best how the bearings of landmarks change from one
/// sighting to the next, to be the landmark sensor's time_offset_s. Only landmarks with a name tell. Nothing
/// where it cannot be determined.
std::optional<TimeOffset> sighting_time_offset(const std::vector<Sighting>& sightings,
                                               const AlignedReadings& readings, const Robot& robot,
                                               const TimeOffsetOptions& options = kSightingClock);

/// What each recording says, of those that say anything.
using OffsetOf = std::function<std::optional<TimeOffset>(const Recording&)>;
[[nodiscard]] std::vector<TimeOffset> offsets_of(std::span<const Recording> recordings,
                                                 const OffsetOf& offset_of);

/// What several logs that have one clock say of it, by the weights of their sigmas; nothing: there is none.
[[nodiscard]] std::optional<TimeOffset> mean_of(std::span<const TimeOffset> offsets);

/// Whether an offset is so far from what is written that it does harm, and is no chance (three sigmas).
[[nodiscard]] bool is_off(const TimeOffset& found, double given_s);

/// Adds to the reference's stamps.
void move_stamps(double step_s, ReferenceStream& reference);

/// Moves the reference's stamps so that robot.reference_time_offset_s holds for them, if what was found
/// (reference_time_offset) says that they are off. Returns by what offset they were; nothing: they were not
/// moved.
std::optional<TimeOffset> set_reference_clock(const std::optional<TimeOffset>& found, const Robot& robot,
                                              ReferenceStream& reference);

}  // namespace trundle::recording
