// FactorGraph: where factors are linearised, and solving them.
#include <algorithm>
#include <cmath>

#include "trundle/io/error.hpp"
#include "trundle/slam/nth.hpp"
#include "trundle/slam/smoothing/solver/factor_graph.hpp"
#include "trundle/slam/smoothing/solver/normal_equations.hpp"

namespace trundle::slam {
namespace {

using Eigen::VectorXd;

// What linearising a reading may leave out, as a share of its sigma: twenty that err alike by it are off by a
// fifth of the sigma of their mean.
constexpr double kLinear = 0.05;

}  // namespace

/// The turn changes a range at the edge of the view by kLinear of its sigma; the way is that turn's at the
/// range where range and bearing are equally good.
FactorGraph::LinearMoves FactorGraph::linear_moves(const LandmarkSensor& sensor) {
  const double turn_rad = std::sqrt(2.0 * kLinear * sensor.range_sigma_m / sensor.max_range_m);
  return {turn_rad, turn_rad * sensor.range_sigma_m / sensor.bearing_sigma_rad};
}

/// Blocks are the tree's variables.
struct FactorGraph::Equations {
  const FactorGraph& of;
  FrontSystem& system;

  template <class Block>
  void add(int i, int j, const Block& block) {
    system.add(i, j, block);
  }
  template <class Vector>
  void add(int i, const Vector& right) {
    system.add(i, right);
  }
  int pose_block(int pose) const { return of.pose_variables_[nth(pose)]; }
  int landmark_block(int landmark) const { return of.landmarks_[nth(landmark)].variable; }
  int parameter_block() const { return of.parameter_variable_; }
};

/// Gauss–Newton. What is in view and the last pose are eliminated last: they are asked for and change most.
void FactorGraph::settle(const std::function<void(int)>& on_solved) {
  std::vector<int> last = in_view_;
  if (parameter_variable_ >= 0) last.push_back(parameter_variable_);
  last.push_back(pose_variables_.back());
  for (int round = 1;; ++round) {
    if (!tree_.update(last, [this](int factor, FrontSystem& system) { linearise(factor, at_, system); }))
      throw CannotAnswer("the sightings leave poses or landmarks undetermined");
    const std::vector<int>& solved = tree_.solve();
    for (const int variable : solved)
      if (variables_[nth(variable)].kind == Variable::Kind::landmark)
        on_solved(variables_[nth(variable)].index);
    if (round >= options_.most_rounds || !relinearise(solved)) return;
  }
}

/// Where a new pose is linearised: where it stands among the landmarks in view as those are linearised, and
/// turned as the pose before it is, so that what all of them have moved alike does not come between it and
/// them.
Pose2 FactorGraph::linearisation_of(const Pose2& now) const {
  if (in_view_.empty()) return now;
  Vector2 linearised = Vector2::Zero();
  Vector2 moved = Vector2::Zero();
  for (const int variable : in_view_) {
    linearised += at_.landmarks[nth(variables_[nth(variable)].index)] / static_cast<double>(in_view_.size());
    moved += tree_.solution(variable) / static_cast<double>(in_view_.size());
  }
  const double turned = tree_.solution(pose_variables_.back())[2];
  const Pose2 map_from_linearised = Pose2{linearised.x() + moved.x(), linearised.y() + moved.y(), turned} *
                                    Pose2{linearised.x(), linearised.y(), 0.0}.inverse();
  return map_from_linearised.inverse() * now;
}

/// Where what was solved for has moved by more than what is linear. False: nowhere. Eq. 23.
bool FactorGraph::relinearise(std::span<const int> solved) {
  bool moved = false;
  for (const int variable : solved) {
    const Variable& unknown = variables_[nth(variable)];
    if (unknown.kind == Variable::Kind::parameters) continue;
    if (unknown.kind == Variable::Kind::pose) {
      const int seen = first_seen_[nth(unknown.index)];
      if (std::abs(tree_.solution(variable)[2]) <= linear_.turn_rad &&
          (seen < 0 || moved_apart(seen, unknown.index).left_out <= 2.0 * kLinear))
        continue;
      if (!has_moved_alone(unknown.index)) return relinearise_all();
      move_linearisation(variable, tree_.solution(variable));
      moved = true;
      continue;
    }
    if (landmarks_[nth(unknown.index)].seen_from < 0) continue;  // known by what is marginalised: linear
    const Apart apart = moved_apart(unknown.index, landmarks_[nth(unknown.index)].seen_from);
    if (apart.left_out <= kLinear) continue;
    move_linearisation(variable, apart.moved);
    moved = true;
  }
  return moved;
}

/// And not with what it sees: that is linear about where it was.
bool FactorGraph::has_moved_alone(int pose) const {
  const int seen = first_seen_[nth(pose)];
  return seen >= 0 &&
         left_out(tree_.solution(landmarks_[nth(seen)].variable), sight_of(seen, pose)) <= kLinear;
}

bool FactorGraph::relinearise_all() {
  tree_.solve(EliminationTree::Solve::all);
  for (int variable = 0; variable < tree_.variables(); ++variable)
    move_linearisation(variable, tree_.solution(variable));
  return true;
}

/// From the pose to the landmark, as both are linearised.
Vector2 FactorGraph::sight_of(int landmark, int pose) const {
  return at_.landmarks[nth(landmark)] - at_.poses[nth(pose)].translation();
}

/// Readings see where landmarks are in the frame of a pose: what both move alike does not matter.
FactorGraph::Apart FactorGraph::moved_apart(int landmark, int pose) const {
  const auto of_pose = tree_.solution(pose_variables_[nth(pose)]);
  const Pose2& from = at_.poses[nth(pose)];
  const Vector2 u = sight_of(landmark, pose);
  const Vector2 turned = of_pose[2] * Vector2(-u.y(), u.x());
  const Vector2 moved = from * Vector2(of_pose.head<2>()) - from.translation();
  const Vector2 apart = tree_.solution(landmarks_[nth(landmark)].variable) - turned - moved;
  return {apart, left_out(apart, u)};
}

double FactorGraph::left_out(const Vector2& apart, const Vector2& sight) const {
  const double range = std::max(sight.norm(), problem_.sensors.front().range_sigma_m);
  const double along = apart.dot(sight) / range;
  const double across = (apart.y() * sight.x() - apart.x() * sight.y()) / range;
  return std::max(across * across / (2.0 * range * problem_.sensors.front().range_sigma_m),
                  std::abs(along * across) / (range * range * problem_.sensors.front().bearing_sigma_rad));
}

void FactorGraph::linearise(int factor, const SmoothingState& at, FrontSystem& system) const {
  const Factor& part = factors_[nth(factor)];
  Equations equations{*this, system};
  switch (part.kind) {
    case Factor::Kind::motion:
      return add_to(equations, problem_.motions[part.index], problem_, at);
    case Factor::Kind::sighting:
      return add_to(equations, problem_.sightings[part.index], problem_, at);
    case Factor::Kind::bias:
      return add_to(equations, problem_.bias_readings[part.index], problem_, at);
    case Factor::Kind::parameters:
      return add_parameters_to(equations, problem_, at);
    case Factor::Kind::prior:
      return priors_[part.index]
          .prior.at([&](int variable) { return value_of(variable, at); })
          .add_to(system);
  }
}

void FactorGraph::move_linearisation(int variable, const VectorXd& by) {
  const Variable& unknown = variables_[nth(variable)];
  switch (unknown.kind) {
    case Variable::Kind::pose:
      at_.poses[nth(unknown.index)] = moved_by(by.head<3>(), at_.poses[nth(unknown.index)]);
      if (problem_.has_bias) at_.biases[nth(unknown.index)] += by[3];
      break;
    case Variable::Kind::landmark:
      at_.landmarks[nth(unknown.index)] += by;
      break;
    case Variable::Kind::parameters:
      at_.parameters += by;
      break;
    case Variable::Kind::removed:
      return;
  }
  tree_.move(variable, by);
}

}  // namespace trundle::slam
