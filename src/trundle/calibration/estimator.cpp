#include "trundle/calibration/estimator.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "trundle/calibration/chassis_likelihood.hpp"
#include "trundle/calibration/relative_likelihood.hpp"
#include "trundle/calibration/relative_table.hpp"
#include "trundle/statistics/median.hpp"

namespace trundle {
namespace {

constexpr int kMostIterations = 60;
// Steps in sigmas of the estimate, √(stepᵀ N step).
constexpr double kConverged = 1e-6;
constexpr double kNear = 1.0;        // from here on Gauss–Newton needs no look at χ²
constexpr double kNearEnough = 0.1;  // where gates and weights that follow the estimate let it go to and fro
constexpr double kGate = 30.0;       // squared Mahalanobis distance of a 3-D residual: 1e-6 by chance
constexpr std::size_t kFewestClusters = 12;  // runs are cut into pieces until there are so many
constexpr std::size_t kRunsForWeights = 4;   // so many are needed to see that one is unlike the others
constexpr double kOutlyingRun = 2.5;         // pull, in units of the typical run's
constexpr int kWeightRounds = 5;
// Noise and parameters are found in turn until no level moves by more than this: it changes weights by a
// tenth, and an estimate by far less than its sigma, which does not depend on weights to first order.
constexpr double kSameNoise = 0.05;
constexpr int kMostNoiseRounds = 8;
constexpr double kShareThatCounts = 0.02;  // of all information in a direction, for a run to be judged by it
constexpr int kMostHalvings = 10;
constexpr double kRounding = 1e-7;
constexpr double kWindow_s = 1.0;  // over which is summed what no motion explains
constexpr std::array kLongerWindows_s = {4.0, 16.0};
constexpr int kFewestWindows = 10;
constexpr NoiseEstimate kShortStretches{0.05, {.position_m = 0.05, .heading_rad = 0.2}, false};
constexpr NoiseEstimate kWholeRuns{1e-4, {.position_m = 0.005, .heading_rad = 0.02}, false};

/// All that is fixed while Gauss–Newton iterates.
struct Fit {
  std::span<const Run> runs;
  const Robot& nominal;
  std::span<const Parameter> parameters;
  bool moves_gyro_clock = false;  ///< the gyro's time offset is a parameter: its readings change with it
  NoiseEstimate noise;
  double chassis_variance_factor = 1.0;
  double gate = std::numeric_limits<double>::infinity();
  std::vector<Matrix3> relative_covariance;  ///< for each run
  std::vector<std::optional<RelativeTable>> relative_table;
  std::vector<double> weight;  ///< for each run

