// FactorGraph: what was marginalised. docs/theory/marginalisation.md, eq. 33 to 35.
#include <algorithm>
#include <iterator>

#include "trundle/slam/nth.hpp"
#include "trundle/slam/smoothing/solver/factor_graph.hpp"
#include "trundle/slam/smoothing/solver/normal_equations.hpp"

namespace trundle::slam {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Landmarks that the first pose of the window stays tied to, at least, when a submap is cut off.
constexpr std::size_t kTiedTo = 15;
// Landmarks of a submap, at most, where another stretch of the way is added to it: each that is cut off has
// more than kTiedTo, so two of them find room, and three that overlap.
constexpr std::size_t kMostInSubmap = 3 * kTiedTo;
// There is at most one submap for so many landmarks; from then on they grow instead.
constexpr std::size_t kLandmarksOfSubmap = kTiedTo / 2;

}  // namespace

/// Linearised at the estimate, as it can not be done again.
void FactorGraph::marginalise_first(int poses) {
  const SmoothingState now = state();
  EliminationTree::Sum sum =
      tree_.take_out(std::span(pose_variables_).first(nth(poses)), [&](int term, FrontSystem& system) {
        const Factor& factor = factors_[nth(term)];
        if (factor.kind != Factor::Kind::motion || problem_.motions[factor.index].from == MotionLink::kKnown)
          linearise(term, now, system);
      });
  std::vector<MarginalPrior::Unknown> unknowns;
  for (const int variable : sum.variables) unknowns.push_back(prior_unknown(variable, now));
  MarginalPrior prior(std::move(unknowns), std::move(sum.matrix), std::move(sum.right));
  for (const MotionLink& link : problem_.motions)
    if (link.from != MotionLink::kKnown && link.from < poses) prior = prior.moved_on(next_pose(link, now));

  for (const int term : sum.terms) factors_[nth(term)] = {Factor::Kind::prior, 0};
  if (priors_.empty()) priors_.emplace_back();
  priors_.front().factor = -1;
  set_prior(0, std::move(prior));
  forget_poses(poses);
  forget_sightings(poses);
  split_off_submap();
}

MarginalPrior::Unknown FactorGraph::prior_unknown(int variable, const SmoothingState& state) const {
  using Kind = MarginalPrior::Kind;
  const auto kind = variables_[nth(variable)].kind;
  return {variable,
          kind == Variable::Kind::landmark ? Kind::landmark
          : kind == Variable::Kind::pose   ? Kind::pose
                                           : Kind::parameters,
          value_of(variable, state)};
}

MarginalPrior::NextPose FactorGraph::next_pose(const MotionLink& link, const SmoothingState& state) const {
  const MotionResidual motion = motion_residual(link, state);
  const Index n = pose_size(problem_);
  MarginalPrior::NextPose next{.from = pose_variables_[nth(link.from)],
                               .to = prior_unknown(pose_variables_[nth(link.to)], state),
                               .parameters = {},
                               .error = motion.error.head(n),
                               .by_from = motion.by_from.topLeftCorner(n, n),
                               .by_to = motion.by_to.topLeftCorner(n, n),
                               .by_parameters = MatrixXd::Zero(n, link.by_parameters.cols()),
                               .information = link.information.topLeftCorner(n, n)};
  if (parameter_variable_ >= 0) next.parameters = prior_unknown(parameter_variable_, state);
  next.by_parameters.topRows<3>() = -link.by_parameters;
  return next;
}

/// Of a pose, or a landmark, or the parameters.
VectorXd FactorGraph::value_of(int variable, const SmoothingState& state) const {
  const Variable& unknown = variables_[nth(variable)];
  if (unknown.kind == Variable::Kind::landmark) return state.landmarks[nth(unknown.index)];
  if (unknown.kind == Variable::Kind::parameters) return state.parameters;
  const Pose2& pose = state.poses[nth(unknown.index)];
  const Eigen::Vector4d all(pose.x, pose.y, pose.heading, state.bias_at(unknown.index));
  return all.head(pose_size(problem_));
}

