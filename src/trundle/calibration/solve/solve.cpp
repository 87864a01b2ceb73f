#include "trundle/calibration/solve/solve.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "trundle/geometry/decompositions.hpp"

namespace trundle::calibration {
namespace {

// A step moves no coordinate by more than its prior's 1σ: so many reach wherever a robot can be.
constexpr int kMostIterations = 60;
// The same of what the prior holds near.
constexpr int kMostIterationsWithPrior = 15;
// Steps in sigmas of the estimate, √(stepᵀ N step). The first: so that starts elsewhere give the same digits.
constexpr double kConverged = 1e-6;
// From here on the linearisation holds, and Gauss–Newton needs no look at χ².
constexpr double kNear = 1.0;
// Where gates and weights that follow the estimate let it go to and fro by less than shows in its error bars.
constexpr double kNearEnough = 0.1;
// To a thousandth of the step, 2⁻¹⁰.
constexpr int kMostHalvings = 10;
// Of χ², relative: what rounding may make of no change where runs are long.
constexpr double kRounding = 1e-7;

/// Whether it still has all of them: wheels that a step puts in one place have no track.
bool has_all(std::span<const Parameter> parameters, const Robot& robot) {
  const std::vector<Parameter> there = parameters_of(robot);
  return std::ranges::all_of(parameters, [&](const Parameter& parameter) {
    return std::ranges::find(there, parameter) != there.end() && std::isfinite(value_of(parameter, robot));
  });
}

/// Gauss–Newton in the columns of `basis` (parameters in units of prior sigmas). Far away a step that makes
/// χ² larger is halved. Near the solution χ² is not asked: it also falls where covariances of readings grow,
/// which the gradient rightly leaves out. docs/theory/calibration.md, eq. 6.
class GaussNewton {
 public:
  GaussNewton(const Likelihood& likelihood, const Eigen::VectorXd& scale, const Eigen::MatrixXd& basis,
              double prior_weight, Robot& robot)
      : likelihood_(likelihood),
        basis_(basis),
        columns_(scale.asDiagonal() * basis),
        prior_weight_(prior_weight),
        robot_(robot),
        moved_(Eigen::VectorXd::Zero(scale.size())),
        here_(objective_at(robot, moved_)) {}

  std::optional<NewtonStep> solve() {
    N_ = congruent(here_.information.matrix, columns_);
    N_.diagonal().array() += prior_weight_;
    step_ = solve_ldlt(N_, gradient_of(here_, moved_));
    if (const double size = step_.cwiseAbs().maxCoeff(); size > 1.0) step_ /= size;
    NewtonStep step{.sigmas = std::sqrt(step_.dot(N_ * step_))};
    (basis_ * step_).cwiseAbs().maxCoeff(&step.parameter);
    sigmas_ = step.sigmas;
    return step;
  }

  /// Where the weights' change makes χ² rise along the step, the next step is asked instead: it must be
  /// shorter, by the matrix of this one [Deuflhard 2011, ch. 3.3].
  bool advance() {
    return advance_if([&](const Objective& there, const Eigen::VectorXd&) {
             return sigmas_ < kNear || there.value <= here_.value * (1.0 + kRounding);
           }) ||
           advance_if([&](const Objective& there, const Eigen::VectorXd& moved) {
             const Eigen::VectorXd gradient = gradient_of(there, moved);
             return gradient.dot(solve_ldlt(N_, gradient)) < sigmas_ * sigmas_;
           });
  }

  bool damp() const { return false; }  // advance() has tried shorter steps

 private:
  /// What is minimised: χ² of the runs plus that of the prior.
  struct Objective {
    Information information;
    double value = 0.0;
  };

  /// Takes the longest of the step, its half, its quarter ... that is good.
  template <class IsGood>
  bool advance_if(const IsGood& is_good) {
    Eigen::VectorXd step = step_;
    for (int halving = 0; halving < kMostHalvings; ++halving, step *= 0.5) {
      Robot candidate = robot_;
      move(likelihood_.problem.parameters, columns_ * step, candidate);
      if (!has_all(likelihood_.problem.parameters, candidate)) continue;
      const Eigen::VectorXd moved = moved_ + basis_ * step;
      Objective there = objective_at(candidate, moved);
      if (!std::isfinite(there.value) || !is_good(there, moved)) continue;
      robot_ = std::move(candidate);
      moved_ = moved;
      here_ = std::move(there);
      return true;
    }
    return false;
  }

  Eigen::VectorXd gradient_of(const Objective& objective, const Eigen::VectorXd& moved) const {
    return columns_.transpose() * objective.information.gradient -
           prior_weight_ * (basis_.transpose() * moved);
  }

  Objective objective_at(const Robot& robot, const Eigen::VectorXd& moved) const {
    Objective objective{total_information(likelihood_, robot), 0.0};
    objective.value = objective.information.chi2 + prior_weight_ * moved.squaredNorm();
    return objective;
  }

  const Likelihood& likelihood_;
  const Eigen::MatrixXd& basis_;
  Eigen::MatrixXd columns_;  ///< the basis in the parameters' own units
  double prior_weight_;      ///< 1: with the prior, 0: without
  Robot& robot_;
  Eigen::VectorXd moved_;  ///< from where it began, in prior sigmas
  Objective here_;
  Eigen::MatrixXd N_;  ///< information of the step, prior included
  Eigen::VectorXd step_;
  double sigmas_ = 0.0;  ///< its length
};

}  // namespace

Descent solve(const Likelihood& likelihood, const EstimableSpace& space, Robot& robot) {
  if (space.basis.cols() == 0) return {.converged = true};
  GaussNewton search(likelihood, space.scale, space.basis, 0.0, robot);
  Descent descent = descend(search, {.most_iterations = kMostIterations, .converged = kConverged});
  descent.converged = descent.last_step < kNearEnough;
  return descent;
}

void approach(const Likelihood& likelihood, Robot& robot) {
  const Eigen::VectorXd scale = prior_sigmas(likelihood.problem.parameters, likelihood.problem.nominal);
  const Eigen::MatrixXd all = Eigen::MatrixXd::Identity(scale.size(), scale.size());
  GaussNewton search(likelihood, scale, all, 1.0, robot);
  descend(search, {.most_iterations = kMostIterationsWithPrior, .converged = kConverged});
}

}  // namespace trundle::calibration
