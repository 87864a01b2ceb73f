// IncrementalSmoother: what is older than the window. docs/theory/marginalisation.md, eq. 33 to 35.
#include <algorithm>
#include <iterator>

#include "trundle/slam/smoothing/incremental_smoother.hpp"
#include "trundle/slam/smoothing/normal_equations.hpp"
#include "trundle/slam/smoothing/nth.hpp"

namespace trundle::slam {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// So many keyframes are marginalised at once: each time the fronts from the end of the window up to the root
// are eliminated anew.
constexpr int kMarginalisedAtOnce = 8;
// Landmarks that the first pose of the window stays tied to, at least, when a submap is cut off; and how many
// a submap may have, where another stretch of the way is added to it.
constexpr std::size_t kTiedTo = 15;
constexpr std::size_t kMostInSubmap = 3 * kTiedTo;
// There is at most one submap for so many landmarks; from then on they grow instead.
constexpr std::size_t kLandmarksOfSubmap = kTiedTo / 2;

}  // namespace

void IncrementalSmoother::marginalise_old() {
  if (!options_.window_s) return;
  const auto is_old = [&](double stamp) { return stamp < time_s_ - *options_.window_s; };
  while (static_cast<int>(stamps_.size()) > kMarginalisedAtOnce &&
         is_old(stamps_[nth(kMarginalisedAtOnce - 1)]))
    marginalise_first(kMarginalisedAtOnce);
}

/// Linearised at the estimate, as it can not be done again.
void IncrementalSmoother::marginalise_first(int poses) {
  const SmoothingState now = state();
  EliminationTree::Sum sum =
      tree_.take_out(std::span(pose_variables_).first(nth(poses)), [&](int term, FrontSystem& system) {
        const Part& part = parts_[nth(term)];
        if (part.kind != Part::Kind::motion || problem_.motions[part.index].from == MotionLink::kKnown)
          linearise(term, now, system);
      });
  std::vector<MarginalPrior::Unknown> unknowns;
  for (const int variable : sum.variables) unknowns.push_back(past_unknown(variable, now));
  MarginalPrior prior(std::move(unknowns), std::move(sum.matrix), std::move(sum.right));
  for (const MotionLink& link : problem_.motions)
    if (link.from != MotionLink::kKnown && link.from < poses) prior = prior.moved_on(next_pose(link, now));

  for (const int term : sum.terms) parts_[nth(term)] = {Part::Kind::past, 0};
  if (past_.parts.empty()) past_.parts.emplace_back();
  past_.parts.front().term = -1;
  put_past(0, std::move(prior));
  note_seen_together(poses);
  forget_first(poses);
  divide_past();
}

MarginalPrior::Unknown IncrementalSmoother::past_unknown(int variable, const SmoothingState& state) const {
  using Kind = MarginalPrior::Kind;
  const auto kind = unknown_of_[nth(variable)].kind;
  return {variable,
          kind == Unknown::Kind::landmark ? Kind::landmark
          : kind == Unknown::Kind::pose   ? Kind::pose
                                          : Kind::parameters,
          value_of(variable, state)};
}

MarginalPrior::NextPose IncrementalSmoother::next_pose(const MotionLink& link,
                                                       const SmoothingState& state) const {
  const MotionResidual motion = motion_residual(link, state);
  const Index n = pose_size(problem_);
  MarginalPrior::NextPose next{.from = pose_variables_[nth(link.from)],
                               .to = past_unknown(pose_variables_[nth(link.to)], state),
                               .parameters = {},
                               .error = motion.error.head(n),
                               .by_from = motion.by_from.topLeftCorner(n, n),
                               .by_to = motion.by_to.topLeftCorner(n, n),
                               .by_parameters = MatrixXd::Zero(n, link.by_parameters.cols()),
                               .information = link.information.topLeftCorner(n, n)};
  if (parameter_variable_ >= 0) next.parameters = past_unknown(parameter_variable_, state);
  next.by_parameters.topRows<3>() = -link.by_parameters;
  return next;
}

