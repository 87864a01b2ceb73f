#include "trundle/recording/problem.hpp"

namespace trundle {

std::string_view name_of(ProblemKind kind) {
  switch (kind) {
    case ProblemKind::header:
      return "header";
    case ProblemKind::cut_off:
      return "cut off";
    case ProblemKind::not_a_number:
      return "nan";
    case ProblemKind::duplicate:
      return "duplicate";
    case ProblemKind::back_step:
      return "back-step";
    case ProblemKind::gap:
      return "gap";
    case ProblemKind::time_unit:
      return "time unit";
    case ProblemKind::bearing_unit:
      return "bearing unit";
    case ProblemKind::range_unit:
      return "range unit";
    case ProblemKind::reference_unit:
      return "reference unit";
    case ProblemKind::gyro_unit:
      return "gyro unit";
    case ProblemKind::increments:
      return "increments";
    case ProblemKind::fractions:
      return "fractions";
    case ProblemKind::clocks:
      return "clocks";
    case ProblemKind::time_offset:
      return "time offset";
    case ProblemKind::wrap:
      return "wrap";
    case ProblemKind::counter_reset:
      return "counter reset";
    case ProblemKind::counter_jump:
      return "counter jump";
    case ProblemKind::tick_bits:
      return "tick_bits";
    case ProblemKind::ticks_per_revolution:
      return "ticks_per_revolution";
    case ProblemKind::stuck_encoder:
      return "stuck encoder";
    case ProblemKind::bridged_gap:
      return "bridged gap";
    case ProblemKind::no_gyro:
      return "no gyro";
    case ProblemKind::no_rest:
      return "no rest";
    case ProblemKind::gyro_missing:
      return "gyro missing";
    case ProblemKind::gyro_saturated:
      return "gyro saturated";
    case ProblemKind::gyro_disturbed:
      return "gyro disturbed";
    case ProblemKind::gyro_beyond_its_bias:
      return "gyro beyond its bias";
    case ProblemKind::gyro_sign:
      return "gyro sign";
    case ProblemKind::gyro_against_wheels:
      return "gyro against wheels";
    case ProblemKind::unknown_wheel:
      return "unknown wheel";
    case ProblemKind::wiring:
      return "wiring";
    case ProblemKind::scale:
      return "scale";
    case ProblemKind::geometry:
      return "geometry";
    case ProblemKind::reference_axes:
      return "reference axes";
    case ProblemKind::sighting_of_a_robot:
      return "sighting of a robot";
    case ProblemKind::sighting_without_name:
      return "sighting without name";
    case ProblemKind::sighting_without_odometry:
      return "sighting without odometry";
    case ProblemKind::repeated_sighting:
      return "repeated sighting";
    case ProblemKind::crowded_instant:
      return "crowded instant";
    case ProblemKind::unknown_barcode:
      return "unknown barcode";
    case ProblemKind::slip_not_judged:
      return "slip not judged";
    case ProblemKind::not_normal:
      return "not normal";
    case ProblemKind::nothing_to_smooth:
      return "nothing to smooth";
    case ProblemKind::lost:
      return "lost";
    case ProblemKind::noise:
      return "noise";
    case ProblemKind::not_converged:
      return "not converged";
  }
  return "";
}

}  // namespace trundle
