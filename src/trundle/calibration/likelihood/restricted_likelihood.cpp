#include "trundle/calibration/likelihood/restricted_likelihood.hpp"

#include <limits>

#include "trundle/geometry/decompositions.hpp"

namespace trundle::calibration {

RunsInformation information_of_runs(const Likelihood& likelihood, const Robot& robot) {
  RunsInformation runs{
      .information = {},
      .own = {},
      .prior_sigma = prior_sigmas(likelihood.problem.parameters, likelihood.problem.nominal)};
  for (std::size_t i = 0; i < likelihood.runs().size(); ++i) {
    std::vector<OwnParameter> own = likelihood.own_of(likelihood.runs()[i]);
    runs.information.push_back(information_with_own(likelihood, i, robot)
                                   .total(likelihood.problem.size() + static_cast<Eigen::Index>(own.size())));
    runs.own.push_back(std::move(own));
  }
  return runs;
}

Restriction restriction(const RunsInformation& runs) {
  Information sum = Information::zero(runs.prior_sigma.size());
  Restriction result;
  for (std::size_t i = 0; i < runs.information.size(); ++i) {
    if (!runs.own[i].empty())
      result.log_determinant += log_determinant_of_own(runs.information[i], runs.own[i]);
    for (const Information& part : without_own({runs.information[i]}, runs.own[i])) sum.add(part);
    result.chi2 -= runs.information[i].chi2;
  }
  Eigen::MatrixXd A = runs.prior_sigma.asDiagonal() * sum.matrix * runs.prior_sigma.asDiagonal();
  A.diagonal().array() += 1.0;  // what the runs do not show is as the robot file says
  const auto misfit = gaussian_misfit(runs.prior_sigma.cwiseProduct(sum.gradient), A);
  if (!misfit) return {std::numeric_limits<double>::infinity(), 0.0};
  result.log_determinant += misfit->log_determinant;
  result.chi2 += sum.chi2 - misfit->squared_mahalanobis;
  return result;
}

}  // namespace trundle::calibration