  Eigen::Index size() const { return static_cast<Eigen::Index>(parameters.size()); }
  int pieces() const {
    return runs.size() >= kFewestClusters
               ? 1
               : static_cast<int>((kFewestClusters + runs.size() - 1) / runs.size());
  }
};

Robot noisy_robot(const Robot& robot, const Fit& fit) {
  return with_noise_of_readings(with_noise(robot, fit.noise), fit.nominal.chassis);
}

void append(std::vector<Information>& all, const std::vector<Information>& more) {
  for (const Information& information : more)
    if (information.count > 0) all.push_back(information);
}

/// Of one run: in one fast pass where a table holds the whole problem, else motion by motion.
std::vector<Information> relative_information_of(const Run& run, std::size_t index, const Robot& robot,
                                                 const Fit& fit) {
  const Matrix3 W = fit.relative_covariance[index].inverse();
  const auto pieces = static_cast<std::size_t>(fit.pieces());
  if (fit.relative_table[index])
    return relative_information(*fit.relative_table[index], robot, fit.parameters, {W, fit.gate}, pieces);
  std::vector<Information> result(pieces, Information::zero(fit.size()));
  const RelativeResiduals r = relative_residuals(run, robot, fit.parameters);
  for (std::size_t i = 0; i < r.residual.size(); ++i)
    add_within(result[i * pieces / r.residual.size()], r.jacobian[i], W, r.residual[i], fit.gate);
  return result;
}

struct RunInformation {
  std::vector<Information> pieces;
  std::vector<OutlyingKnot> outliers;
};

RunInformation information_of(const Run& run, std::size_t index, const Robot& robot, const Fit& fit) {
  const Robot noisy = noisy_robot(robot, fit);
  RunInformation result;
  const RunLikelihood stream = stream_likelihood(run, noisy, fit.parameters,
                                                 {.reference_noise = fit.noise.reference,
                                                  .pieces = fit.pieces(),
                                                  .gyro_factor = fit.noise.gyro_factor,
                                                  .gate = fit.gate});
  append(result.pieces, stream.pieces);
  append(result.pieces, partial_likelihood(run, noisy, fit.parameters, fit.noise.gyro_factor).pieces);
  append(result.pieces, chassis_likelihood(run, noisy, fit.parameters,
                                           {.pieces = fit.pieces(),
                                            .variance_factor = fit.chassis_variance_factor,
                                            .window_s = kWindow_s,
                                            .gate = fit.gate}));
  if (!run.relative_motions.empty()) append(result.pieces, relative_information_of(run, index, noisy, fit));
  result.outliers = stream.outliers;
  return result;
}

RunInformation run_information(std::size_t index, const Robot& robot, const Fit& fit) {
  if (!fit.moves_gyro_clock) return information_of(fit.runs[index], index, robot, fit);
  Run run = fit.runs[index];
  set_gyro_clock(robot, run);
  return information_of(run, index, robot, fit);
}

Information total_information(const Robot& robot, const Fit& fit) {
  Information total = Information::zero(fit.size());
  for (std::size_t i = 0; i < fit.runs.size(); ++i)
    for (const Information& piece : run_information(i, robot, fit).pieces) total.add(piece, fit.weight[i]);
  return total;
}

void move(Robot& robot, std::span<const Parameter> parameters, const Eigen::VectorXd& step) {
  for (std::size_t j = 0; j < parameters.size(); ++j) {
    const double value = value_of(parameters[j], robot);
    const double moved = value + step[static_cast<Eigen::Index>(j)];
    if (moved != value) set_value(parameters[j], moved, robot);
  }
}

/// What is minimised: χ² of the runs plus that of the prior, `moved` being the way from nominal in prior
/// sigmas.
struct Objective {
  Information information;
  double value = 0.0;
};

Objective objective_at(const Robot& robot, const Fit& fit, const Eigen::VectorXd& moved,
                       double prior_weight) {
  Objective objective{total_information(robot, fit), 0.0};
  objective.value = objective.information.chi2 + prior_weight * moved.squaredNorm();
  return objective;
}

/// Gauss–Newton in the columns of `basis` (parameters in units of prior sigmas), from where the robot is,
/// `moved` from nominal. Far away a step that makes χ² larger is halved. Near the solution χ² is not asked:
/// it also falls where covariances of readings grow, which the gradient rightly leaves out.
/// docs/theory/calibration.md, eq. 6.
Descent descend(Robot& robot, const Fit& fit, const Eigen::VectorXd& scale, const Eigen::MatrixXd& basis,
                double prior_weight, int most_iterations) {
  Eigen::VectorXd moved = Eigen::VectorXd::Zero(scale.size());
  Objective here = objective_at(robot, fit, moved, prior_weight);
  const Eigen::MatrixXd B = scale.asDiagonal() * basis;
  Descent descent;
  for (; descent.iterations < most_iterations; ++descent.iterations) {
    Eigen::MatrixXd N = B.transpose() * here.information.matrix * B;
    N.diagonal().array() += prior_weight;
    Eigen::VectorXd step = N.ldlt().solve(B.transpose() * here.information.gradient -
                                          prior_weight * (basis.transpose() * moved));
    if (const double size = step.cwiseAbs().maxCoeff(); size > 1.0) step /= size;
    descent.last_step = std::sqrt(step.dot(N * step));
    (basis * step).cwiseAbs().maxCoeff(&descent.parameter);
    descent.converged = descent.last_step < kConverged;
    if (descent.converged) return descent;
    for (int halving = 0;; ++halving, step *= 0.5) {
      if (halving == kMostHalvings) return descent;
      Robot candidate = robot;
      move(candidate, fit.parameters, B * step);
      const Eigen::VectorXd there_moved = moved + basis * step;
      Objective there = objective_at(candidate, fit, there_moved, prior_weight);
      const bool good = descent.last_step < kNear || there.value <= here.value * (1.0 + kRounding);
      if (!std::isfinite(there.value) || !good) continue;
      robot = candidate;
      moved = there_moved;
      here = std::move(there);
      break;
    }
  }
  descent.converged = descent.last_step < kNearEnough;
  return descent;
}

/// Within the estimable space, without prior.
Descent iterate(Robot& robot, const Fit& fit, const EstimableSpace& space) {
  if (space.basis.cols() == 0) return {.converged = true};
  return descend(robot, fit, space.scale, space.basis, 0.0, kMostIterations);
}

/// A first rough estimate from anywhere near nominal: prior sigmas keep what is not seen where it is.
void approach(Robot& robot, const Fit& fit) {
  Eigen::VectorXd scale(fit.size());
  for (Eigen::Index j = 0; j < scale.size(); ++j)
    scale[j] = prior_sigma(fit.parameters[static_cast<std::size_t>(j)], fit.nominal);
  descend(robot, fit, scale, Eigen::MatrixXd::Identity(scale.size(), scale.size()), 1.0, 15);
}

/// gᵀ A⁺ g and the rank of A: the pull of a group of residuals on the parameters, χ² distributed. Directions
/// in which the group knows next to nothing do not count: its own noise would pass for information there.
struct Pull {
  double chi2 = 0.0;
  int rank = 0;
};

Pull pull_of(const Information& information, const Eigen::MatrixXd& whitening) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(whitening.transpose() * information.matrix *
                                                             whitening);
  const Eigen::VectorXd g = eigen.eigenvectors().transpose() * (whitening.transpose() * information.gradient);
  Pull pull;
  for (Eigen::Index k = 0; k < g.size(); ++k) {
    if (eigen.eigenvalues()[k] < kShareThatCounts) continue;
    pull.chi2 += g[k] * g[k] / eigen.eigenvalues()[k];
    ++pull.rank;
  }
  return pull;
}

/// Columns that make the information of all runs the unit matrix, within the estimable space.
Eigen::MatrixXd whitening_of(const Robot& robot, const Fit& fit, const EstimableSpace& space) {
  const Eigen::MatrixXd B = space.scale.asDiagonal() * space.basis;
  const Eigen::MatrixXd all = B.transpose() * total_information(robot, fit).matrix * B;
  return B * Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(all).operatorInverseSqrt();
}

/// Weights from each run's pull on the parameters, compared with the typical run's.
void weigh_runs(const Robot& robot, Fit& fit, const EstimableSpace& space) {
  if (fit.runs.size() < kRunsForWeights || space.basis.cols() == 0) return;
  const Eigen::MatrixXd whitening = whitening_of(robot, fit, space);
  std::vector<double> pull;
  for (std::size_t i = 0; i < fit.runs.size(); ++i) {
    Information total = Information::zero(fit.size());
    for (const Information& piece : run_information(i, robot, fit).pieces) total.add(piece);
    const Pull p = pull_of(total, whitening);
    pull.push_back(p.rank == 0 ? 0.0 : std::sqrt(p.chi2 / p.rank));
  }
  const double typical = std::max(median(pull), 1.0);
  for (std::size_t i = 0; i < pull.size(); ++i)
    fit.weight[i] = std::min(1.0, std::pow(kOutlyingRun * typical / std::max(pull[i], 1e-300), 2));
}

/// How much more than their noise the clusters (runs, or pieces of runs) pull.
void measure_dispersion(const Robot& robot, const Fit& fit, Estimate& estimate) {
  const Eigen::MatrixXd whitening = whitening_of(robot, fit, estimate.space);
  double chi2 = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < fit.runs.size(); ++i) {
    const RunInformation information = run_information(i, robot, fit);
    Information total = Information::zero(fit.size());
    for (const Information& piece : information.pieces) total.add(piece);
    const Pull run_pull = pull_of(total, whitening);
    Information weighted = Information::zero(fit.size());
    weighted.add(total, fit.weight[i]);
    estimate.runs.push_back({fit.weight[i], run_pull.rank == 0 ? 0.0 : run_pull.chi2 / run_pull.rank,
                             information.outliers, std::move(weighted)});
    for (const Information& cluster :
         fit.runs.size() >= kRunsForWeights ? std::vector{total} : information.pieces) {
      const Pull pull = pull_of(cluster, whitening);
      chi2 += fit.weight[i] * pull.chi2;
      count += pull.rank;
    }
  }
  estimate.degrees_of_freedom = std::max(0, count - static_cast<int>(estimate.space.basis.cols()));
  if (estimate.degrees_of_freedom > 0)
    estimate.dispersion = std::max(1.0, chi2 / estimate.degrees_of_freedom);
}

