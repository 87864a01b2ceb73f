#include "trundle/calibration/likelihood/gyro_bias_spread.hpp"

#include <cmath>
#include <limits>
#include <vector>

#include "trundle/calibration/problem/run_gyro_bias.hpp"
#include "trundle/geometry/decompositions.hpp"
#include "trundle/odometry/odometer.hpp"
#include "trundle/statistics/minimum.hpp"

namespace trundle::calibration {
namespace {

// Where it is looked for, times the robot file's, which is what a data sheet says of MEMS.
constexpr double kSmallestShare = 1e-6;  // less than any run shows
constexpr double kLargestShare = 100.0;  // the gyro is broken
// To which its logarithm is sought.
constexpr double kFinestLogSpread = 0.01;

/// What each run says of the shared parameters and its own.
struct RunsInformation {
  std::vector<Information> information;
  std::vector<std::vector<OwnParameter>> own;
  Eigen::VectorXd scale;  ///< of the shared ones: prior sigmas
};

RunsInformation information_of_runs(const Likelihood& likelihood, const Robot& robot) {
  RunsInformation runs{.information = {},
                       .own = {},
                       .scale = prior_sigmas(likelihood.problem.parameters, likelihood.problem.nominal)};
  for (std::size_t i = 0; i < likelihood.runs().size(); ++i) {
    std::vector<OwnParameter> own = likelihood.own_of(likelihood.runs()[i]);
    runs.information.push_back(information_with_own(likelihood, i, robot)
                                   .total(likelihood.problem.size() + static_cast<Eigen::Index>(own.size())));
    runs.own.push_back(std::move(own));
  }
  return runs;
}

/// −2 log of the restricted likelihood of the spread, the shared parameters integrated over.
double deviance_of(double spread_rad_s, RunsInformation& runs) {
  const Eigen::Index n = runs.scale.size();
  Information sum = Information::zero(n);
  double deviance = 0.0;
  for (std::size_t i = 0; i < runs.information.size(); ++i) {
    for (OwnParameter& one : runs.own[i])
      if (one.parameter == kGyroBias) one.prior_sigma = spread_rad_s;
    if (!runs.own[i].empty()) deviance += log_determinant_of_own(runs.information[i], runs.own[i]);
    for (const Information& part : without_own({runs.information[i]}, runs.own[i])) sum.add(part);
  }
  Eigen::MatrixXd A = runs.scale.asDiagonal() * sum.matrix * runs.scale.asDiagonal();
  A.diagonal().array() += 1.0;  // what the runs do not show is as the robot file says
  const auto misfit = gaussian_misfit(runs.scale.cwiseProduct(sum.gradient), A);
  if (!misfit) return std::numeric_limits<double>::infinity();
  return deviance + sum.chi2 - misfit->squared_mahalanobis + misfit->log_determinant;
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
