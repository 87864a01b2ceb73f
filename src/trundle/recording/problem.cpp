#include "trundle/recording/problem.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace trundle {
namespace {

constexpr std::pair<ProblemKind, std::string_view> kNames[] = {
    {ProblemKind::header, "header"},
    {ProblemKind::cut_off, "cut off"},
    {ProblemKind::not_a_number, "nan"},
    {ProblemKind::duplicate, "duplicate"},
    {ProblemKind::back_step, "back-step"},
    {ProblemKind::gap, "gap"},
    {ProblemKind::time_unit, "time unit"},
    {ProblemKind::bearing_unit, "bearing unit"},
    {ProblemKind::range_unit, "range unit"},
    {ProblemKind::reference_unit, "reference unit"},
    {ProblemKind::gyro_unit, "gyro unit"},
    {ProblemKind::increments, "increments"},
    {ProblemKind::fractions, "fractions"},
    {ProblemKind::clocks, "clocks"},
    {ProblemKind::time_offset, "time offset"},
    {ProblemKind::wrap, "wrap"},
    {ProblemKind::counter_reset, "counter reset"},
    {ProblemKind::counter_jump, "counter jump"},
    {ProblemKind::tick_bits, "tick_bits"},
    {ProblemKind::ticks_per_revolution, "ticks_per_revolution"},
    {ProblemKind::stuck_encoder, "stuck encoder"},
    {ProblemKind::bridged_gap, "bridged gap"},
    {ProblemKind::no_gyro, "no gyro"},
    {ProblemKind::no_rest, "no rest"},
    {ProblemKind::gyro_missing, "gyro missing"},
    {ProblemKind::gyro_saturated, "gyro saturated"},
    {ProblemKind::gyro_disturbed, "gyro disturbed"},
    {ProblemKind::gyro_beyond_its_bias, "gyro beyond its bias"},
    {ProblemKind::gyro_sign, "gyro sign"},
    {ProblemKind::gyro_against_wheels, "gyro against wheels"},
    {ProblemKind::unknown_wheel, "unknown wheel"},
    {ProblemKind::wiring, "wiring"},
    {ProblemKind::scale, "scale"},
    {ProblemKind::geometry, "geometry"},
    {ProblemKind::reference_axes, "reference axes"},
    {ProblemKind::sighting_of_a_robot, "sighting of a robot"},
    {ProblemKind::sighting_without_name, "sighting without name"},
    {ProblemKind::sighting_without_odometry, "sighting without odometry"},
    {ProblemKind::repeated_sighting, "repeated sighting"},
    {ProblemKind::crowded_instant, "crowded instant"},
    {ProblemKind::unknown_barcode, "unknown barcode"},
    {ProblemKind::slip_not_judged, "slip not judged"},
    {ProblemKind::not_normal, "not normal"},
    {ProblemKind::nothing_to_smooth, "nothing to smooth"},
    {ProblemKind::lost, "lost"},
    {ProblemKind::noise, "noise"},
    {ProblemKind::not_converged, "not converged"},
};
// In the order of the kinds, so that none is forgotten.
static_assert(std::ranges::all_of(kNames, [](const auto& name) {
  return name.first == static_cast<ProblemKind>(&name - kNames);
}));
static_assert(std::size(kNames) == static_cast<std::size_t>(ProblemKind::not_converged) + 1);

}  // namespace

std::string_view name_of(ProblemKind kind) {
  return kNames[static_cast<std::size_t>(kind)].second;
}

}  // namespace trundle
