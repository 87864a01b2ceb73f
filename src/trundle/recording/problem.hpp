#pragma once

#include <string>
#include <string_view>

namespace trundle {

enum class Severity { note, warning };

/// What a Problem is about. What is done about one depends on this alone, never on its words.
enum class ProblemKind {
  // of a file
  header,        ///< numbers were taken for the names of columns
  cut_off,       ///< the last line breaks off
  not_a_number,  ///< cells or stamps that are none
  duplicate,     ///< stamps of the row before
  back_step,     ///< stamps that go back
  gap,           ///< of a stream
  // of units
  time_unit,
  bearing_unit,
  range_unit,
  reference_unit,
  gyro_unit,
  increments,  ///< counts that do not add up: each is a difference
  fractions,   ///< counts that are none
  // of clocks
  clocks,  ///< two streams are never at the same time
  time_offset,
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
  gyro_sign,
  gyro_against_wheels,
  // of the robot file
  unknown_wheel,
  wiring,
  scale,
  geometry,
  reference_axes,
  // of sightings
  sighting_of_a_robot,
  sighting_without_name,
  sighting_without_odometry,
  repeated_sighting,
  crowded_instant,
  unknown_barcode,
  // of results
  slip_not_judged,
  not_normal,
  nothing_to_smooth,
  lost,   ///< a filter was, for a while
  noise,  ///< is larger than the robot file says
  not_converged,
};
/// As it is printed and stands in JSON: "back-step", "gyro missing".
std::string_view name_of(ProblemKind kind);

/// Something that was found to be wrong, or is worth knowing, of a recording or a result.
struct Problem {
  Severity severity = Severity::warning;
  ProblemKind kind = ProblemKind::not_a_number;
  std::string place;  ///< "file:line" of the first
  std::size_t count = 1;
  std::string message;       ///< one sentence a person can act on
  std::string subject = {};  ///< the wheel that it is about, if it is about one
};

}  // namespace trundle
