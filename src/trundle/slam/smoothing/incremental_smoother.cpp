#include "trundle/slam/smoothing/incremental_smoother.hpp"

#include <algorithm>
#include <cmath>

#include "trundle/io/error.hpp"
#include "trundle/slam/smoothing/normal_equations.hpp"
#include "trundle/slam/smoothing/nth.hpp"
#include "trundle/slam/systematic_errors.hpp"

namespace trundle::slam {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// What linearising a reading may leave out, as a share of its sigma.
constexpr double kLinear = 0.05;

}  // namespace

/// The turn changes a range at the edge of the view by kLinear of its sigma; the way is that turn's at the
/// range where range and bearing are equally good.
IncrementalSmoother::LinearMoves IncrementalSmoother::linear_moves(const LandmarkSensor& sensor) {
  const double turn_rad = std::sqrt(2.0 * kLinear * sensor.range_sigma_m / sensor.max_range_m);
  return {turn_rad, turn_rad * sensor.range_sigma_m / sensor.bearing_sigma_rad};
}

/// Blocks are the tree's variables.
struct IncrementalSmoother::Equations {
  const IncrementalSmoother& of;
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
  int landmark_block(int landmark) const { return of.map_.landmarks[nth(landmark)].variable; }
  int parameter_block() const { return of.parameter_variable_; }
};

IncrementalSmoother::IncrementalSmoother(const LandmarkSensor& sensor,
                                         const IncrementalSmootherOptions& options)
    : options_(options),
      linear_(linear_moves(sensor)),
      free_(free_of(options.prior.systematic_sigma, options.has_bias)),
      map_{.landmarks = {},
           .number_of = {},
           .next_unidentified = options.first_unidentified,
           .merged_into = {},
           .grid = LandmarkGrid(kCellShare * sensor.max_range_m),
           .visibility = Visibility(sensor.max_range_m, options.unknown.existence)},
      unidentified_(sensor, options.unknown, options.gate) {
  const VectorXd sigma = options.prior.systematic_sigma(free_);
  problem_.sensors = {sensor};
  problem_.parameter_information = sigma.cwiseAbs2().cwiseInverse();
  problem_.has_bias = options.has_bias;
  problem_.gate = options.gate;
  at_.parameters = since_.parameters = VectorXd::Zero(sigma.size());
  since_.motion = {{},
                   body_covariance(options.prior.start, options.prior.start_covariance),
                   Eigen::Matrix3Xd::Zero(3, sigma.size())};
  if (free_.empty()) return;
  parameter_variable_ = add_unknown({Unknown::Kind::parameters, 0}, kMatters * kMatters * sigma);
  add_part({Part::Kind::parameters, 0}, {{parameter_variable_}});
}

const StepReport& IncrementalSmoother::step(const Motion& motion, std::span<const Observation> observations,
                                            double time_s) {
  time_s_ = time_s;
  report_.observations.assign(observations.size(), {});
  since_ = moved_on(motion);
  associate(observations);
  std::vector<std::size_t> shown;
  for (std::size_t i = 0; i < observations.size(); ++i)
    if (is_valid(observations[i]) && report_.observations[i].decision != Decision::rejected)
      shown.push_back(i);
  if (shown.empty()) return report_;
  judge(shown, observations);
  add_keyframe();
  in_view_.clear();
  for (const std::size_t i : shown) add_sighting(i, observations[i]);
  settle();
  revise_map();
  return report_;
}

void IncrementalSmoother::read_bias(const BiasReading& reading) {
  if (!problem_.has_bias) return;
  if (is_between_keyframes()) add_keyframe();
  const int pose = problem_.poses - 1;
  add_part({Part::Kind::bias, problem_.bias_readings.size()}, {{pose_variables_.back()}});
  problem_.bias_readings.push_back({pose, reading.rad_s, reading.variance});
  settle();
}

/// The mean is that of what is known of the systematic errors at the keyframe.
IncrementalSmoother::SinceKeyframe IncrementalSmoother::moved_on(const Motion& motion) const {
  const BySystematic by_all = motion.by_first(options_.prior.systematic_sigma.size());
  FreeMotion step{motion.mean, motion.covariance, by_all(Eigen::all, free_)};
  if (problem_.has_bias) {
    step.by_bias = by_all.col(0);
    step.walk = motion.walk;
    step.with_walk = motion.with_walk;
  }
  const Vector3 effect = step.by_parameters * since_.parameters + step.by_bias * since_.bias;
  step.mean = step.mean * exp(Twist2::from(effect));
  return {since_.motion * step, since_.bias, since_.parameters, true};
}

