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

constexpr std::uint64_t kWindow = 30;  ///< keyframes: so long a sighting is kept, and a landmark is not old
constexpr std::size_t kMostSightings = 64;   ///< are kept
constexpr std::size_t kLeastSightings = 6;   ///< have to agree
constexpr std::size_t kLeastSupporting = 2;  ///< landmarks that do
constexpr double kLeastShare = 2.0 / 3.0;    ///< of what is kept has to agree, or of landmarks to fit
constexpr double kTail = 1e-3;               ///< probability of what is not taken for chance

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

/// NIS of one landmark under a move.
double nis_of(const Revisit& revisit, const LoopCorrection::Move& move) {
  const Vector2 at = revisit.seen - move.centre;
  const Moved there = moved(at, move.twist);
  const Matrix2 R = rotation(move.twist.z());
  const Vector2 residual = revisit.mapped - move.centre - there.place;
  return residual.dot(
      (revisit.mapped_covariance + R * revisit.seen_covariance * R.transpose()).ldlt().solve(residual));
}

/// What lies between an old submap and the present one, for all that is known: eq. 63.
Matrix3 drift_since(const FrameCovariance& old, const FrameCovariance& now, const Vector2& centre) {
  return 2.0 * (now.about(centre).covariance - old.about(centre).covariance);
}

/// However often a landmark is seen again, where it is mapped errs once. In n sightings of it that count
/// as independent it errs n times as much.
std::vector<Revisit> with_shared_map_errors(std::vector<Revisit> revisits) {
  const std::vector<Revisit> all = revisits;
  for (Revisit& s : revisits)
    s.mapped_covariance *= static_cast<double>(std::ranges::count(all, s.landmark, &Revisit::landmark));
  return revisits;
}

/// Fits again and again without the worst outliers, until there is none.
struct Consensus {
  LoopCorrection::Move move;
  std::vector<Revisit> revisits;  ///< that agree
};
Consensus consensus_of(const std::vector<Revisit>& all, const Vector2& centre, const Matrix3& prior) {
  constexpr int kRounds =
      20;  // each halves the largest deviation at least: of any size that occurs, to the gate
  Consensus found{{}, all};
  for (int round = 0; round < kRounds; ++round) {
    found.move = rigid_fit(with_shared_map_errors(found.revisits), centre, prior);
    double worst = 0.0;
    for (const Revisit& s : found.revisits) worst = std::max(worst, nis_of(s, found.move));
    if (worst < kDefaultGate) break;
    const double limit = std::max(kDefaultGate, 0.5 * worst);
    found.revisits.clear();
    for (const Revisit& s : all)
      if (nis_of(s, found.move) < limit) found.revisits.push_back(s);
  }
  return found;
}

/// How many landmarks were seen twice: a wrong name comes once.
std::size_t supporting_landmarks(const std::vector<Revisit>& revisits) {
  std::vector<LandmarkId> twice;
  for (const Revisit& s : revisits)
    if (std::ranges::find(twice, s.landmark) == twice.end() &&
        std::ranges::count(revisits, s.landmark, &Revisit::landmark) > 1)
      twice.push_back(s.landmark);
  return twice.size();
}

bool is_enough(const std::vector<Revisit>& revisits) {
  return revisits.size() >= kLeastSightings && supporting_landmarks(revisits) >= kLeastSupporting;
}

/// Whether the move is known better than one reading tells a place, no further than drift goes, and takes
/// everything to where it is mapped.
bool is_consistent(const Consensus& found, const Matrix3& prior) {
  if (found.move.covariance.topLeftCorner<2, 2>().trace() > found.revisits.front().seen_covariance.trace())
    return false;
  double misfit = 0.0;
  for (const Revisit& s : with_shared_map_errors(found.revisits)) misfit += nis_of(s, found.move);
  const auto readings = 2.0 * static_cast<double>(found.revisits.size());
  const Vector3& twist = found.move.twist;
  return misfit < chi_squared_limit(kTail, readings) &&
         twist.dot(prior.ldlt().solve(twist)) < chi_squared_limit(kTail, 3.0);
}

}  // namespace

