#pragma once

#include "trundle/recording/finding.hpp"

/// What describe() says: one row for a code and the kind of payload that it comes with.
namespace trundle::recording::sentences {

template <class Type, class... Types>
constexpr std::size_t position_among(const std::variant<Types...>*) {
  std::size_t position = 0;
  (void)((std::is_same_v<Type, Types> || (++position, false)) || ...);
  return position;
}
/// The position of a type among those of Payload.
template <class Type>
constexpr std::size_t with = position_among<Type>(static_cast<const Payload*>(nullptr));
inline constexpr std::size_t alone = with<std::monostate>;

/// What is said of a code with a payload. Its placeholders are those of common_arguments() and of AddTo for
/// the payload.
struct Sentence {
  FindingCode code;
  std::size_t payload;
  std::string_view text;
};

using enum FindingCode;
using namespace payload;
inline constexpr Sentence kSentences[] = {
    // of a file
    {header, alone,
     "the first line holds numbers, but was taken for the names of the columns: write header = false in "
     "recording.toml"},
    {cut_off, alone, "the last line breaks off and was left out"},
    {log_cut, with<Names>, "the log ends before its end: {names}; what comes before was read"},
    {log_loss, with<Amount>,
     "{count} piece{s} of the log, {value:.0f} bytes in all, hold no messages and were passed over"},
    {log_stamps, with<Range>,
     "stamps are those in the messages' headers; messages were recorded {low:.3g} s after them (median; at "
     "most "
     "{high:.3g} s more or less)"},
    {log_stamps, with<Amount>,
     "stamps are those in the messages' headers, of another clock than the log's, against which it runs up "
     "to "
     "{value:.3g} s ahead or behind (a simulation's clock, or one that was not set)"},
    {log_stamps, alone,
     "the messages' headers hold no stamps: those at which they were recorded were taken, with the delays "
     "of the network"},
    {held_values, alone,
     "values stand in the log where they change: each holds until the next, and {count} row{s} in which "
     "nothing "
     "changes were added"},
    {gyro_axis, with<Names>, "the turn rate is that about {subject}, the axis that points up by the {names}"},
    {gyro_axis, alone,
     "the turn rate is that about {subject}: the messages hold neither gravity nor an orientation that shows "
     "which "
     "axis points up"},
    {rebuilt_wheels, with<Amount>,
     "the travel of {quoted} is rebuilt from poses and a wheel separation of {value:g} m: what the "
     "controller "
     "left out, counts and slip within a step, is not in it; record joint states or encoder counts where you "
     "can"},
    {row_without_stamp, alone, "{count} row{s} without a stamp left out"},
    {cell_without_number, alone, "{count} cell{s} without a number: not measured"},
    {sighting_without_number, alone,
     "{count} sightings without bearing or with no valid range were left out"},
    {duplicate, alone, "{count} row{s} with the stamp of the row before; the first was kept"},
    {back_step, with<Disorder>, "time steps back {count} time{s}; {remedy}{question}"},
    {gap, with<Excess>, "{count} gap{s} longer than {limit:.3g} s, the longest {farthest:.3g} s"},

    // of units
    {time_unit, with<StampStep>,
     "the stamps of {place} step by {step:.3g} s from row to row: seconds are expected; a recording.toml can "
     "say time_unit = \"{unit}\""},
    {bearing_unit, with<Excess>,
     "{count} of {all} bearings are beyond a whole turn, up to {farthest:.4g} rad: of degrees, "
     "recording.toml "
     "can say unit = \"deg\" at bearing_rad"},
    {bearing_unit, alone,
     "landmarks stay where they are if bearings count to the right: write sign = -1 at bearing_rad in "
     "recording.toml"},
    {bearing_unit, with<Amount>,
     "landmarks stay where they are if the landmark sensor looks elsewhere: heading_deg = {value:.0f} under "
     "[landmark_sensor]"},
    {range_unit, with<LengthRatio>,
     "landmarks stay where they are if ranges are {times} times as long: {question}check their unit"},
    {range_unit, with<Excess>,
     "{count} of {all} ranges, up to {farthest:.4g} m, are more than twice the sensor's max_range_m = "
     "{limit:g}: is one of them in another unit than metres?"},
    {reference_unit, with<Times>,
     "the reference turns {factor:.0f} times as far as the wheels; degrees would make it 57: write unit = "
     "\"deg\" at heading_rad in recording.toml"},
    {reference_unit, with<Share>,
     "the reference turns {factor:.2g} of what the wheels do, where radians taken for degrees would make it "
     "1/57: leave out unit = \"deg\""},
    {reference_unit, with<Excess>,
     "headings are beyond whole turns, up to {farthest:.4g} rad, and step by more than half a turn from row "
     "to row {count} time{s}: of degrees, recording.toml can say unit = \"deg\" at heading_rad"},
    {reference_unit, with<Range>,
     "{low:.4g} {subject} by [reference] in recording.toml, {high:.4g} by wheels and gyro with the robot "
     "file as "
     "given: check unit, sign and run, then ticks_per_revolution and y_m"},
    {reference_unit, with<LengthRatio>,
     "the reference moves {times} times as far as the wheels with the robot file as given: "
     "{question}check ticks_per_revolution, gears and diameters"},
    {gyro_unit, with<Times>,
     "the gyro turns {factor:.0f} times as far as the wheels; degrees per second would make it 57: write "
     "unit "
     "= \"deg/s\" at yaw_rate_rad_s in recording.toml"},
    {gyro_unit, with<Share>,
     "the gyro turns {factor:.2g} of what the wheels do, where radians taken for degrees would make it 1/57: "
     "leave out unit = \"deg/s\""},
    {steering_unit, with<Amount>,
     "{subject} points to all sides, up to {value:.4g} rad, as no wheel beside one that is not steered does: "
     "of "
     "degrees, recording.toml can say unit = \"deg\" at {subject}"},
    {steering_unit, with<Excess>,
     "{subject} points to all sides, up to {farthest:.4g} rad, as no wheel beside one that is not steered "
     "does: is steering_ticks_per_revolution right? A quadrature encoder has 4 counts for a line"},
    {steering_unit, with<Times>,
     "the wheels turn the robot as it turns if {subjects} {are} of degrees: write unit = \"deg\" there in "
     "recording.toml"},
    {steering_unit, with<Share>,
     "the wheels turn the robot as it turns if {subjects} {are} of radians: leave out unit = \"deg\" there"},
    {steering_direction, with<Range>,
     "{subject} rolls {low:.0f}° beside where its angles say, by the wheels that are not steered: write "
     "steering_zero_deg = {high:.1f}, if direction_deg is right"},
    {increments, with<Range>,
     "{subjects} stay{verb_s} between {low:g} and {high:g} and go up and down from row to row, like counts "
     "since the row before, not like counters that go on: write increments = true under [wheels] in "
     "recording.toml"},
    {not_increments, with<Range>,
     "{subjects} stay{verb_s} between {low:g} and {high:g} and go on from row to row, like counters, not "
     "like "
     "counts since the row before: leave out increments = true"},
    {fractions, with<Amount>,
     "{subject}_ticks holds fractions, like {value:.6g}, and no turn of the wheel in all; counts are whole: "
     "another column, or {subject}_rad or {subject}_m?"},
    {finer_than_counts, with<Amount>,
     "{subject}_ticks changes by parts of a count, like {value:.3g}: noise as of whole counts is allowed "
     "for, "
     "which is too much; map it to {subject}_rad with unit = \"rev\" and scale = 1/ticks_per_revolution, and "
     "leave "
     "ticks_per_revolution out of the robot file"},

    // of clocks
    {clocks, with<Spans>,
     "{subject} runs from {start:.9g} to {end:.9g} s, {other} from {other_start:.9g} to {other_end:.9g} s, "
     "never at the same time: another column of stamps, time_unit or time_offset_s?"},
    {time_offset, with<ClockOffset>,
     "the gyro's stamps are {size:.1f} ms too {side} against the wheels', which looks like slip at every "
     "start of a turn: {remedy}"},
    {time_offset, with<Offset>,
     "the clocks of gyro and {subject} are {value:.3f} ± {sigma:.3f} s farther apart than the robot file "
     "says, and this motion does not tell which of them is wrong: drive curves at changing speeds"},
    {steering_time_offset, with<ClockOffset>,
     "the steering is read {size:.0f} ± {sigma:.1f} ms too {side} in {subjects}, by turns that are measured "
     "otherwise: {remedy}"},
    {steering_time_offset, with<Offset>,
     "the clocks of steering and {subject} are {value:.3f} ± {sigma:.3f} s farther apart than the robot file "
     "says, and this motion does not tell which of them is wrong: drive curves at changing speeds"},
    {reference_time_offset, with<ClockOffset>,
     "the reference's stamps are {size:.0f} ms too {side} against the sensors' on board; run and calibrate "
     "correct it, other programs do not: {remedy}"},

    {sighting_time_offset, with<ClockOffset>,
     "the landmark sensor's stamps are {size:.0f} ms too {side} against the sensors' of motion, by its "
     "bearings: {remedy}, and keep it if the innovations (NIS) become smaller"},

    // of counters
    {wrap, alone, "the counter of '{subject}' wraps {count} time{s}"},
    {wrap, with<Amount>,
     "the counter of '{subject}' wraps {count} time{s}; it looks like {value:g} bits: tick_bits = {value:g}"},
    {counter_reset, alone,
     "the counter of '{subject}' starts again near zero {count} time{s}; the jump is not counted as travel"},
    {counter_jump, alone,
     "the counter of '{subject}' jumps {count} time{s} farther than the wheel can turn; the jump is not "
     "counted as travel"},
    {tick_bits, with<Amount>,
     "the counter of '{subject}' wraps like one of {value:g} bits: write tick_bits = {value:g}"},
    {ticks_per_revolution, alone,
     "{quoted} {have} no ticks_per_revolution, and the recording gives counts: turn the wheel once by hand "
     "and write how many counts that is"},
    {stuck_encoder, alone,
     "the encoder of '{subject}' reads nothing in {count} intervals while the other sensors say that it "
     "rolls: it is dead, the wheel is locked, or the others slip"},
    {stuck_encoder, with<Amount>,
     "the encoder of '{subject}' is constant for {value:.1f} s while the other wheels turn: faulty, or the "
     "robot pivots on this wheel"},
    {stuck_encoder, with<Standstill>,
     "the encoder of '{subject}' is stuck: it stands still for {duration:.1f} s while the other sensors say "
     "it rolls {expected:.2f} m"},
    {bridged_gap, alone,
     "{count} gaps were bridged as one arc each; their unknown course was added to the covariance"},

    // of the gyro
    {no_gyro, alone, "{count} intervals have no gyro samples; the wheels alone were used"},
    {no_gyro, with<Amount>,
     "{count} intervals have no gyro samples; the last turn rate was kept, with ±{value:.1f} rad/√s"},
    {no_rest, with<Amount>,
     "heading ± {value:.2g}° at the end: no rest is recognised, so the gyro's bias is not known beforehand: "
     "let "
     "the robot rest 2 s at the start"},
    {gyro_missing, alone, "the gyro is missing in {count} interval{s} of the wheels: a gap, or saturation"},
    {gyro_missing, with<Spans>,
     "the gyro runs from {start:.2f} to {end:.2f} s, the wheels from {other_start:.2f} to {other_end:.2f} s: "
     "{count} interval{s} without it"},
    {gyro_saturated, alone, "the gyro is at or beyond its max_rate_rad_s in {count} sample{s}"},
    {gyro_disturbed, alone,
     "the gyro turns beyond its max_rate_rad_s in {count} intervals; it was not used there"},
    {gyro_beyond_its_bias, with<SteadyRate>,
     "no wheel turns for {duration:.1f} s while the gyro reads a steady {rate:.5f} rad/s, beyond its bias of "
     "{bias:.5f} ± {sigma:.5f} rad/s: it was taken for a turn. If the robot stood still, raise "
     "bias_sigma_rad_s or bias_walk_rad_s_sqrt_s under [gyro]; if it turned, its wheels were locked or "
     "lifted, or its encoders are dead"},
    {gyro_bias, with<SteadyRate>,
     "beside what the wheels turn the gyro reads a steady {rate:.4f} rad/s; the robot file says bias_rad_s = "
     "{bias:.4f} ± {sigma:.4f}: write bias_rad_s = {rate:.4f} under [gyro]"},
    {gyro_sign, alone,
     "the gyro turns the other way than the wheels: it is mounted upside down ([gyro] scale = -1) or left "
     "and "
     "right are swapped"},
    {gyro_against_wheels, alone,
     "the wheels do not turn the robot as the gyro sees it turn: is every column that of its wheel, and "
     "time_offset_s of the gyro right?"},
    {gyro_against_wheels, with<Times>,
     "the gyro turns {times} times as far as the wheels with the robot file as given: check {subjects}, "
     "ticks_per_revolution, gears and diameters"},

    // of the robot file
    {unknown_wheel, alone,
     "the robot file has no wheel '{subject}', so that column is not used: is '{other}' meant?"},
    {unknown_wheel, with<Names>,
     "the robot file has no wheel '{subject}', so that column is not used: its wheels are {names}"},
    {unused_steering, alone,
     "{subject} is not used, for the robot file does not have '{other}' as steered: write steered = true "
     "there"},
    {swapped_channels, alone,
     "encoder channels look swapped: '{subject}' and '{other}' carry each other's signal: swap the two "
     "columns in recording.toml, or the two wheels in the robot file"},
    {misplaced_channel, alone,
     "encoder channels look swapped: '{subject}' carries the signal of '{other}': put the columns in "
     "recording.toml right, or the wheels in the robot file"},
    {reversed_counter, with<Amount>, "'{subject}' counts backwards: ticks_per_revolution = {value:.10g}"},
    {reversed_wheel, with<Amount>, "'{subject}' reads backwards: direction_deg = {value:.6g}"},
    {reversed_steering, alone,
     "the reference's path bends the other way than {quoted} {have} it: turn the sign of steering_scale if "
     "the "
     "steering is reversed, or of ticks_per_revolution if all wheels count backwards"},
    {reversed_steering, with<Amount>,
     "the steering of '{subject}' is reversed: steering_scale = {value:.6g}"},
    {reversed_gyro, with<Amount>, "the gyro is mounted upside down: scale = {value:.6g}"},
    {parallel_wheels, alone,
     "'{subject}' and '{other}' cannot be distinguished by any run: they roll along the same line"},
    {indistinguishable_wheels, alone,
     "'{subject}' and '{other}' cannot be distinguished by these runs: both read alike; move ahead, sideways "
     "and "
     "turn, one after the other"},
    {scale, with<LengthRatio>,
     "the reference moves {times} times as far as the wheels with the robot file as given: "
     "{question}check ticks_per_revolution, gears and diameters"},
    {geometry, alone, "wheels '{subject}' and '{other}' stand in one place: write x_m and y_m of both"},
    {geometry, with<Amount>,
     "wheels '{subject}' and '{other}' are fixed and roll in directions {value:.0f}° apart: however the "
     "robot drives, one of them skids; is kind = \"omni\" meant?"},
    {geometry, with<Range>,
     "landmarks stay where they are if the landmark sensor stands at x_m = {low:.1f}, y_m = {high:.1f}: "
     "check "
     "[landmark_sensor]"},
    {contrary_wheels, with<Amount>,
     "no motion explains {value:.0f} % of what the wheels read: if none slips that much, check "
     "direction_deg, "
     "x_m, y_m, diameter_m and ticks_per_revolution of each"},
    {indistinguishable_wheels, with<Amount>,
     "'{subject}' and '{other}' read the same in every row, though the robot turns by {value:.1f} rad: is "
     "one "
     "column of the file given to both?"},
    {reference_axes, with<Amount>,
     "the reference turns the other way than wheels and gyro do: write sign = -1 at heading_rad, and at y_m "
     "if "
     "that counts to the right; else wheels and gyro are mirrored both"},
    {reference_axes, alone,
     "the path bends the other way than its headings turn: swap the columns of x_m and y_m, or write sign = "
     "-1 at one of them"},

    // of sightings
    {sighting_of_a_robot, alone, "{count} sightings of other robots were left out"},
    {sighting_without_name, alone,
     "{count} sightings name no landmark, others do: their directions distinguish them"},
    {sighting_without_odometry, alone,
     "{count} sightings lie before or after the odometry and were left out"},
    {repeated_sighting, alone,
     "{count} sightings repeat another, stamp, landmark and reading and were left out"},
    {crowded_instant, with<Amount>, "{count} sightings are beyond {value:g} of an instant and were left out"},
    {unknown_barcode, alone, "{count} sightings of barcodes that no subject has were left out"},

    // of results
    {slip_without_gyro, alone, "{count} intervals have no gyro: slip was not judged there"},
    {slip_in_a_curve, alone,
     "{count} intervals are not nearly straight: the published method does not apply there"},
    {slip_unlike_learned, alone,
     "{count} intervals have another length or speed than those that the band was learned at: not judged"},
    {not_normal, alone, "the residuals of clean driving are not normal: their own quantiles are the limit"},
    {not_normal, with<Amount>,
     "the residuals of clean driving are not normal: their own quantiles are the limit; there are too few of "
     "them for a probability of {value}: the largest one is used"},
    {nothing_to_smooth, alone, "no landmark is surely there: the trajectory is the filter's"},
    {lost, with<Stretch>,
     "from {start:.1f} s to {end:.1f} s after the start {count} of {all} sightings of landmarks seen before "
     "do not fit: the filter diverged there, and neither its trajectory nor its ± is right; is the "
     "robot calibrated, does [noise] say how far its odometry can be trusted, do bearings turn to the left?"},
    {misplaced_landmark, with<Stretch>,
     "landmark {quoted}: from {start:.1f} s to {end:.1f} s after the start {count} of {all} of its sightings "
     "do not fit where it was put: the first one was wrong, it was moved, or two have this name; --smooth, "
     "and "
     "--filter smoother, use all of them"},
    {noise, with<Amount>,
     "half of all innovations squared (NIS) are above {value:.1f} (expected if consistent: 1.39): sigmas of "
     "[landmark_sensor] or [noise] are too small, and so is every ±"},
    {noise, with<Range>,
     "the gyro scatters by {high:.2g} rad/s/√Hz where no wheel turns, by [gyro] in the robot file by "
     "{low:.2g}: rests are not recognised, its bias is not learned, and headings err by more than they say; "
     "write noise_rad_s_sqrt_hz = {high:.2g} (trundle info --gyro-noise measures it)"},
    {noise, with<Times>,
     "the smoother's cost is {factor:.1f} times its degrees of freedom: what was seen does not fit together "
     "as well as the noise settings say, and every ± is at least {root:.1f} times too small"},
    {not_converged, with<Amount>,
     "the smoother has not converged after {value:g} iterations: its trajectory and map are not the most "
     "probable ones"},
    {smoother_contradicts, with<Times>,
     "the smoothed trajectory is {root:.1f} times as far from the online one as its ± allows (median): one "
     "of "
     "them is wrong beyond its sigmas, and without a reference it is not known which; are sensor and "
     "odometry "
     "calibrated (calibrate --landmarks), and their sigmas learned (--learn-noise)?"},
    {range_offset, with<Offset>,
     "ranges are on average {value:+.3f} ± {sigma:.3f} m longer than poses and map explain, {of_reading:.1f} "
     "sigmas of one reading: calibrate --landmarks --free sensor.range_offset"},
    {bearing_offset, with<Offset>,
     "bearings are on average {value:+.2f} ± {sigma:.2f}° further left than poses and map explain, "
     "{of_reading:.1f} sigmas of one reading: calibrate --landmarks --free sensor.bearing_offset"},
    {depths, with<Offset>,
     "ranges grow shorter towards the edges of the view, by {value:.2f} ± {sigma:.2f} of what they would if "
     "they "
     "were depths along the sensor's axis (a camera's), {of_reading:.1f} sigmas of one reading: calibrate "
     "--landmarks --free sensor.depth_share"},
};

}  // namespace trundle::recording::sentences
