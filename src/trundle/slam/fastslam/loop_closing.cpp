#include "trundle/slam/fastslam/loop_closing.hpp"

#include <algorithm>
#include <set>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "trundle/statistics/distribution.hpp"

namespace trundle::slam {
namespace {

using Matrix23 = Eigen::Matrix<double, 2, 3>;

constexpr std::uint64_t kWindow = 30;    ///< keyframes: so long a sighting is kept, and a landmark is not old
constexpr std::size_t kMostSightings = 64;  ///< are remembered
constexpr std::size_t kLeastSightings = 6;  ///< have to agree
constexpr std::size_t kLeastWitnesses = 2;  ///< landmarks that do
constexpr double kLeastShare = 2.0 / 3.0;   ///< of what is remembered has to agree, or of landmarks to fit
constexpr double kTail = 1e-3;              ///< probability of what is not taken for chance

/// How a point moves, both counted from the centre, and its derivative by the twist.
struct Moved {
  Vector2 place;
  Matrix23 by_twist;
};
Moved moved(const Vector2& place, const Vector3& twist) {
  const Twist2 by = Twist2::from(twist);
  const Vector2 there = exp(by) * place;
  Matrix23 by_left;
  by_left << 1.0, 0.0, -there.y(), 0.0, 1.0, there.x();
  return {there, by_left * left_jacobian(by)};
}

/// χ² of one landmark under a move.
double surprise(const Revisit& again, const LoopCorrection::Move& move) {
  const Vector2 at = again.seen - move.centre;
  const Moved there = moved(at, move.twist);
  const Matrix2 R = rotation(move.twist.z());
  const Vector2 apart = again.mapped - move.centre - there.place;
  return apart.dot((again.mapped_covariance + R * again.seen_covariance * R.transpose()).ldlt().solve(apart));
}

/// What lies between a piece of old and the present, for all that is known: eq. 63.
Matrix3 drift_since(const FrameCovariance& old, const FrameCovariance& now, const Vector2& centre) {
  return 2.0 * (now.about(centre).covariance - old.about(centre).covariance);
}

/// However often a landmark is seen again, where it is mapped errs once. In n sightings of it that count as
/// independent it errs n times as much.
std::vector<Revisit> as_one_witness_each(std::vector<Revisit> again) {
  const std::vector<Revisit> all = again;
  for (Revisit& s : again)
    s.mapped_covariance *= static_cast<double>(std::ranges::count(all, s.landmark, &Revisit::landmark));
  return again;
}

/// Fits again and again without the worst outliers, until there is none.
struct Agreement {
  LoopCorrection::Move move;
  std::vector<Revisit> again;  ///< that agree
};
Agreement agreement_of(const std::vector<Revisit>& all, const Vector2& centre, const Matrix3& prior) {
  constexpr int kRounds =
      20;  // each halves the largest deviation at least: of any size that occurs, to the gate
  Agreement found{{}, all};
  for (int round = 0; round < kRounds; ++round) {
    found.move = rigid_fit(as_one_witness_each(found.again), centre, prior);
    double worst = 0.0;
    for (const Revisit& s : found.again) worst = std::max(worst, surprise(s, found.move));
    if (worst < kDefaultGate) break;
    const double limit = std::max(kDefaultGate, 0.5 * worst);
    found.again.clear();
    for (const Revisit& s : all)
      if (surprise(s, found.move) < limit) found.again.push_back(s);
  }
  return found;
}

/// How many landmarks were seen twice: a wrong name comes once.
std::size_t witnesses_of(const std::vector<Revisit>& again) {
  std::vector<LandmarkId> twice;
  for (const Revisit& s : again)
    if (std::ranges::find(twice, s.landmark) == twice.end() &&
        std::ranges::count(again, s.landmark, &Revisit::landmark) > 1)
      twice.push_back(s.landmark);
  return twice.size();
}

bool is_enough(const std::vector<Revisit>& again) {
  return again.size() >= kLeastSightings && witnesses_of(again) >= kLeastWitnesses;
}

/// Whether the move is known better than one reading tells a place, no further than drift goes, and takes
/// everything to where it is mapped.
bool is_believable(const Agreement& found, const Matrix3& prior) {
  if (found.move.covariance.topLeftCorner<2, 2>().trace() > found.again.front().seen_covariance.trace())
    return false;
  double misfit = 0.0;
  for (const Revisit& s : as_one_witness_each(found.again)) misfit += surprise(s, found.move);
  const auto readings = 2.0 * static_cast<double>(found.again.size());
  const Vector3& twist = found.move.twist;
  return misfit < chi_squared_limit(kTail, readings) &&
         twist.dot(prior.ldlt().solve(twist)) < chi_squared_limit(kTail, 3.0);
}

}  // namespace

LoopCorrection::Move rigid_fit(std::span<const Revisit> again, const Vector2& centre, const Matrix3& prior) {
  LoopCorrection::Move move{centre};
  const Matrix3 prior_information = prior.ldlt().solve(Matrix3::Identity());
  for (int iteration = 0; iteration < 20; ++iteration) {
    Matrix3 information = prior_information;
    Vector3 gradient = -prior_information * move.twist;
    const Matrix2 R = rotation(move.twist.z());
    for (const Revisit& s : again) {
      const Moved there = moved(s.seen - centre, move.twist);
      const Matrix2 weight = (s.mapped_covariance + R * s.seen_covariance * R.transpose()).inverse();
      information += there.by_twist.transpose() * weight * there.by_twist;
      gradient += there.by_twist.transpose() * weight * (s.mapped - centre - there.place);
    }
    const Eigen::LDLT<Matrix3> solver(information);
    const Vector3 further = solver.solve(gradient);
    move.twist += further;
    move.covariance = solver.solve(Matrix3::Identity());
    if (further.dot(gradient) < 1e-16) break;
  }
  return move;
}

void LoopClosing::next_keyframe() {
  is_news_ = false;
  ++keyframe_;
  while (!window_.empty() && window_.front().keyframe + kWindow < keyframe_) window_.pop_front();
  std::erase_if(returned_, [&](const auto& landmark) { return landmark.second + kWindow < keyframe_; });
}

bool LoopClosing::is_old(const Submap& piece) const {
  return piece.keyframe + kWindow < keyframe_;
}

void LoopClosing::remember(const Revisit& again, bool speaks_for_drift) {
  window_.push_back({again, keyframe_, speaks_for_drift});
  is_news_ = is_news_ || speaks_for_drift;
  if (window_.size() > kMostSightings) window_.pop_front();
}

bool LoopClosing::is_another_look(const Revisit& again) const {
  const double range_m = (again.seen - again.seen_from).norm();
  return std::ranges::none_of(window_, [&](const Sighting& s) {
    return s.again.landmark == again.landmark &&
           !trundle::slam::is_another_look((again.seen_from - s.again.seen_from).norm(), range_m);
  });
}

void LoopClosing::rejected(const Revisit& again, const Submap& now) {
  if (!is_another_look(again)) return;
  const Matrix2 drift = drift_since(again.seen_in.doubt, now.doubt, again.seen).topLeftCorner<2, 2>();
  const Matrix2 errors = again.mapped_covariance + again.seen_covariance;
  const Eigen::LLT<Matrix2> all(drift + errors);
  const Vector2 apart = again.mapped - again.seen;
  const bool needs_drift = apart.dot(errors.ldlt().solve(apart)) > kDefaultGate;
  remember(again, needs_drift && all.info() == Eigen::Success && apart.dot(all.solve(apart)) < kDefaultGate);
}

/// Where no drift worth the name has come about, it says nothing.
void LoopClosing::matched(const Revisit& again, const Submap& now) {
  const Matrix2 drift = drift_since(again.seen_in.doubt, now.doubt, again.seen).topLeftCorner<2, 2>();
  if (drift.trace() < again.seen_covariance.trace()) return;
  remember(again, false);
  returned_[again.landmark] = keyframe_;
}

void LoopClosing::still_matched(LandmarkId landmark) {
  if (const auto at = returned_.find(landmark); at != returned_.end()) at->second = keyframe_;
}

bool LoopClosing::is_closed() const {
  std::set<LandmarkId> back;
  for (const auto& landmark : returned_) back.insert(landmark.first);
  for (const Sighting& s : window_) back.insert(s.again.landmark);
  const auto fit = static_cast<double>(returned_.size());
  return returned_.size() >= kLeastWitnesses && fit >= kLeastShare * static_cast<double>(back.size());
}

std::optional<LoopCorrection> LoopClosing::close(const Submap& now) {
  if (!has_news()) return std::nullopt;
  std::vector<Revisit> again;
  for (const Sighting& s : window_)
    if (s.speaks_for_drift) again.push_back(s.again);
  if (!is_enough(again)) return std::nullopt;
  Vector2 centre = Vector2::Zero();
  for (const Revisit& s : again) centre += s.seen / static_cast<double>(again.size());
  // The youngest: whatever is older stays where it is.
  const Submap old =
      std::ranges::max_element(again, {}, [](const Revisit& s) { return s.seen_in.keyframe; })->seen_in;
  const Matrix3 prior = drift_since(old.doubt, now.doubt, centre);
  if (Eigen::LLT<Matrix3>(prior).info() != Eigen::Success) return std::nullopt;
  const Agreement found = agreement_of(again, centre, prior);
  const auto agreed = static_cast<double>(found.again.size());
  if (agreed < kLeastShare * static_cast<double>(window_.size())) return std::nullopt;
  if (!is_enough(found.again) || !is_believable(found, prior)) return std::nullopt;
  const auto witnesses = static_cast<double>(witnesses_of(found.again));
  if (witnesses < static_cast<double>(returned_.size())) return std::nullopt;
  const std::optional<LoopCorrection> bend = LoopCorrection::between(old, now, found.move);
  if (bend) {
    window_.clear();
    returned_.clear();
  }
  return bend;
}

}  // namespace trundle::slam