LoopCorrection::Move rigid_fit(std::span<const Revisit> revisits, const Vector2& centre,
                               const Matrix3& prior) {
  LoopCorrection::Move move{centre};
  const Matrix3 prior_information = prior.ldlt().solve(Matrix3::Identity());
  for (int iteration = 0; iteration < 20; ++iteration) {
    Matrix3 information = prior_information;
    Vector3 gradient = -prior_information * move.twist;
    const Matrix2 R = rotation(move.twist.z());
    for (const Revisit& s : revisits) {
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
  has_evidence_ = false;
  ++keyframe_;
  while (!window_.empty() && window_.front().keyframe + kWindow < keyframe_) window_.pop_front();
  std::erase_if(revisited_, [&](const auto& landmark) { return landmark.second + kWindow < keyframe_; });
}

bool LoopClosing::is_old(const Submap& submap) const {
  return submap.keyframe + kWindow < keyframe_;
}

void LoopClosing::store(const Revisit& revisit, bool explained_by_drift) {
  window_.push_back({revisit, keyframe_, explained_by_drift});
  has_evidence_ = has_evidence_ || explained_by_drift;
  if (window_.size() > kMostSightings) window_.pop_front();
}

bool LoopClosing::has_parallax(const Revisit& revisit) const {
  const double range_m = (revisit.seen - revisit.seen_from).norm();
  return std::ranges::none_of(window_, [&](const Sighting& s) {
    return s.revisit.landmark == revisit.landmark &&
           !trundle::slam::has_parallax((revisit.seen_from - s.revisit.seen_from).norm(), range_m);
  });
}

void LoopClosing::add_rejected(const Revisit& revisit, const Submap& now) {
  if (!has_parallax(revisit)) return;
  const Matrix2 drift = drift_since(revisit.seen_in.frame, now.frame, revisit.seen).topLeftCorner<2, 2>();
  const Matrix2 errors = revisit.mapped_covariance + revisit.seen_covariance;
  const Eigen::LLT<Matrix2> all(drift + errors);
  const Vector2 residual = revisit.mapped - revisit.seen;
  const bool needs_drift = residual.dot(errors.ldlt().solve(residual)) > kDefaultGate;
  store(revisit,
        needs_drift && all.info() == Eigen::Success && residual.dot(all.solve(residual)) < kDefaultGate);
}

/// Where no drift worth the name has come about, it says nothing.
void LoopClosing::add_matched(const Revisit& revisit, const Submap& now) {
  const Matrix2 drift = drift_since(revisit.seen_in.frame, now.frame, revisit.seen).topLeftCorner<2, 2>();
  if (drift.trace() < revisit.seen_covariance.trace()) return;
  store(revisit, false);
  revisited_[revisit.landmark] = keyframe_;
}

void LoopClosing::still_matched(LandmarkId landmark) {
  if (const auto at = revisited_.find(landmark); at != revisited_.end()) at->second = keyframe_;
}

bool LoopClosing::is_closed() const {
  std::set<LandmarkId> back;
  for (const auto& landmark : revisited_) back.insert(landmark.first);
  for (const Sighting& s : window_) back.insert(s.revisit.landmark);
  const auto fit = static_cast<double>(revisited_.size());
  return revisited_.size() >= kLeastSupporting && fit >= kLeastShare * static_cast<double>(back.size());
}

std::optional<LoopCorrection> LoopClosing::close(const Submap& now) {
  if (!has_evidence()) return std::nullopt;
  std::vector<Revisit> revisits;
  for (const Sighting& s : window_)
    if (s.explained_by_drift) revisits.push_back(s.revisit);
  if (!is_enough(revisits)) return std::nullopt;
  Vector2 centre = Vector2::Zero();
  for (const Revisit& s : revisits) centre += s.seen / static_cast<double>(revisits.size());
  // The youngest: whatever is older stays where it is.
  const Submap old =
      std::ranges::max_element(revisits, {}, [](const Revisit& s) { return s.seen_in.keyframe; })->seen_in;
  const Matrix3 prior = drift_since(old.frame, now.frame, centre);
  if (Eigen::LLT<Matrix3>(prior).info() != Eigen::Success) return std::nullopt;
  const Consensus found = consensus_of(revisits, centre, prior);
  const auto agreed = static_cast<double>(found.revisits.size());
  if (agreed < kLeastShare * static_cast<double>(window_.size())) return std::nullopt;
  if (!is_enough(found.revisits) || !is_consistent(found, prior)) return std::nullopt;
  const auto supporting = static_cast<double>(supporting_landmarks(found.revisits));
  if (supporting < static_cast<double>(revisited_.size())) return std::nullopt;
  const std::optional<LoopCorrection> correction = LoopCorrection::between(old, now, found.move);
  if (correction) {
    window_.clear();
    revisited_.clear();
  }
  return correction;
}

}  // namespace trundle::slam
