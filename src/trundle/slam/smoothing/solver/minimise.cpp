#include "trundle/slam/smoothing/solver/minimise.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "trundle/io/interruption.hpp"
#include "trundle/slam/nth.hpp"
#include "trundle/slam/smoothing/solver/normal_equations.hpp"
#include "trundle/statistics/descent.hpp"

namespace trundle::slam {
namespace {

// Added to the information of every coordinate [1/m², 1/rad², 1]. Not a share of the diagonal: that of two
// poses between which the robot stood still is so large that they could not be moved together either.
constexpr double kFirstDamping = 1e-3;  // 1 σ of 30 m: no start is further off
constexpr double kLeastDamping = 1e-9;  // 1 σ of 30 km: none
constexpr double kMostDamping = 1e12;   // 1 σ of 1 µm: there no step is left, and the search gives up

/// Poses, landmarks, all parameters as one block that is eliminated last.
BlockPattern pattern_of(const SmoothingProblem& problem) {
  const int parameters = static_cast<int>(problem.parameter_information.size());
  BlockPattern pattern;
  pattern.sizes.assign(nth(problem.poses), problem.has_bias ? 4 : 3);
  pattern.sizes.insert(pattern.sizes.end(), nth(problem.landmarks), 2);
  if (parameters > 0) {
    pattern.last = 1;
    for (int i = 0; i < problem.poses; ++i)
      pattern.couplings.emplace_back(i, problem.poses + problem.landmarks);
    for (int i = 0; i < problem.landmarks && !problem.sensor_errors.empty(); ++i)
      pattern.couplings.emplace_back(problem.poses + i, problem.poses + problem.landmarks);
    pattern.sizes.push_back(parameters);
  }
  for (const MotionLink& link : problem.motions)
    if (link.from != MotionLink::kKnown) pattern.couplings.emplace_back(link.from, link.to);
  for (const SightingLink& link : problem.sightings)
    pattern.couplings.emplace_back(link.pose, problem.poses + link.landmark);
  for (const RobotLink& link : problem.robots_seen) pattern.couplings.emplace_back(link.pose, link.seen);
  return pattern;
}

}  // namespace

Minimiser::Minimiser(const SmoothingProblem& problem)
    : poses_(problem.poses),
      of_pose_(problem.has_bias ? 4 : 3),
      landmarks_(problem.landmarks),
      parameters_(problem.poses + problem.landmarks),
      free_(problem.parameter_information.size()),
      normal_(pattern_of(problem)) {}

/// Poses, landmarks, parameters.
struct Minimiser::Equations {
  Minimiser& of;

  void add(int i, int j, const Eigen::Ref<const Eigen::MatrixXd>& block) { of.normal_.add(i, j, block); }
  void add(int i, const Eigen::Ref<const Eigen::VectorXd>& right) {
    of.gradient_.segment(of.normal_.offset(i), right.size()) -= right;
  }
  int pose_block(int pose) const { return pose; }
  int landmark_block(int landmark) const { return of.poses_ + landmark; }
  int parameter_block() const { return of.parameters_; }
};

void Minimiser::build(const SmoothingProblem& problem, const SmoothingState& state) {
  check_interruption();
  normal_.clear();
  gradient_ = Eigen::VectorXd::Zero(normal_.size());
  Equations equations{*this};
  for (const MotionLink& link : problem.motions) add_to(equations, link, problem, state);
  for (const SightingLink& link : problem.sightings) add_to(equations, link, problem, state);
  for (const RobotLink& link : problem.robots_seen) add_to(equations, link, problem, state);
  for (const PositionLink& link : problem.positions) add_to(equations, link, problem, state);
  for (const BiasLink& link : problem.bias_readings) add_to(equations, link, problem, state);
  add_parameters_to(equations, problem, state);
}

SmoothingState Minimiser::moved(const SmoothingState& state, const Eigen::VectorXd& step) const {
  SmoothingState result = state;
  for (int i = 0; i < poses_; ++i) {
    Pose2& pose = result.poses[nth(i)];
    pose = moved_by(step.segment<3>(normal_.offset(i)), pose);
    if (of_pose_ == 4) result.biases[nth(i)] += step[normal_.offset(i) + 3];
  }
  for (int i = 0; i < landmarks_; ++i)
    result.landmarks[nth(i)] += step.segment<2>(normal_.offset(poses_ + i));
  result.parameters += step.tail(free_);
  return result;
}

// Eq. 8. The damping follows how well the quadratic model predicted the gain [Nielsen 1999].
class Minimiser::LevenbergMarquardt {
 public:
  LevenbergMarquardt(Minimiser& linearised, const SmoothingProblem& problem, Minimum& minimum)
      : linearised_(linearised), problem_(problem), minimum_(minimum) {
    minimum_.cost = cost_of(problem_, minimum_.state);
    linearised_.build(problem_, minimum_.state);
  }

