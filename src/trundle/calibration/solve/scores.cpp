#include "trundle/calibration/solve/scores.hpp"

#include <algorithm>
#include <cmath>

#include "trundle/geometry/decompositions.hpp"
#include "trundle/statistics/median.hpp"

namespace trundle::calibration {
namespace {

// The median of four is not moved by one that is unlike the others; with fewer the runs' blocks are compared.
constexpr std::size_t kRunsForWeights = 4;
// Score beyond which a run counts less, in units of the typical run's: 1 % of Gaussian ones by chance.
constexpr double kOutlyingRun = 2.5;
// Of all information in a direction, for a run's score to be judged in it: below that it is its own noise.
constexpr double kShareThatCounts = 0.02;

/// gᵀ A⁺ g and the rank of A: the score statistic of a group of residuals, χ² distributed. Directions in
/// which the group knows next to nothing do not count: its own noise would pass for information there.
struct ScoreStatistic {
  double chi2 = 0.0;
  int rank = 0;

  double per_degree_of_freedom() const { return rank == 0 ? 0.0 : chi2 / rank; }
};

ScoreStatistic score_statistic(const Information& information, const Eigen::MatrixXd& whitening) {
  const SymmetricEigen eigen = symmetric_eigen(congruent(information.matrix, whitening));
  const Eigen::VectorXd g = eigen.vectors.transpose() * (whitening.transpose() * information.gradient);
  ScoreStatistic score;
  for (Eigen::Index k = 0; k < g.size(); ++k) {
    if (eigen.values[k] < kShareThatCounts) continue;
    score.chi2 += g[k] * g[k] / eigen.values[k];
    ++score.rank;
  }
  return score;
}

/// Columns that make the information of all runs the unit matrix, within the estimable space.
Eigen::MatrixXd whitening_of(const Likelihood& likelihood, const Robot& robot, const EstimableSpace& space) {
  const Eigen::MatrixXd B = space.scale.asDiagonal() * space.basis;
  return B * inverse_square_root(congruent(total_information(likelihood, robot).matrix, B));
}

}  // namespace

std::vector<double> run_weights(const Likelihood& likelihood, const Robot& robot,
                                const EstimableSpace& space) {
  const std::size_t runs = likelihood.runs().size();
  std::vector<double> weights(runs, 1.0);
  if (runs < kRunsForWeights || space.basis.cols() == 0) return weights;
  const Eigen::MatrixXd whitening = whitening_of(likelihood, robot, space);
  std::vector<double> score;
  for (std::size_t i = 0; i < runs; ++i) {
    const Information total = run_information(likelihood, i, robot).total(likelihood.problem.size());
    score.push_back(std::sqrt(score_statistic(total, whitening).per_degree_of_freedom()));
  }
  const double typical = std::max(median(score), 1.0);
  for (std::size_t i = 0; i < runs; ++i)
    weights[i] = std::min(1.0, std::pow(kOutlyingRun * typical / std::max(score[i], 1e-300), 2));
  return weights;
}

Dispersion dispersion_of(const Likelihood& likelihood, const Robot& robot, const EstimableSpace& space) {
  Dispersion dispersion;
  if (space.basis.cols() == 0) return dispersion;
  const Eigen::MatrixXd whitening = whitening_of(likelihood, robot, space);
  const Eigen::Index n = likelihood.problem.size();
  double chi2 = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < likelihood.runs().size(); ++i) {
    RunInformation run = run_information(likelihood, i, robot);
    const double weight = likelihood.run_weight[i];
    const Information total = run.total(n);
    Information weighted = Information::zero(n);
    weighted.add(total, weight);
    dispersion.runs.push_back({weight, score_statistic(total, whitening).per_degree_of_freedom(),
                               std::move(run.outliers), std::move(weighted)});
    const auto clusters = likelihood.runs().size() >= kRunsForWeights ? std::vector{total} : run.blocks;
    for (const Information& cluster : clusters) {
      const ScoreStatistic score = score_statistic(cluster, whitening);
      chi2 += weight * score.chi2;
      count += score.rank;
    }
  }
  dispersion.degrees_of_freedom = std::max(0, count - static_cast<int>(space.basis.cols()));
  if (dispersion.degrees_of_freedom > 0)
    dispersion.factor = std::max(1.0, chi2 / dispersion.degrees_of_freedom);
  return dispersion;
}

}  // namespace trundle::calibration