void IncrementalSmoother::add_keyframe() {
  const int pose = problem_.poses++;
  const double bias = keyframe_bias();
  at_.poses.push_back(linearisation_of(pose_now()));
  if (problem_.has_bias) at_.biases.push_back(bias);
  const double bias_sigma = problem_.has_bias ? options_.prior.systematic_sigma[0] : 0.0;
  const Eigen::Vector4d tolerance =
      kMatters * Eigen::Vector4d(linear_.way_m, linear_.way_m, linear_.turn_rad, kMatters * bias_sigma);
  pose_variables_.push_back(add_unknown({Unknown::Kind::pose, pose}, tolerance.head(pose_size(problem_))));
  sees_.push_back(-1);
  stamps_.push_back(time_s_);

  MotionLink link;
  if (pose == 0) {
    const double variance = bias_sigma * bias_sigma;
    link = link_from({.pose = options_.prior.start, .bias_variance = variance}, pose, since_.motion);
  } else {
    link = link_of(pose - 1, pose, since_.motion);
  }
  link.included = since_.motion.by_parameters * since_.parameters + since_.motion.by_bias * since_.bias;
  const Part part{Part::Kind::motion, problem_.motions.size()};
  problem_.motions.push_back(std::move(link));
  std::vector<int> variables{pose_variables_.back()};
  if (pose > 0) variables.push_back(pose_variables_[nth(pose - 1)]);
  if (parameter_variable_ >= 0) variables.push_back(parameter_variable_);
  add_part(part, variables);

  since_.motion = {{}, Matrix3::Zero(), Eigen::Matrix3Xd::Zero(3, static_cast<Index>(free_.size()))};
  since_.parameters = parameters();
  since_.bias = bias;
  since_.has_moved = false;
}

/// Where a new pose is linearised: where it stands among the landmarks in view as those are linearised, and
/// turned as the pose before it is, so that what all of them have moved alike does not come between it and
/// them.
Pose2 IncrementalSmoother::linearisation_of(const Pose2& now) const {
  if (in_view_.empty()) return now;
  Vector2 linearised = Vector2::Zero();
  Vector2 moved = Vector2::Zero();
  for (const int variable : in_view_) {
    linearised += at_.landmarks[nth(unknown_of_[nth(variable)].index)] / static_cast<double>(in_view_.size());
    moved += tree_.solution(variable) / static_cast<double>(in_view_.size());
  }
  const double turned = tree_.solution(pose_variables_.back())[2];
  const Pose2 map_from_linearised = Pose2{linearised.x() + moved.x(), linearised.y() + moved.y(), turned} *
                                    Pose2{linearised.x(), linearised.y(), 0.0}.inverse();
  return map_from_linearised.inverse() * now;
}

int IncrementalSmoother::add_unknown(const Unknown& unknown, const VectorXd& tolerance) {
  const int variable = tree_.add_variable({tolerance.data(), static_cast<std::size_t>(tolerance.size())});
  if (nth(variable) == unknown_of_.size()) unknown_of_.emplace_back();
  unknown_of_[nth(variable)] = unknown;
  return variable;
}

/// The number of its term.
int IncrementalSmoother::add_part(const Part& part, std::span<const int> variables) {
  const int term = tree_.add_term(variables);
  if (nth(term) == parts_.size()) parts_.emplace_back();
  parts_[nth(term)] = part;
  return term;
}

/// Gauss-Newton, where anything has moved by more than what is linear.
void IncrementalSmoother::settle() {
  marginalise_old();
  std::vector<int> last = in_view_;
  if (parameter_variable_ >= 0) last.push_back(parameter_variable_);
  last.push_back(pose_variables_.back());
  for (int round = 1;; ++round) {
    if (!tree_.update(last, [this](int term, FrontSystem& system) { linearise(term, at_, system); }))
      throw CannotAnswer("the sightings leave poses or landmarks undetermined");
    const std::vector<int>& solved = tree_.solve();
    note_moved(solved);
    if (round >= options_.most_rounds || !relinearise(solved)) return;
  }
}

