#include "trundle/slam/smoothing/solver/factor_graph.hpp"

#include <algorithm>
#include <cmath>

#include "trundle/slam/nth.hpp"
#include "trundle/slam/smoothing/solver/minimise.hpp"
#include "trundle/slam/smoothing/solver/normal_equations.hpp"

namespace trundle::slam {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// The share of what is linear below which what depends on a move is not solved anew.
constexpr double kMatters = 0.1;

SmoothingProblem problem_of(const LandmarkSensor& sensor, const FactorGraphOptions& options) {
  SmoothingProblem problem;
  problem.sensors = {sensor};
  problem.parameter_information = options.parameter_sigma.cwiseAbs2().cwiseInverse();
  problem.has_bias = options.bias_sigma.has_value();
  problem.gate = options.gate;
  return problem;
}

}  // namespace

FactorGraph::FactorGraph(const LandmarkSensor& sensor, const FactorGraphOptions& options)
    : options_(options), linear_(linear_moves(sensor)), problem_(problem_of(sensor, options)) {
  at_.parameters = VectorXd::Zero(options.parameter_sigma.size());
  if (options.parameter_sigma.size() == 0) return;
  parameter_variable_ =
      add_variable({Variable::Kind::parameters, 0}, kMatters * kMatters * options.parameter_sigma);
  add_factor({Factor::Kind::parameters, 0}, {{parameter_variable_}});
}

int FactorGraph::add_variable(const Variable& variable, const VectorXd& tolerance) {
  const int number = tree_.add_variable({tolerance.data(), static_cast<std::size_t>(tolerance.size())});
  if (nth(number) == variables_.size()) variables_.emplace_back();
  variables_[nth(number)] = variable;
  return number;
}

/// The number of its term.
int FactorGraph::add_factor(const Factor& factor, std::span<const int> variables) {
  const int term = tree_.add_term(variables);
  if (nth(term) == factors_.size()) factors_.emplace_back();
  factors_[nth(term)] = factor;
  return term;
}

void FactorGraph::add_pose(const Pose2& now, MotionLink link) {
  const double bias = last_bias(), bias_sigma = options_.bias_sigma.value_or(0.0);
  const int pose = problem_.poses++;
  at_.poses.push_back(linearisation_of(now));
  if (problem_.has_bias) at_.biases.push_back(bias);
  const Eigen::Vector4d tolerance =
      kMatters * Eigen::Vector4d(linear_.way_m, linear_.way_m, linear_.turn_rad, kMatters * bias_sigma);
  pose_variables_.push_back(add_variable({Variable::Kind::pose, pose}, tolerance.head(pose_size(problem_))));
  first_seen_.push_back(-1);

  const Factor factor{Factor::Kind::motion, problem_.motions.size()};
  problem_.motions.push_back(std::move(link));
  std::vector<int> variables{pose_variables_.back()};
  if (pose > 0) variables.push_back(pose_variables_[nth(pose - 1)]);
  if (parameter_variable_ >= 0) variables.push_back(parameter_variable_);
  add_factor(factor, variables);
}

void FactorGraph::add_bias_reading(double rad_s, double variance) {
  add_factor({Factor::Kind::bias, problem_.bias_readings.size()}, {{pose_variables_.back()}});
  problem_.bias_readings.push_back({problem_.poses - 1, rad_s, variance});
}

int FactorGraph::add_landmark(const Observation& observation) {
  const int landmark = problem_.landmarks++;
  landmarks_.push_back({.variable = add_variable({Variable::Kind::landmark, landmark},
                                                 Vector2::Constant(kMatters * linear_.way_m))});
  at_.landmarks.push_back(
      sighted_landmark(at_.poses.back(), sensor().body_from_sensor, observation).in_world);
  return landmark;
}

void FactorGraph::add_sighting(int landmark, const Observation& observation) {
  const std::size_t sighting = problem_.sightings.size();
  const int pose = problem_.poses - 1;
  Landmark& seen = landmarks_[nth(landmark)];
  factor_of_.push_back(
      add_factor({Factor::Kind::sighting, sighting}, {{pose_variables_.back(), seen.variable}}));
  problem_.sightings.push_back({pose, landmark, observation});
  seen.seen_from = pose;
  seen.sightings.push_back(sighting);
  if (first_seen_.back() < 0) first_seen_.back() = landmark;
  if (std::ranges::find(in_view_, seen.variable) == in_view_.end()) in_view_.push_back(seen.variable);
}

/// The last sighting takes its number.
void FactorGraph::remove_sighting(std::size_t sighting) {
  const SightingLink gone = problem_.sightings[sighting];
  tree_.remove_term(factor_of_[sighting]);
  std::erase(landmarks_[nth(gone.landmark)].sightings, sighting);
  if (first_seen_[nth(gone.pose)] == gone.landmark) first_seen_[nth(gone.pose)] = -1;
  const std::size_t last = problem_.sightings.size() - 1;
  if (sighting != last) {
    problem_.sightings[sighting] = problem_.sightings[last];
    factor_of_[sighting] = factor_of_[last];
    factors_[nth(factor_of_[sighting])].index = sighting;
    std::ranges::replace(landmarks_[nth(problem_.sightings[sighting].landmark)].sightings, last, sighting);
  }
  problem_.sightings.pop_back();
  factor_of_.pop_back();
}