/// How much larger than the readings' noise that is which no motion explains, summed over windows: the median
/// over pieces of the runs. Nothing where runs are too short for such windows.
std::optional<double> chassis_variance_factor(const Robot& robot, const Fit& fit, double window_s) {
  std::vector<double> factors;
  int windows = 0;
  const Robot noisy = noisy_robot(robot, fit);
  for (const Run& run : fit.runs) {
    const auto& increments = run.readings.increments;
    const double duration = increments.empty() ? 0.0 : increments.back().time_s - run.readings.start_s;
    const int pieces = std::clamp(static_cast<int>(duration / (3.0 * window_s)), 1, 20);
    for (const Information& piece :
         chassis_likelihood(run, noisy, fit.parameters, {.pieces = pieces, .window_s = window_s})) {
      if (piece.count == 0) continue;
      factors.push_back(piece.chi2 / piece.count);
      windows += piece.count;
    }
  }
  if (windows < kFewestWindows) return std::nullopt;
  return std::max(median(factors), 1e-12);
}

/// Wheel noise also sets the weight of what no motion explains, so its scale is found anew.
void set_noise(const Robot& robot, const NoiseEstimate& noise, Fit& fit) {
  fit.noise = noise;
  fit.chassis_variance_factor = chassis_variance_factor(robot, fit, kWindow_s).value_or(1.0);
}

