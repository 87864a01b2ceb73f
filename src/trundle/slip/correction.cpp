#include "trundle/slip/correction.hpp"

#include <algorithm>
#include <cmath>

#include "trundle/chassis/ground_turned.hpp"
#include "trundle/geometry/squared.hpp"

namespace trundle::slip {
namespace {

// A slipping wheel's reading has at least this many times its sigma: it pulls the estimate by a percent.
constexpr double kInflation = 10.0;

/// Variance of a reading that may be wrong by `slip_m` now, and by `so_far_m` over the slip: the same wheel
/// all along, so that the errors of its intervals add up.
double slip_variance(double slip_m, double so_far_m, double sigma_m, double longest_m) {
  return std::max(slip_m * (2.0 * so_far_m - slip_m), squared(std::min(kInflation * sigma_m, longest_m)));
}

/// The variance that makes the slip distance likeliest: none where it may be noise.
double likeliest_variance(double slip_m, double sigma_m) {
  return std::max(0.0, squared(slip_m) - squared(sigma_m));
}

}  // namespace

Increment corrected(const Increment& increment, const SlipCorrection& correction, const Chassis& chassis) {
  Increment result = increment;
  const auto wheels = chassis.wheels();
  for (std::size_t i = 0; i < wheels.size(); ++i) result.slip_variance[i] += correction.variance[i];
  if (correction.rebuilt_wheel < 0) return result;
  // d' = other + B tan g, clamped so that it never turns against the motion: docs/theory/slip-published.md,
  // eq. 5.
  const auto slips = static_cast<std::size_t>(correction.rebuilt_wheel);
  const auto rolls = static_cast<std::size_t>(correction.other_wheel);
  const double g = (increment.gyro_rad - correction.bias_rad_s * increment.duration_s) * chassis.gyro->scale;
  const double other = kPi * wheels[rolls].diameter_m * ground_turned(chassis, rolls, increment);
  const double travel = other + correction.track_m * std::tan(g);
  result.turned[slips] = travel * other < 0.0 ? 0.0 : travel / (kPi * wheels[slips].diameter_m);
  result.speed_turned[slips] = 0.0;  // that is of the ground
  return result;
}

SlipCorrection mixture_of(const SlipEvidence& slip, const Contradiction& c, bool slipping) {
  SlipCorrection correction;
  const bool stuck = slip.is_stuck();
  const SlipEvidence::Attribution who = slip.attribute();
  const Faults& faults = slip.faults();
  for (std::size_t i = 0; i < faults.size(); ++i) {
    const auto wheel = static_cast<std::size_t>(faults[i].wheel);
    if (stuck && faults[i].sideways) continue;
    // Stuck: all travel of every wheel is slip.
    const double probability = stuck ? 1.0 : who.probability[i];
    const double now_m = stuck ? c.travel[wheel] : c.excess_m[i];
    if (now_m == 0.0) continue;
    const double so_far_m = stuck ? slip.travel_m(wheel) : slip.excess_m(i);
    correction.variance[wheel] +=
        probability * (slipping ? slip_variance(now_m, so_far_m, c.excess_sigma_m[i], c.longest_slip_m)
                                : likeliest_variance(now_m, c.excess_sigma_m[i]));
  }
  return correction;
}

SlipCorrection rebuilt(int wheel, const Contradiction& c, const Rows& rows, const GyroBias& bias) {
  SlipCorrection correction;
  correction.rebuilt_wheel = wheel;
  correction.other_wheel = 1 - wheel;
  correction.track_m = rows.H(wheel, 2) - rows.H(correction.other_wheel, 2);
  correction.bias_rad_s = bias.rad_s;
  const auto i = static_cast<std::size_t>(wheel);
  correction.variance[i] = squared(c.excess_sigma_m[i]);
  return correction;
}

}  // namespace trundle::slip
