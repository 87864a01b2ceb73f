#include "trundle/recording/finding.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace trundle::recording {
namespace {

constexpr std::pair<FindingCode, std::string_view> kNames[] = {
    {FindingCode::header, "header"},
    {FindingCode::cut_off, "cut off"},
    {FindingCode::log_cut, "cut off"},
    {FindingCode::log_loss, "damaged log"},
    {FindingCode::log_stamps, "stamps"},
    {FindingCode::held_values, "held values"},
    {FindingCode::gyro_axis, "gyro axis"},
    {FindingCode::rebuilt_wheels, "rebuilt wheels"},
    {FindingCode::row_without_stamp, "nan"},
    {FindingCode::cell_without_number, "nan"},
    {FindingCode::sighting_without_number, "nan"},
    {FindingCode::duplicate, "duplicate"},
    {FindingCode::back_step, "back-step"},
    {FindingCode::gap, "gap"},
    {FindingCode::time_unit, "time unit"},
    {FindingCode::bearing_unit, "bearing unit"},
    {FindingCode::range_unit, "range unit"},
    {FindingCode::reference_unit, "reference unit"},
    {FindingCode::gyro_unit, "gyro unit"},
    {FindingCode::steering_unit, "steering unit"},
    {FindingCode::steering_direction, "steering direction"},
    {FindingCode::increments, "increments"},
    {FindingCode::not_increments, "increments"},
    {FindingCode::fractions, "fractions"},
    {FindingCode::finer_than_counts, "finer than counts"},
    {FindingCode::clocks, "clocks"},
    {FindingCode::time_offset, "time offset"},
    {FindingCode::steering_time_offset, "steering's time offset"},
    {FindingCode::reference_time_offset, "reference time offset"},
    {FindingCode::sighting_time_offset, "landmark sensor's time offset"},
    {FindingCode::wrap, "wrap"},
    {FindingCode::counter_reset, "counter reset"},
    {FindingCode::counter_jump, "counter jump"},
    {FindingCode::tick_bits, "tick_bits"},
    {FindingCode::ticks_per_revolution, "ticks_per_revolution"},
    {FindingCode::stuck_encoder, "stuck encoder"},
    {FindingCode::bridged_gap, "bridged gap"},
    {FindingCode::no_gyro, "no gyro"},
    {FindingCode::no_rest, "no rest"},
    {FindingCode::gyro_missing, "gyro missing"},
    {FindingCode::gyro_saturated, "gyro saturated"},
    {FindingCode::gyro_disturbed, "gyro disturbed"},
    {FindingCode::gyro_beyond_its_bias, "gyro beyond its bias"},
    {FindingCode::gyro_bias, "gyro bias"},
    {FindingCode::gyro_sign, "gyro sign"},
    {FindingCode::gyro_against_wheels, "gyro against wheels"},
    {FindingCode::unknown_wheel, "unknown wheel"},
    {FindingCode::unused_steering, "unused steering"},
    {FindingCode::swapped_channels, "wiring"},
    {FindingCode::misplaced_channel, "wiring"},
    {FindingCode::reversed_counter, "wiring"},
    {FindingCode::reversed_wheel, "wiring"},
    {FindingCode::reversed_gyro, "wiring"},
    {FindingCode::reversed_steering, "wiring"},
    {FindingCode::parallel_wheels, "wiring"},
    {FindingCode::indistinguishable_wheels, "wiring"},
    {FindingCode::scale, "scale"},
    {FindingCode::geometry, "geometry"},
    {FindingCode::contrary_wheels, "contrary wheels"},
    {FindingCode::reference_axes, "reference axes"},
    {FindingCode::sighting_of_a_robot, "sighting of a robot"},
    {FindingCode::sighting_without_name, "sighting without name"},
    {FindingCode::sighting_without_odometry, "sighting without odometry"},
    {FindingCode::repeated_sighting, "repeated sighting"},
    {FindingCode::crowded_instant, "crowded instant"},
    {FindingCode::unknown_barcode, "unknown barcode"},
    {FindingCode::slip_without_gyro, "slip not judged"},
    {FindingCode::slip_in_a_curve, "slip not judged"},
    {FindingCode::slip_unlike_learned, "slip not judged"},
    {FindingCode::not_normal, "not normal"},
    {FindingCode::nothing_to_smooth, "nothing to smooth"},
    {FindingCode::lost, "lost"},
    {FindingCode::misplaced_landmark, "misplaced landmark"},
    {FindingCode::noise, "noise"},
    {FindingCode::not_converged, "not converged"},
    {FindingCode::smoother_contradicts, "smoother contradicts filter"},
    {FindingCode::range_offset, "range offset"},
    {FindingCode::bearing_offset, "bearing offset"},
    {FindingCode::depths, "depths for distances"},
};
// In the order of the codes, so that none is forgotten.
static_assert(std::ranges::all_of(kNames,
                                  [](const auto& name) {
                                    return name.first == static_cast<FindingCode>(&name - kNames);
                                  }),
              "kNames has the order of FindingCode");
static_assert(std::size(kNames) == kFindingCodes, "a FindingCode has no name here");

}  // namespace

std::string_view name_of(FindingCode code) {
  return kNames[static_cast<std::size_t>(code)].second;
}

}  // namespace trundle::recording
