#include "trundle/calibration/validation/sessions.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include "trundle/calibration/problem/run_gyro_bias.hpp"
#include "trundle/statistics/distribution.hpp"

namespace trundle::calibration {
namespace {

// From which another is predicted: the spread of two has one degree of freedom, and Student's t is 12.7 then.
constexpr std::size_t kFewestSessionsToLearnFrom = 3;

constexpr double kOutsideOneSigma = 0.317310507862914;  // of a normal distribution

struct SessionEstimate {
  Eigen::VectorXd value;
  Eigen::VectorXd sigma;
};

bool observes_as_much(const EstimableSpace& one, const EstimableSpace& all) {
  return one.basis.cols() >= all.basis.cols();
}

SessionEstimate estimate_of(const Estimate& estimate, std::span<const Parameter> parameters) {
  return {values_of(estimate.robot, parameters), estimate.covariance.diagonal().cwiseMax(0.0).cwiseSqrt()};
}

struct MeanAndCovariance {
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;
};

MeanAndCovariance scatter_of(const std::vector<SessionEstimate>& estimates) {
  const auto k = static_cast<double>(estimates.size());
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(estimates.front().value.size());
  for (const SessionEstimate& e : estimates) mean += e.value / k;
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(mean.size(), mean.size());
  for (const SessionEstimate& e : estimates)
    covariance += (e.value - mean) * (e.value - mean).transpose() / (k - 1.0);
  return {mean, covariance};
}

void predict_each_from_the_others(const std::vector<SessionEstimate>& estimates, const EstimableSpace& space,
                                  SessionSpread& spread) {
  for (std::size_t left_out = 0; left_out < estimates.size(); ++left_out) {
    std::vector<SessionEstimate> others = estimates;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(left_out));
    const auto k = static_cast<double>(others.size());
    const MeanAndCovariance scatter = scatter_of(others);
    const double t = student_t_limit(0.05, static_cast<double>(others.size()) - 1.0);
    for (Eigen::Index j = 0; j < scatter.mean.size(); ++j) {
      if (!space.estimates(static_cast<int>(j))) continue;
      const SessionEstimate& seen = estimates[left_out];
      const double half_width =
          t * std::sqrt(scatter.covariance(j, j) * (1.0 + 1.0 / k) + seen.sigma[j] * seen.sigma[j]);
      ++spread.trials;
      if (std::abs(seen.value[j] - scatter.mean[j]) <= half_width) ++spread.hits;
    }
  }
}

}  // namespace

Eigen::MatrixXd SessionSpread::of_a_further_session() const {
  const double k = calibrated;
  const double t = student_t_limit(kOutsideOneSigma, k - 1.0);
  return t * t * (1.0 + 1.0 / k) * covariance;
}

SessionSpread session_spread(const CalibrationProblem& problem, const EstimableSpace& space) {
  std::set<std::string> sessions;
  for (const Run& run : problem.runs) sessions.insert(run.session);
  std::vector<Estimate> estimates;
  if (sessions.size() > 1)
    for (const std::string& session : sessions) {
      std::vector<Run> own_runs;
      for (const Run& run : problem.runs)
        if (run.session == session) own_runs.push_back(as_recorded(run));
      estimates.push_back(
          estimate_parameters({own_runs, problem.nominal, problem.parameters, problem.share_gyro_bias}));
    }
  return spread_of(estimates, problem.parameters, space);
}

SessionSpread spread_of(std::span<const Estimate> sessions, std::span<const Parameter> parameters,
                        const EstimableSpace& space) {
  SessionSpread spread;
  spread.sessions = std::max(1, static_cast<int>(sessions.size()));
  std::vector<SessionEstimate> estimates;
  for (const Estimate& estimate : sessions)
    if (observes_as_much(estimate.space, space)) estimates.push_back(estimate_of(estimate, parameters));
  spread.calibrated = static_cast<int>(estimates.size());
  if (estimates.size() < 2) return spread;
  spread.covariance = scatter_of(estimates).covariance;
  if (estimates.size() > kFewestSessionsToLearnFrom) predict_each_from_the_others(estimates, space, spread);
  return spread;
}

}  // namespace trundle::calibration