/// The first poses, with what is about them; the rest is numbered anew.
void FactorGraph::forget_poses(int poses) {
  const auto erase_first = [](auto& of_poses, std::ptrdiff_t count) {
    if (!of_poses.empty()) of_poses.erase(of_poses.begin(), of_poses.begin() + count);
  };
  for (int i = 0; i < poses; ++i) variables_[nth(pose_variables_[nth(i)])] = {Variable::Kind::removed, 0};
  erase_first(at_.poses, poses);
  erase_first(at_.biases, poses);
  erase_first(pose_variables_, poses);
  erase_first(first_seen_, poses);
  problem_.poses -= poses;
  for (int i = 0; i < problem_.poses; ++i) variables_[nth(pose_variables_[nth(i)])].index = i;

  const auto motions = std::erase_if(problem_.motions, [&](const MotionLink& l) { return l.to <= poses; });
  for (MotionLink& link : problem_.motions) link.from -= poses, link.to -= poses;
  const auto readings =
      std::erase_if(problem_.bias_readings, [&](const BiasLink& l) { return l.pose < poses; });
  for (BiasLink& link : problem_.bias_readings) link.pose -= poses;
  for (Factor& factor : factors_) {
    if (factor.kind == Factor::Kind::motion) factor.index -= motions;
    if (factor.kind == Factor::Kind::bias) factor.index -= readings;
  }
}

/// Of the first poses, which are no more; the rest is numbered anew.
void FactorGraph::forget_sightings(int poses) {
  for (Landmark& landmark : landmarks_) {
    landmark.seen_from -= poses;
    landmark.sightings.clear();
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < problem_.sightings.size(); ++i) {
    SightingLink link = problem_.sightings[i];
    if (link.pose < poses) continue;
    link.pose -= poses;
    problem_.sightings[kept] = link;
    factor_of_[kept] = factor_of_[i];
    factors_[nth(factor_of_[kept])].index = kept;
    landmarks_[nth(link.landmark)].sightings.push_back(kept++);
  }
  problem_.sightings.resize(kept);
  factor_of_.resize(kept);
}

/// Where the first pose of the window is tied to many landmarks, those that were seen longest ago are tied to
/// the other landmarks alone, in a submap. Eq. 35.
void FactorGraph::split_off_submap() {
  const MarginalPrior& of_pose = priors_.front().prior;
  std::vector<const Landmark*> landmarks;
  for (const MarginalPrior::Unknown& unknown : of_pose.unknowns())
    if (unknown.kind == MarginalPrior::Kind::landmark)
      landmarks.push_back(&landmarks_[nth(variables_[nth(unknown.variable)].index)]);
  const auto in_window =
      std::ranges::count_if(landmarks, [](const Landmark* l) { return l->seen_from >= 0; });
  const std::size_t near = std::max(kTiedTo, static_cast<std::size_t>(in_window));
  if (landmarks.size() <= 2 * near) return;
  std::ranges::stable_sort(landmarks, std::greater{}, &Landmark::seen_from);
  std::vector<int> far;
  for (std::size_t i = near; i < landmarks.size(); ++i) far.push_back(landmarks[i]->variable);
  const int pose = pose_variables_.front();
  MarginalPrior submap = of_pose.marginalised({pose}).conditional(far);
  set_prior(0, of_pose.marginalised(far));
  add_submap(std::move(submap));
}

/// To the one that shares most landmarks with it, if both together are few or there are many submaps.
void FactorGraph::add_submap(MarginalPrior submap) {
  const bool are_many = priors_.size() * kLandmarksOfSubmap > landmarks_.size();
  std::size_t most = 0, best = 0;
  for (std::size_t k = 1; k < priors_.size(); ++k) {
    const auto shared = static_cast<std::size_t>(std::ranges::count_if(
        submap.unknowns(),
        [&](const MarginalPrior::Unknown& unknown) { return priors_[k].prior.has(unknown.variable); }));
    const std::size_t both = submap.unknowns().size() + priors_[k].prior.unknowns().size() - shared;
    if (shared <= most || (both > kMostInSubmap && !are_many)) continue;
    most = shared;
    best = k;
  }
  if (best == 0) {
    priors_.emplace_back();
    return set_prior(priors_.size() - 1, std::move(submap));
  }
  const auto now = [this](int variable) { return value_of(variable, at_); };
  set_prior(best, priors_[best].prior.at(now).with(submap.at(now)));
}

void FactorGraph::set_prior(std::size_t which, MarginalPrior prior) {
  Prior& part = priors_[which];
  if (part.factor >= 0) tree_.remove_term(part.factor);
  part.prior = std::move(prior);
  part.factor = add_factor({Factor::Kind::prior, which}, part.prior.variables());
}

}  // namespace trundle::slam