/// Of a pose, or a landmark, or the parameters.
VectorXd IncrementalSmoother::value_of(int variable, const SmoothingState& state) const {
  const Unknown& unknown = unknown_of_[nth(variable)];
  if (unknown.kind == Unknown::Kind::landmark) return state.landmarks[nth(unknown.index)];
  if (unknown.kind == Unknown::Kind::parameters) return state.parameters;
  const Pose2& pose = state.poses[nth(unknown.index)];
  const Eigen::Vector4d all(pose.x, pose.y, pose.heading, state.bias_at(unknown.index));
  return all.head(pose_size(problem_));
}

/// Of landmarks without names: two that were seen in one instant are two.
void IncrementalSmoother::note_seen_together(int poses) {
  std::vector<std::vector<int>> seen(nth(poses));
  for (const SightingLink& link : problem_.sightings)
    if (link.pose < poses) seen[nth(link.pose)].push_back(link.landmark);
  const auto note = [&](const Landmark& a, const Landmark& b) {
    std::vector<int>& with = past_.seen_with[a.variable];
    const auto place = std::ranges::lower_bound(with, b.variable);
    if (place == with.end() || *place != b.variable) with.insert(place, b.variable);
  };
  for (const std::vector<int>& at_once : seen)
    for (const int i : at_once)
      for (const int j : at_once) {
        const Landmark &a = map_.landmarks[nth(i)], &b = map_.landmarks[nth(j)];
        if (i != j && !(a.is_identified && b.is_identified)) note(a, b);
      }
}

/// The first poses, with what is about them; the rest is numbered anew.
void IncrementalSmoother::forget_first(int poses) {
  const auto erase_first = [](auto& of_poses, std::ptrdiff_t count) {
    if (!of_poses.empty()) of_poses.erase(of_poses.begin(), of_poses.begin() + count);
  };
  for (int i = 0; i < poses; ++i) unknown_of_[nth(pose_variables_[nth(i)])] = {Unknown::Kind::removed, 0};
  erase_first(at_.poses, poses);
  erase_first(at_.biases, poses);
  erase_first(pose_variables_, poses);
  erase_first(sees_, poses);
  erase_first(stamps_, poses);
  problem_.poses -= poses;
  for (int i = 0; i < problem_.poses; ++i) unknown_of_[nth(pose_variables_[nth(i)])].index = i;

  const auto motions = std::erase_if(problem_.motions, [&](const MotionLink& l) { return l.to <= poses; });
  for (MotionLink& link : problem_.motions) link.from -= poses, link.to -= poses;
  const auto readings =
      std::erase_if(problem_.bias_readings, [&](const BiasLink& l) { return l.pose < poses; });
  for (BiasLink& link : problem_.bias_readings) link.pose -= poses;
  for (Part& part : parts_) {
    if (part.kind == Part::Kind::motion) part.index -= motions;
    if (part.kind == Part::Kind::bias) part.index -= readings;
  }

  for (Landmark& landmark : map_.landmarks) {
    landmark.seen_from -= poses;
    landmark.marginalised += landmark.sightings.size();
    landmark.sightings.clear();
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < problem_.sightings.size(); ++i) {
    SightingLink link = problem_.sightings[i];
    if (link.pose < poses) continue;
    link.pose -= poses;
    problem_.sightings[kept] = link;
    term_of_[kept] = term_of_[i];
    parts_[nth(term_of_[kept])].index = kept;
    Landmark& landmark = map_.landmarks[nth(link.landmark)];
    landmark.sightings.push_back(kept++);
    --landmark.marginalised;
  }
  problem_.sightings.resize(kept);
  term_of_.resize(kept);
}

