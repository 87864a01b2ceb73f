#include "trundle/calibration/noise/estimate_noise.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "trundle/calibration/noise/growth.hpp"
#include "trundle/calibration/noise/learn_noise.hpp"
#include "trundle/calibration/run_likelihood.hpp"

namespace trundle::calibration {
namespace {

// Less is below the resolution of any encoder or reference: it would only make matrices singular.
constexpr double kSmallestWheelNoise = 1e-5;  // [m/√m]
constexpr double kSmallestHeadingNoise_rad = 1e-5;
constexpr double kSmallestPositionNoise_m = 1e-5;  // to 1 m or rad: where the reference's noise is looked for
constexpr double kLargestReferenceNoise = 1.0;     // by 20 bisections: to 1e-5 of its logarithm
// Correlation of neighbouring innovations beyond which they are taken for one error, 39 times as long.
constexpr double kLargestCorrelation = 0.95;
// Squared innovations beyond this (1e-6 by chance) count as that much: lost tracking.
constexpr double kLargestInnovation = 24.0;

Robot noisy_robot(const Robot& robot, const NoiseLevels& levels) {
  return without_rounding(with_noise(robot, levels));
}

/// A level of the reference's noise, and which of x, y, heading show it.
struct Shown {
  double ReferenceNoise::*sigma;
  int first, end;
  double smallest;
};
constexpr Shown kPosition{&ReferenceNoise::position_m, 0, 2, kSmallestPositionNoise_m};
constexpr Shown kHeading{&ReferenceNoise::heading_rad, 2, 3, kSmallestHeadingNoise_rad};

/// Mean squared innovation per scalar, outliers cut; 1 is consistent.
double innovation_size(std::span<const Run> runs, const Robot& robot, const ReferenceNoise& noise,
                       const Shown& of) {
  double sum = 0.0, count = 0.0;
  for (const Run& run : runs)
    for (const Innovation& innovation :
         stream_likelihood(run, robot, {}, {.reference_noise = noise}).innovations)
      for (int i = of.first; i < of.end; ++i)
        if (const double z = innovation.normalised(i); z != 0.0) {
          sum += std::min(z * z, kLargestInnovation);
          count += 1.0;
        }
  return count == 0.0 ? 1.0 : sum / count;
}

/// The level that makes its innovations as large as expected: bisection on its logarithm.
double consistent_noise(std::span<const Run> runs, const Robot& robot, ReferenceNoise noise,
                        const Shown& of) {
  double low = std::log(of.smallest);
  double high = std::log(kLargestReferenceNoise);
  for (int i = 0; i < 20; ++i) {
    const double middle = 0.5 * (low + high);
    noise.*of.sigma = std::exp(middle);
    (innovation_size(runs, robot, noise, of) > 1.0 ? low : high) = middle;
  }
  return std::exp(high);
}

/// Of the reference's headings, by the growth of their differences; where that shows none, as over short lags
/// what a gyro walks hides it, by innovations. Taken for none, it would have to be the positions that make up
/// for it.
void set_heading_noise(std::span<const Run> runs, const Robot& robot, const std::optional<Growth>& growth,
                       NoiseLevels& levels) {
  ReferenceNoise& reference = levels.reference;
  reference.heading_rad = growth ? growth->reference_sigma : 0.0;
  if (reference.heading_rad > kSmallestHeadingNoise_rad) return;
  reference.heading_rad = consistent_noise(runs, noisy_robot(robot, levels), reference, kHeading);
}

/// Correlation of each normalised innovation with the one before it; 0 where it may be chance.
Vector3 autocorrelation(std::span<const Run> runs, const Robot& robot, const ReferenceNoise& noise) {
  Vector3 lagged = Vector3::Zero();
  Vector3 own = Vector3::Zero();
  double count = 0.0;
  const auto cut = [](const Innovation& i) { return i.normalised.cwiseMax(-3.0).cwiseMin(3.0).eval(); };
  for (const Run& run : runs) {
    const auto innovations = stream_likelihood(run, robot, {}, {.reference_noise = noise}).innovations;
    for (std::size_t i = 1; i < innovations.size(); ++i) {
      lagged += cut(innovations[i - 1]).cwiseProduct(cut(innovations[i]));
      own += cut(innovations[i]).cwiseAbs2();
      count += 1.0;
    }
  }
  const Vector3 rho = lagged.cwiseQuotient(own.cwiseMax(1e-12)).cwiseMin(kLargestCorrelation);
  const double chance = 3.0 / std::sqrt(std::max(count, 1.0));  // three sigma
  return (rho.array() > chance).select(rho, 0.0);
}

/// Errors that persist over several epochs teach less than their number suggests: a mean of n values with
/// correlation ρ from one to the next has the variance of n (1 − ρ)/(1 + ρ) independent ones.
void allow_for_correlation(std::span<const Run> runs, const Robot& robot, ReferenceNoise& noise) {
  const Vector3 rho = autocorrelation(runs, robot, noise);
  const double position = 0.5 * (rho.x() + rho.y());
  noise.position_persistence = std::sqrt((1.0 + position) / (1.0 - position));
  noise.heading_persistence = std::sqrt((1.0 + rho.z()) / (1.0 - rho.z()));
}

/// The robot as if its gyro were perfect: what then grows in its position is the wheels'.
Robot with_perfect_gyro(Robot robot) {
  robot.chassis.gyro->noise_rad_s_sqrt_hz = 0.0;
  robot.chassis.gyro->bias_walk_rad_s_sqrt_s = 0.0;
  return robot;
}

double grown(double wheel_per_sqrt_m, const Growth& growth) {
  return std::max(wheel_per_sqrt_m * growth.possible, kSmallestWheelNoise);
}

/// Where a gyro shows the heading, the heading shows the gyro's noise, and the position the wheels'.
bool set_by_growth_with_gyro(std::span<const Run> runs, const Robot& robot, NoiseLevels& levels) {
  if (!have_lags(runs)) return false;
  const auto set_wheels = [&] {
    const auto growth = growth_of_position(runs, with_perfect_gyro(noisy_robot(robot, levels)),
                                           {levels.gyro_rad_s_sqrt_hz, levels.reference.heading_rad});
    if (growth) levels.wheel_per_sqrt_m = grown(levels.wheel_per_sqrt_m, *growth);
    return growth.has_value();
  };
  if (!set_wheels()) return false;  // as far as headings are known by the robot file
  const auto of_heading = growth_of_heading(runs, noisy_robot(robot, levels));
  if (of_heading) levels.gyro_rad_s_sqrt_hz *= std::max(of_heading->odometry, 1.0);
  set_heading_noise(runs, robot, of_heading, levels);
  set_wheels();
  return true;
}

bool set_by_growth_of_wheels(std::span<const Run> runs, const Robot& robot, NoiseLevels& levels) {
  const auto growth = growth_of_heading(runs, noisy_robot(robot, levels));
  if (!growth) return false;
  levels.wheel_per_sqrt_m = grown(levels.wheel_per_sqrt_m, *growth);
  set_heading_noise(runs, robot, growth, levels);
  return true;
}

/// Runs too short for lags: by what odometry misses of their displacements.
std::optional<NoiseLevels> levels_by_likelihood(std::span<const Run> runs, const Robot& robot) {
  const auto learned = learn_noise_if_possible(runs, robot, {.per_wheel = false});
  if (!learned) return std::nullopt;
  NoiseLevels levels = learned->levels;
  levels.reference.position_m = std::max(levels.reference.position_m, kSmallestPositionNoise_m);
  levels.reference.heading_rad = std::max(levels.reference.heading_rad, kSmallestHeadingNoise_rad);
  return levels;
}

}  // namespace

NoiseEstimate estimate_noise(std::span<const Run> runs, const Robot& robot) {
  NoiseEstimate noise{noise_levels_of(robot), false};
  noise.from_runs = robot.chassis.gyro ? set_by_growth_with_gyro(runs, robot, noise.levels)
                                       : set_by_growth_of_wheels(runs, robot, noise.levels);
  if (!noise.from_runs)
    if (const auto levels = levels_by_likelihood(runs, robot)) return {*levels, true};
  const Robot noisy = noisy_robot(robot, noise.levels);
  ReferenceNoise& reference = noise.levels.reference;
  reference.position_m = consistent_noise(runs, noisy, reference, kPosition);
  allow_for_correlation(runs, noisy, reference);
  return noise;
}

}  // namespace trundle::calibration