  std::optional<NewtonStep> solve() {
    if (!linearised_.normal_.factor(damping_)) return std::nullopt;
    const Eigen::VectorXd& gradient = linearised_.gradient_;
    step_ = linearised_.normal_.solve(-gradient);
    predicted_gain_ = damping_ * step_.squaredNorm() - step_.dot(gradient);
    return NewtonStep{.sigmas = std::sqrt(std::max(predicted_gain_, 0.0))};
  }

  bool advance() {
    SmoothingState there = linearised_.moved(minimum_.state, step_);
    const double cost = cost_of(problem_, there);
    const double gain = (minimum_.cost - cost) / predicted_gain_;
    if (!(gain > 0.0)) return false;
    minimum_.state = std::move(there);
    minimum_.cost = cost;
    linearised_.build(problem_, minimum_.state);
    damping_ = std::max(damping_ * std::max(1.0 / 10.0, 1.0 - std::pow(2.0 * gain - 1.0, 3)), kLeastDamping);
    growth_ = 2.0;
    return true;
  }

  bool damp() {
    damping_ *= growth_;
    growth_ *= 2.0;
    return damping_ < kMostDamping;
  }

 private:
  Minimiser& linearised_;
  const SmoothingProblem& problem_;
  Minimum& minimum_;
  double damping_ = kFirstDamping;
  double growth_ = 2.0;
  Eigen::VectorXd step_;
  double predicted_gain_ = 0.0;  ///< of the cost; its root is the step in sigmas
};

Minimum Minimiser::minimise(const SmoothingProblem& problem, SmoothingState start,
                            const MinimiseOptions& options) {
  Minimum minimum{std::move(start), 0.0};
  if (problem.has_bias) minimum.state.biases.resize(nth(poses_), 0.0);
  LevenbergMarquardt search(*this, problem, minimum);
  const Descent descent =
      descend(search, {.most_iterations = options.most_iterations, .converged = std::sqrt(options.enough)});
  minimum.iterations = descent.iterations;
  minimum.converged = descent.converged;
  return minimum;
}

bool Minimiser::linearise(const SmoothingProblem& problem, const SmoothingState& state) {
  build(problem, state);
  if (!normal_.factor(0.0)) return false;
  normal_.invert();
  return true;
}

Eigen::MatrixXd Minimiser::map_covariance(int first, int count) const {
  std::vector<Eigen::Index> rows;
  for (int i = first; i < first + count; ++i) {
    const Eigen::Index at = normal_.offset(poses_ + i);
    rows.insert(rows.end(), {at, at + 1});
  }
  Eigen::MatrixXd covariance(rows.size(), rows.size());
  for (std::size_t k = 0; k < rows.size(); ++k)
    covariance.col(static_cast<Eigen::Index>(k)) =
        normal_.solve(Eigen::VectorXd::Unit(normal_.size(), rows[k]))(rows);
  return 0.5 * (covariance + covariance.transpose());
}

Matrix2 Minimiser::difference_covariance(int landmark, int other) const {
  const Eigen::Index at = normal_.offset(poses_ + landmark);
  const Eigen::Index minus = normal_.offset(poses_ + other);
  Matrix2 covariance;
  for (Eigen::Index axis = 0; axis < 2; ++axis) {
    Eigen::VectorXd b = Eigen::VectorXd::Zero(normal_.size());
    b[at + axis] = 1.0;
    b[minus + axis] = -1.0;
    const Eigen::VectorXd x = normal_.solve(std::move(b));
    covariance.col(axis) = x.segment<2>(at) - x.segment<2>(minus);
  }
  return 0.5 * (covariance + covariance.transpose());
}

Eigen::MatrixXd Minimiser::parameter_covariance() const {
  return free_ > 0 ? normal_.inverse(parameters_, parameters_) : Eigen::MatrixXd(0, 0);
}

}  // namespace trundle::slam
