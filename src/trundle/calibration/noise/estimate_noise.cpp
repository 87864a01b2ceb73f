#include "trundle/calibration/noise/estimate_noise.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "trundle/calibration/likelihood/run_likelihood.hpp"
#include "trundle/calibration/noise/growth.hpp"
#include "trundle/calibration/noise/learn_noise.hpp"
#include "trundle/calibration/noise/level_search.hpp"
#include "trundle/geometry/squared.hpp"

namespace trundle::calibration {
namespace {

// A level from n residuals, two or three at each epoch, is known to 1/√(2n) of itself: to a sixth.
constexpr std::size_t kFewestEpochs = 11;
// Less is below the resolution of any encoder or reference, more is none: there levels are looked for.
constexpr double kSmallest = 1e-5, kLargestWheelNoise = 3.0,
                 kLargestReferenceNoise = 1.0;  // [m/√m]; [m], [rad]
constexpr double kLargestGyroNoise = 1.0;       // [rad/s/√Hz]
// Times that every level is sought while the others stay, at most.
constexpr int kMostRounds = 4;
// Of a level between those two: to 1e-5 of its logarithm.
constexpr int kHalvingsOfReference = 20;
// Squared innovations beyond this, Mahalanobis and of one component (1e-6 by chance), are lost tracking.
constexpr double kLargestInnovation = 30.0, kLargestSquare = 24.0;
// Of a level that is averaged over: from one to the next.
constexpr double kNextLevel = 1.4142135623730951;
// Deviance above the least beyond which a level is impossible: e⁻⁸ of its likelihood.
constexpr double kImpossible = 16.0;
// What the robot file says of a sensor's noise is true within a factor of three: 1σ of its logarithm.
constexpr double kGivenWithin = 1.1;
// Correlation of neighbouring innovations beyond which they are taken for one error, 39 times as long.
constexpr double kLargestCorrelation = 0.95;

Robot noisy_robot(const Robot& robot, const NoiseLevels& levels) {
  return without_rounding(with_noise(robot, levels));
}

std::vector<Innovation> innovations_of(const Run& run, const Robot& noisy, const ReferenceNoise& noise) {
  return stream_likelihood(run, noisy, {}, {.reference_noise = noise}).innovations;
}

/// Beyond the limit its slope by the logarithm of the levels stays what it is there. Cut off altogether, no
/// noise at all would be the likeliest: all innovations beyond the limit, and log |S| without one.
double bounded(double squared_mahalanobis) {
  if (squared_mahalanobis <= kLargestInnovation) return squared_mahalanobis;
  return kLargestInnovation * (1.0 + std::log(squared_mahalanobis / kLargestInnovation));
}

/// docs/theory/calibration-noise.md, eq. 8c.
double innovation_deviance(std::span<const Run> runs, const Robot& robot, const NoiseLevels& levels) {
  const Robot noisy = noisy_robot(robot, levels);
  double deviance = 0.0;
  for (const Run& run : runs)
    for (const Innovation& innovation : innovations_of(run, noisy, levels.reference))
      deviance += bounded(innovation.squared_mahalanobis) + innovation.log_determinant;
  return deviance;
}

/// Mean of z² of the innovations of x, y and heading from `first` on, before `end`, outliers bounded: 1 is
/// consistent.
double innovation_size(std::span<const Run> runs, const Robot& robot, const NoiseLevels& levels, int first,
                       int end) {
  const Robot noisy = noisy_robot(robot, levels);
  double sum = 0.0, count = 0.0;
  for (const Run& run : runs)
    for (const Innovation& innovation : innovations_of(run, noisy, levels.reference))
      for (int i = first; i < end; ++i)
        if (const double z = innovation.normalised[i]; z != 0.0) {
          sum += std::min(z * z, kLargestSquare);
          count += 1.0;
        }
  return count == 0.0 ? 1.0 : sum / count;
}

/// The level of the reference that makes its innovations as large as they are said to be.
double consistent_reference(std::span<const Run> runs, const Robot& robot, NoiseLevels levels,
                            double ReferenceNoise::*level, int first, int end) {
  return consistent_level(kSmallest, kLargestReferenceNoise, kHalvingsOfReference, [&](double noise) {
    levels.reference.*level = noise;
    return innovation_size(runs, robot, levels, first, end);
  });
}

bool have_headings(std::span<const Run> runs) {
  return std::ranges::any_of(runs, [](const Run& run) { return run.reference.has_headings(); });
}

/// What innovations show: the gyro's is not less than what is known of it.
std::vector<FreeLevel> free_levels(std::span<const Run> runs, const Robot& robot) {
  std::vector<FreeLevel> levels = {
      {[](NoiseLevels& l) -> double& { return l.wheel_per_sqrt_m; }, kSmallest, kLargestWheelNoise},
      {[](NoiseLevels& l) -> double& { return l.reference.position_m; }, kSmallest, kLargestReferenceNoise}};
  if (have_headings(runs))
    levels.push_back({[](NoiseLevels& l) -> double& { return l.reference.heading_rad; }, kSmallest,
                      kLargestReferenceNoise});
  if (robot.chassis.gyro)
    levels.push_back({[](NoiseLevels& l) -> double& { return l.gyro_rad_s_sqrt_hz; },
                      std::max(robot.chassis.gyro->noise_rad_s_sqrt_hz, kSmallest), kLargestGyroNoise});
  return levels;
}

/// Of what the levels of the sensors on board are beside those of the robot file, of which innovations may
/// show next to nothing. docs/theory/calibration-noise.md, eq. 8c.
double deviance_from_given(const NoiseLevels& levels, const NoiseLevels& given) {
  const auto sigmas = [](double level, double as_given) {
    return std::log(std::max(level, kSmallest) / std::max(as_given, kSmallest)) / kGivenWithin;
  };
  return squared(sigmas(levels.wheel_per_sqrt_m, given.wheel_per_sqrt_m)) +
         squared(sigmas(levels.gyro_rad_s_sqrt_hz, given.gyro_rad_s_sqrt_hz));
}

/// Root of the mean of the squares that the wheels' noise may have, by how likely each is: that nothing was
/// seen of it does not mean that there is none. `deviance`: eq. 8d.
double possible_wheel_noise(const NoiseLevels& likeliest, const Deviance& deviance) {
  const double least = deviance(likeliest);
  if (!std::isfinite(least)) return likeliest.wheel_per_sqrt_m;
  double sum = 0.0, weights = 0.0;
  const auto take = [&](double level) {  // returns whether it is possible
    NoiseLevels levels = likeliest;
    levels.wheel_per_sqrt_m = level;
    const double above = deviance(levels) - least;
    const double weight = std::exp(-0.5 * above);
    sum += weight * level * level;
    weights += weight;
    return above < kImpossible;
  };
  double level = likeliest.wheel_per_sqrt_m;
  while (level < kLargestWheelNoise && take(level)) level *= kNextLevel;
  level = likeliest.wheel_per_sqrt_m / kNextLevel;
  while (level > kSmallest && take(level)) level /= kNextLevel;
  return std::sqrt(sum / weights);
}

/// Correlation of each normalised innovation with the one before it; 0 where it may be chance.
Vector3 autocorrelation(std::span<const Run> runs, const Robot& robot, const ReferenceNoise& noise) {
  Vector3 lagged = Vector3::Zero();
  Vector3 own = Vector3::Zero();
  double count = 0.0;
  const auto cut = [](const Innovation& i) { return i.normalised.cwiseMax(-3.0).cwiseMin(3.0).eval(); };
  for (const Run& run : runs) {
    const std::vector<Innovation> innovations = innovations_of(run, robot, noise);
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

/// Of the epochs of a run; many runs of few epochs show one stretch of each.
bool have_innovations(std::span<const Run> runs) {
  return std::ranges::any_of(runs, [](const Run& run) { return run.epochs.size() >= kFewestEpochs; });
}

/// The levels that make the innovations likeliest.
NoiseLevels levels_by_innovations(std::span<const Run> runs, const Robot& robot, const NoiseEstimate& before,
                                  const std::function<Deviance()>& restriction) {
  const NoiseLevels given = noise_levels_of(robot);
  const Deviance deviance = [&](const NoiseLevels& levels) {
    return innovation_deviance(runs, robot, levels) + deviance_from_given(levels, given);
  };
  NoiseLevels levels = before.from_runs ? before.levels : given;
  levels.reference.position_persistence = levels.reference.heading_persistence = 1.0;
  improve(free_levels(runs, robot), kMostRounds, deviance, levels,
          before.from_runs ? Search::nearby : Search::everywhere);
  const Deviance restricted = restriction();
  levels.wheel_per_sqrt_m =
      possible_wheel_noise(levels, [&](const NoiseLevels& at) { return deviance(at) + restricted(at); });
  return levels;
}

/// Where headings are the wheels' and the reference shows them: the wheels' by what grows of their
/// differences, whatever the reference errs by for seconds; its own by how large innovations are.
std::optional<NoiseLevels> levels_by_growth(std::span<const Run> runs, const Robot& robot,
                                            std::span<const Parameter> fitted) {
  if (robot.chassis.gyro || !have_headings(runs) || !owes_headings_to_wheels(robot)) return std::nullopt;
  NoiseLevels levels = noise_levels_of(robot);
  const auto growth = growth_of_heading(runs, noisy_robot(robot, levels), fitted);
  if (!growth) return std::nullopt;
  levels.wheel_per_sqrt_m = std::max(levels.wheel_per_sqrt_m * growth->possible, kSmallest);
  ReferenceNoise& reference = levels.reference;
  // Of none that positions would have to make up for, the reference's headings have what innovations show.
  reference.heading_rad = growth->reference_sigma > kSmallest
                              ? growth->reference_sigma
                              : consistent_reference(runs, robot, levels, &ReferenceNoise::heading_rad, 2, 3);
  reference.position_m = consistent_reference(runs, robot, levels, &ReferenceNoise::position_m, 0, 2);
  return levels;
}

/// Of runs of few epochs: by what odometry misses of all their displacements.
std::optional<NoiseLevels> levels_by_displacements(std::span<const Run> runs, const Robot& robot) {
  const auto learned = learn_noise_if_possible(runs, robot, {.per_wheel = false});
  if (!learned) return std::nullopt;
  NoiseLevels levels = learned->levels;
  levels.reference.position_m = std::max(levels.reference.position_m, kSmallest);
  levels.reference.heading_rad = std::max(levels.reference.heading_rad, kSmallest);
  return levels;
}

}  // namespace

NoiseEstimate estimate_noise(std::span<const Run> runs, const Robot& robot, std::span<const Parameter> fitted,
                             const NoiseEstimate& before, const std::function<Deviance()>& restriction) {
  std::optional<NoiseLevels> levels = levels_by_growth(runs, robot, fitted);
  if (!levels && have_innovations(runs)) levels = levels_by_innovations(runs, robot, before, restriction);
  if (levels)
    allow_for_correlation(runs, noisy_robot(robot, *levels), levels->reference);
  else
    levels = levels_by_displacements(runs, robot);
  return {levels.value_or(noise_levels_of(robot)), levels.has_value()};
}

}  // namespace trundle::calibration
