#include "trundle/calibration/likelihood/gyro_bias_spread.hpp"

#include <cmath>
#include <vector>

#include "trundle/calibration/likelihood/restricted_likelihood.hpp"
#include "trundle/calibration/problem/run_gyro_bias.hpp"
#include "trundle/odometry/odometer.hpp"
#include "trundle/statistics/minimum.hpp"

namespace trundle::calibration {
namespace {

// Where it is looked for, times the robot file's, which is what a data sheet says of MEMS.
constexpr double kSmallestShare = 1e-6;  // less than any run shows
constexpr double kLargestShare = 100.0;  // the gyro is broken
// To which its logarithm is sought.
constexpr double kFinestLogSpread = 0.01;

/// −2 log of the restricted likelihood of the spread.
double deviance_of(double spread_rad_s, RunsInformation& runs) {
  for (std::vector<OwnParameter>& own : runs.own)
    for (OwnParameter& one : own)
      if (one.parameter == kGyroBias) one.prior_sigma = spread_rad_s;
  const Restriction restricted = restriction(runs);
  return restricted.log_determinant + restricted.chi2;
}

}  // namespace

double given_gyro_bias_spread(const CalibrationProblem& problem) {
  return have_own_gyro_bias(problem) ? initial_bias_sigma(problem.nominal) : 0.0;
}

GyroBiasSpread most_likely_spread(double given_rad_s, const std::function<double(double)>& deviance) {
  const Bracket bracket{std::log(kSmallestShare * given_rad_s), std::log(kLargestShare * given_rad_s),
                        kFinestLogSpread};
  const auto found = [&](double log_spread) { return deviance(std::exp(log_spread)); };
  // Of a gamma distribution with the shape 2 [Chung et al. 2013], whose mode is the robot file's.
  const auto with_prior = [&](double log_spread) {
    return found(log_spread) - 2.0 * log_spread + 2.0 * std::exp(log_spread) / given_rad_s;
  };
  GyroBiasSpread spread{std::exp(minimum_within(bracket, found)),
                        std::exp(minimum_within(bracket, with_prior))};
  if (spread.found_rad_s < 2.0 * kSmallestShare * given_rad_s) spread.found_rad_s = 0.0;
  return spread;
}

GyroBiasSpread gyro_bias_spread(const Likelihood& likelihood, const Robot& robot) {
  const double given = given_gyro_bias_spread(likelihood.problem);
  if (given == 0.0) return {};
  RunsInformation runs = information_of_runs(likelihood, robot);
  return most_likely_spread(given, [&](double spread_rad_s) { return deviance_of(spread_rad_s, runs); });
}

}  // namespace trundle::calibration
