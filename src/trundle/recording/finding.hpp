#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "trundle/namespaces.hpp"

namespace trundle::recording {

enum class Severity { note, warning };

/// What a Finding is about. What is done about one depends on this alone.
enum class FindingCode {
  // of a file
  header,                   ///< numbers were taken for the names of columns
  cut_off,                  ///< the last line breaks off
  log_cut,                  ///< a log of messages ends before its end
  log_loss,                 ///< what is no message between messages
  log_stamps,               ///< which stamps those of a log's messages are
  held_values,              ///< of a log that is written where values change
  gyro_axis,                ///< of an inertial sensor, that points up
  rebuilt_wheels,           ///< from the poses that a controller computed of them
  row_without_stamp,        ///< left out
  cell_without_number,      ///< taken as not measured
  sighting_without_number,  ///< of a bearing or a valid range: left out
  duplicate,                ///< stamps of the row before
  back_step,                ///< stamps that go back
  gap,                      ///< of a stream
  // of units
  time_unit,
  bearing_unit,
  range_unit,
  reference_unit,
  gyro_unit,
  steering_unit,
  steering_direction,  ///< that its angles are counted from
  increments,          ///< counts that do not add up: each is a difference
  not_increments,      ///< counts that add up already, though recording.toml calls them increments
  fractions,           ///< counts that are none
  finer_than_counts,   ///< a wheel turns by parts of a count
  // of clocks
  clocks,                 ///< two streams are never at the same time
  time_offset,            ///< of the gyro
  steering_time_offset,   ///< of all steered wheels
  reference_time_offset,  ///< set right by those who compare
  sighting_time_offset,   ///< of the landmark sensor
  // of counters
  wrap,
  counter_reset,
  counter_jump,
  tick_bits,             ///< it wraps, and the robot file does not say so
  ticks_per_revolution,  ///< the robot file does not say how many
  stuck_encoder,
  bridged_gap,
  // of the gyro
  no_gyro,
  no_rest,  ///< the robot never stands still, so the gyro's bias is not known
  gyro_missing,
  gyro_saturated,
  gyro_disturbed,
  gyro_beyond_its_bias,
  gyro_bias,  ///< as the robot file has it
  gyro_sign,
  gyro_against_wheels,
  // of the robot file
  unknown_wheel,
  unused_steering,           ///< of a wheel that the robot file has not as steered
  swapped_channels,          ///< of two encoders
  misplaced_channel,         ///< it carries the signal of another encoder
  reversed_counter,          ///< of a wheel that is recorded in counts
  reversed_wheel,            ///< of one that is recorded otherwise
  reversed_gyro,             ///< it is mounted upside down
  reversed_steering,         ///< angles count clockwise
  parallel_wheels,           ///< no run shows whether their channels are swapped
  indistinguishable_wheels,  ///< these runs do not show it
  scale,
  geometry,
  contrary_wheels,  ///< no motion explains what they read
  reference_axes,
  // of sightings
  sighting_of_a_robot,
  sighting_without_name,
  sighting_without_odometry,
  repeated_sighting,
  crowded_instant,
  unknown_barcode,
  // of results
  slip_without_gyro,    ///< not judged
  slip_in_a_curve,      ///< not judged by a method for straight driving
  slip_unlike_learned,  ///< not judged by what was learned of other driving
  not_normal,
  nothing_to_smooth,
  lost,  ///< a filter was, for a while
  misplaced_landmark,
  noise,  ///< is larger than the robot file says
  not_converged,
  smoother_contradicts,  ///< the filter that it started from
  range_offset,          ///< of the landmark sensor, as the smoother sees it
  bearing_offset,        ///< likewise
  depths,                ///< likewise: its ranges are depths
};
inline constexpr std::size_t kFindingCodes = static_cast<std::size_t>(FindingCode::depths) + 1;

/// The kind of finding as it is printed and stands in JSON: "back-step", "gyro missing". Several codes may be
/// of one kind.
[[nodiscard]] std::string_view name_of(FindingCode code);

/// What a sentence needs beyond the count and the subjects of its finding: a few shapes that many codes
/// share. Each code takes one or two of them, which describe.cpp lists.
namespace payload {

/// This one stands for `count` more of its code, in one file.
struct Further {};

/// One number, in the unit that its code has.
struct Amount {
  double value = 0.0;
};

/// Something goes so many times as far as the wheels (gyro, reference), or costs as its degrees of freedom (a
/// fit).
struct Times {
  double factor = 1.0;
};

/// Something goes only so small a part of what the wheels do.
struct Share {
  double factor = 1.0;
};

/// The least and the greatest of several values.
struct Range {
  double low = 0.0, high = 0.0;
};

/// What is beyond a limit.
struct Excess {
  double farthest = 0.0;
  double limit = 0.0;   ///< that it is beyond
  std::size_t all = 0;  ///< among so many
};

/// An interval, and the one that it should have been [s].
struct Spans {
  double start_s = 0.0, end_s = 0.0;
  double other_start_s = 0.0, other_end_s = 0.0;
};

struct Names {
  std::vector<std::string> names;
};

/// What was done about stamps that go back.
struct Disorder {
  bool is_sorted = false;    ///< else rows were left out
  bool is_no_clock = false;  ///< so many that they may be no stamps
};

/// Stamps as they step in seconds, and the unit in which they look like stamps of a robot.
struct StampStep {
  double step_s = 0.0;
  std::string likely_unit;  ///< as recording.toml has it
};

/// A wheel that reads nothing while the other sensors say it rolls.
struct Standstill {
  double duration_s = 0.0;
  double expected_m = 0.0;
};

/// What a gyro reads while no wheel turns, or beside what the wheels turn, and its bias as it was known with
/// 1σ.
struct SteadyRate {
  double duration_s = 0.0;
  double rate_rad_s = 0.0;
  double bias_rad_s = 0.0, sigma_rad_s = 0.0;
};

/// Of the clock of a sensor. Offsets may stand in the robot file and in recording.toml, and they add up.
struct ClockOffset {
  std::string_view table = "gyro";  ///< of both files, where it stands
  std::string_view key = "time_offset_s";
  double off_s = 0.0;  ///< to be added to those that are there
  double sigma_s = 0.0;
  double by_robot_s = 0.0, by_map_s = 0.0;
  std::string file;      ///< to be corrected
  std::string map = {};  ///< recording.toml where it has an offset and the robot file another
};

/// The reference moves so many times as far as the wheels.
struct LengthRatio {
  double factor = 1.0;
  std::string_view unit = {};    ///< that explains it, "millimetres"; empty: none does
  std::string_view symbol = {};  ///< of that unit in recording.toml
};

/// When a filter was lost, after the start [s].
struct Stretch {
  double start_s = 0.0, end_s = 0.0;
  std::size_t all = 0;  ///< sightings in it
};

/// A systematic error of readings, in the unit of the robot file, with 1σ; and in sigmas of one reading.
struct Offset {
  double value = 0.0, sigma = 0.0;
  double of_reading = 0.0;
};

}  // namespace payload

using Payload = std::variant<std::monostate, payload::Further, payload::Amount, payload::Times,
                             payload::Share, payload::Range, payload::Excess, payload::Spans, payload::Names,
                             payload::Disorder, payload::StampStep, payload::Standstill, payload::SteadyRate,
                             payload::ClockOffset, payload::LengthRatio, payload::Stretch, payload::Offset>;

/// Something that was found to be wrong, or is worth knowing, of a recording or a result.
struct Finding {
  Severity severity = Severity::warning;
  FindingCode code = FindingCode::header;
  std::string place = {};                  ///< "file:line" of the first
  std::size_t count = 1;                   ///< of rows, intervals or sightings
  std::vector<std::string> subjects = {};  ///< wheels, columns or streams that it is about
  Payload payload = {};
};

/// The finding as one sentence that a person can act on: the only place where sentences are made of findings.
[[nodiscard]] std::string describe(const Finding& finding);

}  // namespace trundle::recording