/// Where what was solved for has moved by more than what is linear. False: nowhere. Eq. 23.
bool IncrementalSmoother::relinearise(std::span<const int> solved) {
  bool moved = false;
  for (const int variable : solved) {
    const Unknown& unknown = unknown_of_[nth(variable)];
    if (unknown.kind == Unknown::Kind::parameters) continue;
    if (unknown.kind == Unknown::Kind::pose) {
      const int seen = sees_[nth(unknown.index)];
      if (std::abs(tree_.solution(variable)[2]) <= linear_.turn_rad &&
          (seen < 0 || moved_apart(seen, unknown.index).left_out <= 2.0 * kLinear))
        continue;
      if (!has_moved_alone(unknown.index)) return relinearise_all();
      move_linearisation(variable, tree_.solution(variable));
      moved = true;
      continue;
    }
    if (map_.landmarks[nth(unknown.index)].seen_from < 0) continue;  // known by what is marginalised: linear
    const Apart apart = moved_apart(unknown.index, map_.landmarks[nth(unknown.index)].seen_from);
    if (apart.left_out <= kLinear) continue;
    move_linearisation(variable, apart.moved);
    moved = true;
  }
  return moved;
}

/// And not with what it sees: that is linear about where it was.
bool IncrementalSmoother::has_moved_alone(int pose) const {
  const int seen = sees_[nth(pose)];
  return seen >= 0 &&
         left_out(tree_.solution(map_.landmarks[nth(seen)].variable), sight_of(seen, pose)) <= kLinear;
}

bool IncrementalSmoother::relinearise_all() {
  tree_.solve(EliminationTree::Solve::all);
  for (int variable = 0; variable < tree_.variables(); ++variable)
    move_linearisation(variable, tree_.solution(variable));
  return true;
}

/// From the pose to the landmark, as both are linearised.
Vector2 IncrementalSmoother::sight_of(int landmark, int pose) const {
  return at_.landmarks[nth(landmark)] - at_.poses[nth(pose)].translation();
}

/// Readings see where landmarks are in the frame of a pose: what both move alike does not matter.
IncrementalSmoother::Apart IncrementalSmoother::moved_apart(int landmark, int pose) const {
  const auto of_pose = tree_.solution(pose_variables_[nth(pose)]);
  const Pose2& from = at_.poses[nth(pose)];
  const Vector2 u = sight_of(landmark, pose);
  const Vector2 turned = of_pose[2] * Vector2(-u.y(), u.x());
  const Vector2 moved = from * Vector2(of_pose.head<2>()) - from.translation();
  const Vector2 apart = tree_.solution(map_.landmarks[nth(landmark)].variable) - turned - moved;
  return {apart, left_out(apart, u)};
}

double IncrementalSmoother::left_out(const Vector2& apart, const Vector2& sight) const {
  const double range = std::max(sight.norm(), problem_.sensors.front().range_sigma_m);
  const double along = apart.dot(sight) / range;
  const double across = (apart.y() * sight.x() - apart.x() * sight.y()) / range;
  return std::max(across * across / (2.0 * range * problem_.sensors.front().range_sigma_m),
                  std::abs(along * across) / (range * range * problem_.sensors.front().bearing_sigma_rad));
}

void IncrementalSmoother::linearise(int term, const SmoothingState& at, FrontSystem& system) const {
  const Part& part = parts_[nth(term)];
  Equations equations{*this, system};
  switch (part.kind) {
    case Part::Kind::motion:
      return add_to(equations, problem_.motions[part.index], problem_, at);
    case Part::Kind::sighting:
      return add_to(equations, problem_.sightings[part.index], problem_, at);
    case Part::Kind::bias:
      return add_to(equations, problem_.bias_readings[part.index], problem_, at);
    case Part::Kind::parameters:
      return add_parameters_to(equations, problem_, at);
    case Part::Kind::past:
      return past_.parts[part.index]
          .prior.at([&](int variable) { return value_of(variable, at); })
          .add_to(system);
  }
}

void IncrementalSmoother::move_linearisation(int variable, const VectorXd& by) {
  const Unknown& unknown = unknown_of_[nth(variable)];
  switch (unknown.kind) {
    case Unknown::Kind::pose:
      at_.poses[nth(unknown.index)] = moved_by(by.head<3>(), at_.poses[nth(unknown.index)]);
      if (problem_.has_bias) at_.biases[nth(unknown.index)] += by[3];
      break;
    case Unknown::Kind::landmark:
      at_.landmarks[nth(unknown.index)] += by;
      break;
    case Unknown::Kind::parameters:
      at_.parameters += by;
      break;
    case Unknown::Kind::removed:
      return;
  }
  tree_.move(variable, by);
}

}  // namespace trundle::slam