/// Errors that last for several windows (scrubbing, rollers) teach less than the number of windows suggests:
/// summed over longer windows they are larger than independent ones would be.
void allow_for_lasting_errors(const Robot& robot, Fit& fit) {
  for (const double window_s : kLongerWindows_s)
    if (const auto factor = chassis_variance_factor(robot, fit, window_s))
      fit.chassis_variance_factor = std::max(fit.chassis_variance_factor, *factor);
}

void learn_noise(const Robot& robot, Fit& fit) {
  set_noise(robot, estimate_noise(fit.runs, robot), fit);
  allow_for_lasting_errors(robot, fit);
  for (std::size_t i = 0; i < fit.runs.size(); ++i) {
    const auto residuals = relative_residuals(fit.runs[i], robot, fit.parameters).residual;
    if (!residuals.empty()) fit.relative_covariance[i] = robust_covariance(residuals);
  }
}

bool about_same(const NoiseEstimate& a, const NoiseEstimate& b) {
  const auto same = [](double x, double y) { return std::abs(x - y) <= kSameNoise * std::max(x, y); };
  return same(a.wheel_per_sqrt_m, b.wheel_per_sqrt_m) && same(a.gyro_factor, b.gyro_factor);
}

bool contains(std::span<const Parameter> parameters, ParameterKind kind) {
  return std::ranges::find(parameters, kind, &Parameter::kind) != parameters.end();
}

