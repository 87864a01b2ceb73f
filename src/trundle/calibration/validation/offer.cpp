#include "trundle/calibration/validation/offer.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "trundle/calibration/validation/cross_validation.hpp"
#include "trundle/calibration/validation/run_steps.hpp"
#include "trundle/geometry/decompositions.hpp"
#include "trundle/geometry/squared.hpp"
#include "trundle/io/error.hpp"
#include "trundle/statistics/distribution.hpp"

namespace trundle::calibration {
namespace {

double growth(const Information& information, const Eigen::VectorXd& step) {
  return information.gradient.dot(step) - 0.5 * step.dot(information.matrix * step);
}

/// By how much the log-likelihood of what was left out is larger where the rest may say what the last
/// parameter is, which the estimate has moved so far: docs/theory/scrub.md, eq. 6.
double gain(const RunSteps& steps, const Information& left_out, const Information& rest, double last_moved) {
  const Eigen::VectorXd free = steps.step(rest);
  const Eigen::VectorXd row = steps.basis().bottomRows<1>().transpose();
  const Eigen::VectorXd along = solve_ldlt(RunSteps::precision(rest), row);
  const Eigen::VectorXd held = free - along * ((row.dot(free) + last_moved) / row.dot(along));
  return growth(left_out, free) - growth(left_out, held);
}

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
  const RunSteps steps(estimate, more.nominal, more.parameters);
  const Information all = steps.of_all(estimate.runs);
  ParameterOffer offer{.parameter = parameter,
                       .name = name_of(parameter, estimate.robot),
                       .given = value_of(parameter, problem.nominal),
                       .value = value_of(parameter, estimate.robot),
                       .sigma = std::sqrt(estimate.covariance(last, last)),
                       .parts = parts.size(),
                       .of_halves = of_halves,
                       .degrees_of_freedom = estimate.degrees_of_freedom};
  for (const RunEvidence& part : estimate.runs) {
    const Information left_out = steps.of(part);
    Information rest = all;
    rest.add(left_out, -1.0);
    offer.gain += gain(steps, left_out, rest, offer.value - offer.given);
  }
  return offer;
}

}  // namespace

bool ParameterOffer::is_significant() const {
  const double of_all = squared((value - given) / sigma);
  return degrees_of_freedom > 0 && std::min(2.0 * gain, of_all) > f_limit(kLevel, 1.0, degrees_of_freedom);
}

std::string ParameterOffer::words() const {
  const int digits = static_cast<int>(std::clamp(-std::floor(std::log10(sigma)), 3.0, 12.0));
  return fmt::format(
      "{0} {1:.{7}f} ± {2:.{7}f} would explain {3}, by what the other{4}, better: log-likelihood +{5:.1f}, "
      "significant at {6:g} %; --free {0} estimates it",
      name, value, sigma, of_halves ? "each half of the run" : "each run", of_halves ? " says" : "s say",
      gain, 100.0 * kLevel, digits);
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