/// Where the first pose of the window is tied to many landmarks, those that were seen longest ago are tied to
/// the other landmarks alone, in a submap. Eq. 35.
void IncrementalSmoother::divide_past() {
  const MarginalPrior& past = past_.parts.front().prior;
  std::vector<const Landmark*> landmarks;
  for (const MarginalPrior::Unknown& unknown : past.unknowns())
    if (unknown.kind == MarginalPrior::Kind::landmark)
      landmarks.push_back(&map_.landmarks[nth(unknown_of_[nth(unknown.variable)].index)]);
  const auto in_window =
      std::ranges::count_if(landmarks, [](const Landmark* l) { return l->seen_from >= 0; });
  const std::size_t near = std::max(kTiedTo, static_cast<std::size_t>(in_window));
  if (landmarks.size() <= 2 * near) return;
  std::ranges::stable_sort(landmarks, std::greater{}, &Landmark::seen_from);
  std::vector<int> far;
  for (std::size_t i = near; i < landmarks.size(); ++i) far.push_back(landmarks[i]->variable);
  const int pose = pose_variables_.front();
  MarginalPrior submap = past.without({pose}).given_others(far);
  put_past(0, past.without(far));
  add_submap(std::move(submap));
}

/// To the one that shares most landmarks with it, if both together are few or there are many submaps.
void IncrementalSmoother::add_submap(MarginalPrior submap) {
  const bool are_many = past_.parts.size() * kLandmarksOfSubmap > map_.landmarks.size();
  std::size_t most = 0, best = 0;
  for (std::size_t k = 1; k < past_.parts.size(); ++k) {
    const auto shared = static_cast<std::size_t>(std::ranges::count_if(
        submap.unknowns(),
        [&](const MarginalPrior::Unknown& unknown) { return past_.parts[k].prior.has(unknown.variable); }));
    const std::size_t both = submap.unknowns().size() + past_.parts[k].prior.unknowns().size() - shared;
    if (shared <= most || (both > kMostInSubmap && !are_many)) continue;
    most = shared;
    best = k;
  }
  if (best == 0) {
    past_.parts.emplace_back();
    return put_past(past_.parts.size() - 1, std::move(submap));
  }
  const auto now = [this](int variable) { return value_of(variable, at_); };
  put_past(best, past_.parts[best].prior.at(now).with(submap.at(now)));
}

void IncrementalSmoother::put_past(std::size_t part, MarginalPrior prior) {
  PastPart& past = past_.parts[part];
  if (past.term >= 0) tree_.remove_term(past.term);
  past.prior = std::move(prior);
  past.term = add_part({Part::Kind::past, part}, past.prior.variables());
}

void IncrementalSmoother::merge_past(int kept, int gone) {
  for (std::size_t k = 0; k < past_.parts.size(); ++k) {
    if (!past_.parts[k].prior.has(gone)) continue;
    MarginalPrior prior = past_.parts[k].prior;
    prior.merge(kept, gone);
    put_past(k, std::move(prior));
  }
  const auto with_gone = past_.seen_with.find(gone);
  if (with_gone == past_.seen_with.end()) return;
  for (const int other : with_gone->second)
    for (const auto& [a, b] : {std::pair(kept, other), std::pair(other, kept)}) {
      std::vector<int>& with = past_.seen_with[a];
      const auto place = std::ranges::lower_bound(with, b);
      if (place == with.end() || *place != b) with.insert(place, b);
    }
}

/// What its sightings said of others stays.
void IncrementalSmoother::remove_from_past(int variable) {
  for (std::size_t k = 0; k < past_.parts.size(); ++k)
    if (past_.parts[k].prior.has(variable)) put_past(k, past_.parts[k].prior.without({variable}));
  const auto found = past_.seen_with.find(variable);
  if (found == past_.seen_with.end()) return;
  for (const int other : found->second) std::erase(past_.seen_with[other], variable);
  past_.seen_with.erase(found);
}

}  // namespace trundle::slam
