#include "trundle/calibration/solve/estimator.hpp"

#include <algorithm>
#include <cmath>

#include "trundle/calibration/likelihood/likelihood.hpp"
#include "trundle/calibration/problem/defaults.hpp"
#include "trundle/calibration/solve/own_axes.hpp"
#include "trundle/calibration/solve/solve.hpp"
#include "trundle/calibration/solve/weights.hpp"
#include "trundle/geometry/decompositions.hpp"

namespace trundle::calibration {
namespace {

// Squared Mahalanobis distance beyond which a residual is left out: P(χ²₃ > 30) = 1.4e-6.
constexpr double kGate = 30.0;
// Weights follow the estimate and it them: rounds of iteratively reweighted least squares.
constexpr int kWeightRounds = 5;
// Noise and parameters are found in turn until no level moves by more than this: it changes weights by a
// tenth, and an estimate by far less than its sigma, which does not depend on weights to first order.
constexpr double kSameNoise = 0.05;
// Levels that still go to and fro then are left where they are.
constexpr int kMostNoiseRounds = 8;

/// With much wheel noise, five times the usual, the filter holds on to the reference, so that even a bad
/// start is approached.
NoiseEstimate noise_of_short_stretches(const Robot& nominal) {
  NoiseLevels levels = noise_levels_of(nominal);
  levels.wheel_per_sqrt_m = 0.05;
  levels.reference = {.position_m = 0.05, .heading_rad = 0.2};
  return {levels, false};
}

/// Whether the level of noise says what one reading counts against another: a gyro's heading, or that of a
/// sideways wheel, against that of the wheels, or what steered wheels say of each other against what the
/// reference says of them.
bool is_weighed_by_noise(const Robot& robot) {
  const Chassis& chassis = robot.chassis;
  return chassis.gyro || !owes_headings_to_wheels(robot) ||
         (is_steered(chassis) && rows_of(chassis, false).count() > 3);
}

/// With little noise whole runs are compared: what they leave over is what noise is learned from. Where the
/// level also says what another heading counts the robot file's is taken.
NoiseEstimate noise_of_whole_runs(const Robot& nominal) {
  NoiseLevels levels = noise_levels_of(nominal);
  if (!nominal.chassis.gyro && owes_headings_to_wheels(nominal)) levels.wheel_per_sqrt_m = 1e-4;
  levels.reference = {.position_m = 0.005, .heading_rad = 0.02};
  return {levels, false};
}

/// Near enough to what the runs say for their noise to be seen, which is set in the likelihood.
Robot rough_robot(Likelihood& likelihood) {
  const Robot& nominal = likelihood.problem.nominal;
  Robot rough = nominal;
  likelihood.takes_out_noise = true;
  for (const NoiseEstimate& noise : {noise_of_short_stretches(nominal), noise_of_whole_runs(nominal)}) {
    set_noise(rough, noise, likelihood);
    approach(likelihood, rough);
  }
  set_own_parameters(rough, likelihood);
  find_noise(rough, likelihood);
  likelihood.knows_noise = true;
  if (std::ranges::any_of(likelihood.runs(),
                          [&](const Run& run) { return !likelihood.own_of(run).empty(); })) {
    set_own_parameters(rough, likelihood);
    find_noise(rough, likelihood);
  }
  return rough;
}

bool about_same(const NoiseLevels& a, const NoiseLevels& b) {
  const auto same = [](double x, double y) { return std::abs(x - y) <= kSameNoise * std::max(x, y); };
  return same(a.wheel_per_sqrt_m, b.wheel_per_sqrt_m) && same(a.gyro_rad_s_sqrt_hz, b.gyro_rad_s_sqrt_hz);
}

/// What the rough robot leaves over in positions is more than noise: its heading is the gyro's, not yet
/// scaled. A better robot shows less noise, and less noise weighs the gyro rightly, which makes a better
/// robot.
void settle_noise(const EstimableSpace& space, Likelihood& likelihood, Robot& robot) {
  for (int round = 0; round < kMostNoiseRounds; ++round) {
    const NoiseLevels before = likelihood.noise.levels;
    set_own_parameters(robot, likelihood);
    find_noise(robot, likelihood);
    likelihood.gyro_bias_spread_rad_s = gyro_bias_spread(likelihood, robot).prior_rad_s;
    solve(likelihood, space, robot);
    if (about_same(before, likelihood.noise.levels)) break;
  }
}

/// Leaves outlying residuals out, and lets outlying runs count less.
Descent settle_weights(const EstimableSpace& space, Likelihood& likelihood, Robot& robot) {
  Descent descent;
  likelihood.gate = kGate;
  for (int round = 0; round < kWeightRounds; ++round) {
    set_own_parameters(robot, likelihood);
    descent = solve(likelihood, space, robot);
    likelihood.run_weight = run_weights(likelihood, robot, space);
  }
  return descent;
}

/// The gyro's bias of each run: the shared one, and where its own fits best with the others, which are
/// uncertain themselves.
std::vector<std::optional<GyroBias>> gyro_biases_of(const Likelihood& likelihood, const Estimate& estimate) {
  std::vector<std::optional<GyroBias>> biases;
  if (likelihood.gyro_bias_spread_rad_s == 0.0) return biases;
  const auto& parameters = likelihood.problem.parameters;
  const auto shared = std::ranges::find(parameters, kGyroBias) - parameters.begin();
  const bool is_shared = contains(parameters, ParameterKind::gyro_bias);
  for (std::size_t i = 0; i < likelihood.runs().size(); ++i) {
    std::optional<GyroBias>& bias = biases.emplace_back();
    const Run& run = likelihood.runs()[i];
    if (!run.shows_gyro_bias()) continue;
    const std::vector<OwnParameter> own = likelihood.own_of(run);
    const auto n = likelihood.problem.size() + static_cast<Eigen::Index>(own.size());
    const OwnStep step = own_step(information_with_own(likelihood, i, estimate.robot).total(n), own);
    Eigen::VectorXd by_others = step.follows.row(0);
    if (is_shared) by_others[shared] += 1.0;
    bias = {value_of(kGyroBias, estimate.robot) + run.gyro_bias_moved_rad_s + step.step[0],
            estimate.dispersion * step.covariance(0, 0) + by_others.dot(estimate.covariance * by_others)};
  }
  return biases;
}

/// Whether anything shows which way the robot's own axes point: headings, an end in the frame of the start,
/// or where on the robot a reference sits.
bool shows_ahead(const CalibrationProblem& problem) {
  const bool starts_known = std::ranges::any_of(
      problem.runs, [](const Run& run) { return run.partial.end_x_m || run.partial.end_y_m; });
  if (starts_known) return true;
  const bool has_headings = std::ranges::any_of(problem.runs, [](const Run& run) {
    return !run.relative_motions.empty() || run.reference.has_headings();
  });
  const Pose2& place = problem.nominal.body_from_reference;
  const bool is_aside = place.x != 0.0 || place.y != 0.0;
  const bool places = contains(problem.parameters, ParameterKind::reference_x) &&
                      contains(problem.parameters, ParameterKind::reference_y);
  return (has_headings && !contains(problem.parameters, ParameterKind::reference_heading)) ||
         (is_aside && !places);
}

/// Of a robot near what the runs say. A filter that linearises at headings that it learns on the way takes
/// some from them of what is anybody's choice: that is taken out.
EstimableSpace space_at(const Likelihood& likelihood, const Robot& rough) {
  const CalibrationProblem& problem = likelihood.problem;
  Eigen::MatrixXd information = total_information(likelihood, rough).matrix;
  if (!shows_ahead(problem))
    if (const auto turned = axes_turned(problem.parameters, problem.nominal))
      information = with_held(*turned, prior_sigmas(problem.parameters, problem.nominal), information);
  return estimable_space(information, problem.parameters, problem.nominal);
}

}  // namespace

Estimate estimate_parameters(const CalibrationProblem& problem) {
  Likelihood likelihood = likelihood_of(problem);
  const Robot rough = rough_robot(likelihood);
  // From nominal, so that what is held stays there; without the gate, for nominal may be far from what the
  // runs show.
  Estimate estimate{.robot = problem.nominal,
                    .noise = {},
                    .space = {},
                    .covariance = {},
                    .held_covariance = {},
                    .runs = {},
                    .descent = {},
                    .measures_length = from_outside(problem.runs).length};
  estimate.space = space_at(likelihood, rough);
  likelihood.takes_out_noise = false;
  solve(likelihood, estimate.space, estimate.robot);
  if (is_weighed_by_noise(problem.nominal)) settle_noise(estimate.space, likelihood, estimate.robot);
  estimate.descent = settle_weights(estimate.space, likelihood, estimate.robot);
  estimate.noise = likelihood.noise;

  Dispersion dispersion = dispersion_of(likelihood, estimate.robot, estimate.space);
  estimate.dispersion = dispersion.factor;
  estimate.degrees_of_freedom = dispersion.degrees_of_freedom;
  estimate.runs = std::move(dispersion.runs);
  likelihood.takes_out_noise = true;
  const Eigen::MatrixXd information = total_information(likelihood, estimate.robot).matrix;
  likelihood.takes_out_noise = false;
  estimate.covariance = dispersion.factor * constrained_inverse(information, estimate.space);
  estimate.held_covariance =
      held_covariance(information, estimate.space, problem.parameters, problem.nominal);
  estimate.gyro_bias_spread = gyro_bias_spread(likelihood, estimate.robot);
  estimate.gyro_biases = gyro_biases_of(likelihood, estimate);
  return estimate;
}

Eigen::MatrixXd error_as_given(const CalibrationProblem& problem, const Estimate& estimate) {
  const Eigen::VectorXd change =
      values_of(estimate.robot, problem.parameters) - values_of(problem.nominal, problem.parameters);
  const Eigen::MatrixXd second_moment =
      estimate.covariance + estimate.held_covariance + change * change.transpose();
  const Eigen::VectorXd possible = prior_covariance(problem.parameters, problem.nominal).diagonal();
  const Eigen::VectorXd smaller = (possible.array() / second_moment.diagonal().array()).min(1.0).sqrt();
  return smaller.asDiagonal() * second_moment * smaller.asDiagonal();
}

Eigen::MatrixXd taken_along(std::span<const Parameter> given, const CalibrationProblem& problem,
                            const Estimate& estimate) {
  CalibrationProblem all = problem;
  all.parameters.insert(all.parameters.end(), given.begin(), given.end());
  Likelihood likelihood = likelihood_of(all);
  set_noise(estimate.robot, estimate.noise, likelihood);
  likelihood.gyro_bias_spread_rad_s = estimate.gyro_bias_spread.prior_rad_s;
  likelihood.knows_noise = true;
  likelihood.gate = kGate;
  std::ranges::transform(estimate.runs, likelihood.run_weight.begin(), &RunEvidence::weight);
  set_own_parameters(estimate.robot, likelihood);
  const Eigen::MatrixXd information = total_information(likelihood, estimate.robot).matrix;
  const Eigen::Index n = problem.size();
  return -constrained_inverse(information.topLeftCorner(n, n), estimate.space) *
         information.topRightCorner(n, all.size() - n);
}

GivenParameters given_beside(std::span<const Parameter> given, const Eigen::MatrixXd& covariance,
                             const Eigen::MatrixXd& D, Estimate& estimate) {
  GivenParameters result{{given.begin(), given.end()}, covariance, D * covariance};
  estimate.held_covariance += result.cross_covariance * D.transpose();
  return result;
}

}  // namespace trundle::calibration