/// Which readings belong to a motion, and what they are, is fixed unless an offset of clocks is estimated.
std::vector<std::optional<RelativeTable>> relative_tables(std::span<const Run> runs, const Robot& nominal,
                                                          std::span<const Parameter> parameters) {
  std::vector<std::optional<RelativeTable>> tables(runs.size());
  if (contains(parameters, ParameterKind::time_offset) ||
      contains(parameters, ParameterKind::gyro_time_offset))
    return tables;
  std::ranges::transform(runs, tables.begin(), [&](const Run& run) { return relative_table(run, nominal); });
  return tables;
}

/// With little noise whole runs are compared: what they leave over is what noise is learned from. With a gyro
/// the level also says what its heading counts against that of the wheels: there the robot file's is taken.
NoiseEstimate noise_of_whole_runs(const Robot& nominal) {
  NoiseEstimate noise = kWholeRuns;
  if (nominal.chassis.gyro) noise.wheel_per_sqrt_m = typical_wheel_noise(nominal.chassis);
  return noise;
}

}  // namespace

Estimate estimate_parameters(std::span<const Run> given, const Robot& nominal,
                             std::span<const Parameter> parameters) {
  const bool moves_gyro_clock = contains(parameters, ParameterKind::gyro_time_offset);
  std::vector<Run> runs;  // whose clocks move
  if (moves_gyro_clock) runs.assign(given.begin(), given.end());
  const auto set_clocks = [&](const Robot& robot) {
    for (Run& run : runs) set_gyro_clock(robot, run);
  };
  Fit fit{.runs = moves_gyro_clock ? std::span<const Run>(runs) : given,
          .nominal = nominal,
          .parameters = parameters,
          .moves_gyro_clock = moves_gyro_clock,
          .noise = kShortStretches,
          .relative_covariance = std::vector<Matrix3>(given.size(), Matrix3::Identity() * 1e-4),
          .relative_table = relative_tables(given, nominal, parameters),
          .weight = std::vector<double>(given.size(), 1.0)};
  Estimate estimate;
  // With much wheel noise the filter holds on to the reference, so that even a bad start is approached.
  Robot rough = nominal;
  set_noise(rough, kShortStretches, fit);
  approach(rough, fit);
  set_noise(rough, noise_of_whole_runs(nominal), fit);
  approach(rough, fit);
  set_clocks(rough);
  learn_noise(rough, fit);
  estimate.space = estimable_space(total_information(rough, fit).matrix, parameters, nominal);
  // From nominal, so that what is held stays there; without the gate, for nominal may be far from what the
  // runs show.
  estimate.robot = nominal;
  iterate(estimate.robot, fit, estimate.space);
  if (nominal.chassis.gyro) {
    // What the rough robot leaves over in positions is more than noise: its heading is the gyro's, not yet
    // scaled. A better robot shows less noise, and less noise weighs the gyro rightly, which makes a better
    // robot.
    for (int round = 0; round < kMostNoiseRounds; ++round) {
      const NoiseEstimate before = fit.noise;
      set_clocks(estimate.robot);
      learn_noise(estimate.robot, fit);
      iterate(estimate.robot, fit, estimate.space);
      if (about_same(before, fit.noise)) break;
    }
  }
  fit.gate = kGate;
  for (int round = 0; round < kWeightRounds; ++round) {
    estimate.descent = iterate(estimate.robot, fit, estimate.space);
    weigh_runs(estimate.robot, fit, estimate.space);
  }
  if (estimate.space.basis.cols() > 0) measure_dispersion(estimate.robot, fit, estimate);
  const Eigen::MatrixXd information = total_information(estimate.robot, fit).matrix;
  estimate.covariance = estimate.dispersion * constrained_inverse(information, estimate.space);
  estimate.noise = fit.noise;
  return estimate;
}

}  // namespace trundle
