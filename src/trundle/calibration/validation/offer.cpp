#include "trundle/calibration/validation/offer.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "trundle/calibration/solve/estimator.hpp"
#include "trundle/calibration/validation/cross_validation.hpp"
#include "trundle/geometry/decompositions.hpp"
#include "trundle/geometry/squared.hpp"
#include "trundle/io/error.hpp"
#include "trundle/statistics/distribution.hpp"

namespace trundle::calibration {
namespace {

/// The steps from an estimate in coordinates in which the prior is the unit matrix, and what they cost: with
/// its last parameter free, and with that back where it was.
class HeldOutSteps {
 public:
  HeldOutSteps(const Estimate& estimate, const CalibrationProblem& problem)
      : basis_(estimate.space.scale.asDiagonal() * estimate.space.basis), dispersion_(estimate.dispersion) {
    const Eigen::Index n = problem.size();
    Eigen::VectorXd moved(n);
    for (Eigen::Index j = 0; j < n; ++j) {
      const Parameter& parameter = problem.parameters[static_cast<std::size_t>(j)];
      moved[j] = value_of(parameter, estimate.robot) - value_of(parameter, problem.nominal);
    }
    last_moved_ = moved[n - 1];
    moved_ = estimate.space.basis.transpose() * moved.cwiseQuotient(estimate.space.scale);
  }

  Information of(const RunEvidence& part) const {
    Information information = Information::zero(basis_.cols());
    information.matrix = congruent(part.information.matrix, basis_) / dispersion_;
    information.gradient = basis_.transpose() * part.information.gradient / dispersion_;
    return information;
  }

  /// By how much the log-likelihood of what was left out is larger where the rest may say what the last
  /// parameter is: docs/theory/scrub.md, eq. 6.
  double gain(const Information& left_out, const Information& rest) const {
    const Eigen::MatrixXd precision = rest.matrix + Eigen::MatrixXd::Identity(basis_.cols(), basis_.cols());
    const Eigen::VectorXd free = solve_ldlt(precision, rest.gradient - moved_);
    const Eigen::VectorXd row = basis_.bottomRows<1>().transpose();
    const Eigen::VectorXd along = solve_ldlt(precision, row);
    const Eigen::VectorXd held = free - along * ((row.dot(free) + last_moved_) / row.dot(along));
    return growth(left_out, free) - growth(left_out, held);
  }

 private:
  static double growth(const Information& information, const Eigen::VectorXd& step) {
    return information.gradient.dot(step) - 0.5 * step.dot(information.matrix * step);
  }

  Eigen::MatrixXd basis_;  ///< of the parameters in their own units
  Eigen::VectorXd moved_;  ///< û: the estimate from nominal, in prior sigmas
  double last_moved_ = 0.0;
  double dispersion_;
};

/// Nothing where the parts do not show it. Throws CannotAnswer where the search leads nowhere.
std::optional<ParameterOffer> offer_of(const CalibrationProblem& problem, const Parameter& parameter) {
  const bool of_halves = problem.runs.size() == 1;
  std::vector<Run> parts = of_halves ? halves_of(problem.runs.front())
                                     : std::vector<Run>(problem.runs.begin(), problem.runs.end());
  if (parts.size() < 2) return std::nullopt;
  CalibrationProblem more{parts, problem.nominal, problem.parameters, of_halves || problem.share_gyro_bias};
  more.parameters.push_back(parameter);
  const Estimate estimate = estimate_parameters(more);
  const auto last = more.size() - 1;
  if (!estimate.space.estimates(static_cast<int>(last))) return std::nullopt;
  const HeldOutSteps steps(estimate, more);
  Information all = Information::zero(estimate.space.basis.cols());
  for (const RunEvidence& part : estimate.runs) all.add(steps.of(part));
  ParameterOffer offer{.parameter = parameter,
                       .name = name_of(parameter, estimate.robot),
                       .given = value_of(parameter, problem.nominal),
                       .value = value_of(parameter, estimate.robot),
                       .sigma = std::sqrt(estimate.covariance(last, last)),
                       .parts = parts.size(),
                       .of_halves = of_halves,
                       .degrees_of_freedom = estimate.degrees_of_freedom};
  for (const RunEvidence& part : estimate.runs) {
    Information rest = all;
    rest.add(steps.of(part), -1.0);
    offer.gain += steps.gain(steps.of(part), rest);
  }
  return offer;
}

}  // namespace

bool ParameterOffer::is_significant() const {
  const double of_all = squared((value - given) / sigma);
  return degrees_of_freedom > 0 && std::min(2.0 * gain, of_all) > f_limit(kLevel, 1.0, degrees_of_freedom);
}

std::string ParameterOffer::words() const {
  return fmt::format(
      "{0} {1:.3f} ± {2:.3f} would explain {3}, by what the other{4}, better: log-likelihood +{5:.1f}, "
      "significant at {6:g} %; --free {0} estimates it",
      name, value, sigma, of_halves ? "each half of the run" : "each run", of_halves ? " says" : "s say",
      gain, 100.0 * kLevel);
}

std::vector<ParameterOffer> offers_of(const CalibrationProblem& problem,
                                      std::span<const Parameter> parameters) {
  std::vector<ParameterOffer> offers;
  for (const Parameter& parameter : parameters) {
    try {
      const auto offer = offer_of(problem, parameter);
      if (offer && offer->is_significant()) offers.push_back(*offer);
    } catch (const CannotAnswer&) {  // nobody has asked for it
    }
  }
  return offers;
}

}  // namespace trundle::calibration