/// What its sightings said of others before they were marginalised stays.
void FactorGraph::remove_landmark(int landmark) {
  while (!landmarks_[nth(landmark)].sightings.empty())
    remove_sighting(landmarks_[nth(landmark)].sightings.back());
  const int variable = landmarks_[nth(landmark)].variable;
  for (std::size_t k = 0; k < priors_.size(); ++k)
    if (priors_[k].prior.has(variable)) set_prior(k, priors_[k].prior.marginalised({variable}));
  tree_.remove_variable(variable);
  variables_[nth(variable)] = {Variable::Kind::removed, 0};
  std::erase(in_view_, variable);
  const int last = --problem_.landmarks;
  if (landmark != last) {
    landmarks_[nth(landmark)] = std::move(landmarks_.back());
    at_.landmarks[nth(landmark)] = at_.landmarks.back();
    variables_[nth(landmarks_[nth(landmark)].variable)].index = landmark;
    for (const std::size_t sighting : landmarks_[nth(landmark)].sightings) {
      SightingLink& link = problem_.sightings[sighting];
      link.landmark = landmark;
      if (first_seen_[nth(link.pose)] == last) first_seen_[nth(link.pose)] = landmark;
    }
  }
  landmarks_.pop_back();
  at_.landmarks.pop_back();
}

void FactorGraph::merge_landmarks(int kept, int gone) {
  Landmark& stays = landmarks_[nth(kept)];
  Landmark& goes = landmarks_[nth(gone)];
  for (const std::size_t sighting : goes.sightings) {
    SightingLink& link = problem_.sightings[sighting];
    tree_.remove_term(factor_of_[sighting]);
    factor_of_[sighting] =
        add_factor({Factor::Kind::sighting, sighting}, {{pose_variables_[nth(link.pose)], stays.variable}});
    link.landmark = kept;
    if (first_seen_[nth(link.pose)] == gone) first_seen_[nth(link.pose)] = kept;
  }
  stays.sightings.insert(stays.sightings.end(), goes.sightings.begin(), goes.sightings.end());
  stays.seen_from = std::max(stays.seen_from, goes.seen_from);
  goes.sightings.clear();
  for (std::size_t k = 0; k < priors_.size(); ++k) {
    if (!priors_[k].prior.has(goes.variable)) continue;
    MarginalPrior prior = priors_[k].prior;
    prior.merge(stays.variable, goes.variable);
    set_prior(k, std::move(prior));
  }
  if (std::ranges::find(in_view_, stays.variable) == in_view_.end())
    std::ranges::replace(in_view_, goes.variable, stays.variable);
}

SmoothingState FactorGraph::state() const {
  SmoothingState state = at_;
  for (int i = 0; i < problem_.poses; ++i) {
    state.poses[nth(i)] = pose_at(i);
    if (problem_.has_bias) state.biases[nth(i)] = bias_at(i);
  }
  for (int i = 0; i < problem_.landmarks; ++i) state.landmarks[nth(i)] = landmark_at(i);
  state.parameters = parameters();
  return state;
}

Pose2 FactorGraph::pose_at(int pose) const {
  return moved_by(tree_.solution(pose_variables_[nth(pose)]).head<3>(), at_.poses[nth(pose)]);
}

double FactorGraph::bias_at(int pose) const {
  return at_.bias_at(pose) + tree_.solution(pose_variables_[nth(pose)])[3];
}

double FactorGraph::last_bias() const {
  return !problem_.has_bias || problem_.poses == 0 ? 0.0 : bias_at(problem_.poses - 1);
}

VectorXd FactorGraph::parameters() const {
  if (parameter_variable_ < 0) return at_.parameters;
  return at_.parameters + tree_.solution(parameter_variable_);
}

Vector2 FactorGraph::landmark_at(int landmark) const {
  return at_.landmarks[nth(landmark)] + tree_.solution(landmarks_[nth(landmark)].variable);
}

int FactorGraph::landmark_variable(int landmark) const {
  return landmarks_[nth(landmark)].variable;
}

int FactorGraph::landmark_of_variable(int variable) const {
  return variables_[nth(variable)].index;
}

Matrix2 FactorGraph::landmark_covariance(int landmark) const {
  const EliminationTree::Derivative itself{landmark_variable(landmark), 0, Matrix2::Identity()};
  return tree_.projected_covariance({&itself, 1}, 2);
}

MatrixXd FactorGraph::map_covariance(std::span<const std::size_t> landmarks) const {
  if (!priors_.empty()) {
    std::vector<EliminationTree::Derivative> derivatives;
    for (const std::size_t landmark : landmarks)
      derivatives.push_back(
          {landmarks_[landmark].variable, 2 * static_cast<Index>(derivatives.size()), Matrix2::Identity()});
    return tree_.projected_covariance(derivatives, 2 * static_cast<Index>(landmarks.size()));
  }
  Minimiser all(problem_);
  if (problem_.landmarks == 0 || !all.linearise(problem_, state())) return {};
  std::vector<Index> rows;
  for (const std::size_t landmark : landmarks) {
    const auto row = 2 * static_cast<Index>(landmark);
    rows.insert(rows.end(), {row, row + 1});
  }
  return all.map_covariance(0, problem_.landmarks)(rows, rows);
}

std::vector<int> FactorGraph::poses_that_see(int landmark) const {
  std::vector<int> poses;
  for (const std::size_t sighting : landmarks_[nth(landmark)].sightings)
    poses.push_back(problem_.sightings[sighting].pose);
  std::ranges::sort(poses);
  return poses;
}

}  // namespace trundle::slam
