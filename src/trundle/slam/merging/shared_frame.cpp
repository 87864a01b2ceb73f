#include "trundle/slam/merging/shared_frame.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numeric>

#include <Eigen/LU>
#include <fmt/format.h>

#include "trundle/geometry/decompositions.hpp"
#include "trundle/geometry/rigid_motion.hpp"
#include "trundle/geometry/squared.hpp"
#include "trundle/io/error.hpp"
#include "trundle/io/interruption.hpp"
#include "trundle/slam/merging/joint_fit.hpp"
#include "trundle/statistics/distribution.hpp"

namespace trundle::slam {
namespace {

using Index = Eigen::Index;

// Of each landmark so many baselines are tried, the longest: they determine a frame best, and a map of
// hundreds of landmarks takes a second; where metres are uncertain lengths tell less, and it takes minutes.
constexpr std::size_t kMostBaselines = 12;

Matrix2 block_of(const Eigen::MatrixXd& covariance, std::size_t i, std::size_t j) {
  return covariance.block<2, 2>(2 * static_cast<Index>(i), 2 * static_cast<Index>(j));
}

/// Of the difference of two landmarks of a map.
Matrix2 difference_covariance(const JointMap& map, std::size_t i, std::size_t j) {
  return block_of(map.covariance, i, i) + block_of(map.covariance, j, j) - block_of(map.covariance, i, j) -
         block_of(map.covariance, j, i) + 2.0 * kLeastMapVariance * Matrix2::Identity();
}

/// Between two landmarks of a map.
struct Baseline {
  std::size_t first = 0;
  std::size_t second = 0;
  double length_m = 0.0;
  double variance = 0.0;
};

Baseline baseline_of(const JointMap& map, std::size_t i, std::size_t j) {
  const Vector2 d = map.positions[j] - map.positions[i];
  const double length = d.norm();
  if (length == 0.0) return {i, j};
  const Vector2 along = d / length;
  return {i, j, length, along.dot(difference_covariance(map, i, j) * along)};
}

/// Of each landmark the longest.
std::vector<Baseline> long_baselines(const JointMap& map) {
  std::vector<Baseline> all;
  for (std::size_t i = 0; i < map.positions.size(); ++i) {
    std::vector<Baseline> own;
    for (std::size_t j = 0; j < map.positions.size(); ++j)
      if (j != i) own.push_back(baseline_of(map, i, j));
    std::ranges::sort(own, std::greater<>(), &Baseline::length_m);
    own.resize(std::min(own.size(), kMostBaselines));
    for (const Baseline& baseline : own) {
      const bool is_there = std::ranges::any_of(all, [&](const Baseline& other) {
        return other.first == baseline.second && other.second == baseline.first;
      });
      if (!is_there && baseline.length_m > 0.0) all.push_back(baseline);
    }
  }
  return all;
}

std::vector<Baseline> all_baselines(const JointMap& map) {
  std::vector<Baseline> all;
  for (std::size_t i = 0; i < map.positions.size(); ++i)
    for (std::size_t j = 0; j < map.positions.size(); ++j)
      if (j != i) all.push_back(baseline_of(map, i, j));
  std::ranges::sort(all, {}, &Baseline::length_m);
  return all;
}

/// The area that a map's landmarks take [m²]; no side of it is less than a millimetre.
double area_of(const JointMap& map) {
  Vector2 low = map.positions.front(), high = low;
  for (const Vector2& position : map.positions) {
    low = low.cwiseMin(position);
    high = high.cwiseMax(position);
  }
  const Vector2 size = (high - low).cwiseMax(Vector2::Constant(1e-3));
  return size.x() * size.y();
}

/// With what its metre is off by, about the frame's origin: wherever, for the frame is free.
JointMap with_metre(JointMap map) {
  const Eigen::VectorXd off =
      map.metre_sigma *
      Eigen::Map<const Eigen::VectorXd>(map.positions.front().data(), 2 * std::ssize(map.positions));
  map.covariance += off * off.transpose();
  return map;
}

/// By what share lengths of one map are to be longer to be those of another, and the variance of that.
struct Lengthening {
  double share = 0.0, variance = 0.0;
};

/// Searches the frame of a map among the landmarks of another.
class FrameSearch {
 public:
  FrameSearch(const JointMap& a, const JointMap& b, const MergeOptions& options)
      : own_(a),
        a_(with_metre(a)),
        b_(b),
        options_(options),
        gate_(chi_squared_limit(options.tail, 2.0)),
        gate_of_length_(chi_squared_limit(options.tail, 1.0)),
        log_area_(std::log(area_of(b))),
        from_left_(b.positions.size()) {
    std::iota(from_left_.begin(), from_left_.end(), std::size_t{0});
    std::ranges::sort(from_left_, {}, [&](std::size_t j) { return b.positions[j].x(); });
  }

  /// The best, and then the best of those that share less than half of its matches.
  std::vector<SharedFrame> run() {
    const std::vector<Baseline> of_b = all_baselines(b_);
    double most_variance = 0.0;
    for (const Baseline& baseline : of_b) most_variance = std::max(most_variance, baseline.variance);
    for (const Baseline& baseline : long_baselines(a_)) {
      const double reach_m = std::sqrt(gate_of_length_ * (baseline.variance + most_variance));
      const auto from = std::ranges::lower_bound(of_b, baseline.length_m - reach_m, {}, &Baseline::length_m);
      for (auto at = from; at != of_b.end() && at->length_m <= baseline.length_m + reach_m; ++at)
        try_frame(baseline, *at);
    }
    std::ranges::sort(frames_, std::greater<>(), &SharedFrame::log_likelihood);
    std::vector<SharedFrame> best;
    for (const SharedFrame& frame : frames_)
      if (best.empty() || (best.size() == 1 && is_another(frame, best.front()))) best.push_back(frame);
    return best;
  }

  /// log of how many frames were tried: one of so many fits as well by chance.
  double log_tried() const { return std::log(std::max<double>(1.0, static_cast<double>(tried_))); }

 private:
  bool may_match(std::size_t i, std::size_t j) const {
    return options_.unknown_ids || a_.names[i] == b_.names[j];
  }

  void try_frame(const Baseline& of_a, const Baseline& of_b) {
    check_interruption();
    if (!may_match(of_a.first, of_b.first) || !may_match(of_a.second, of_b.second)) return;
    const double off = of_a.length_m - of_b.length_m;
    if (off * off > gate_of_length_ * (of_a.variance + of_b.variance)) return;
    ++tried_;
    const Lengthening stretch = stretch_by(of_a, of_b);
    const double longer = 1.0 + stretch.share;
    const auto frame =
        rigid_motion(std::array{PointPair{longer * a_.positions[of_a.first], b_.positions[of_b.first]},
                                PointPair{longer * a_.positions[of_a.second], b_.positions[of_b.second]}});
    if (!frame) return;
    SharedFrame shared{*frame, matches_at(*frame, stretch, of_a, of_b)};
    if (std::ranges::any_of(frames_,
                            [&](const SharedFrame& other) { return other.matches == shared.matches; }))
      return;
    if (most_of(shared) < best_ + std::log(options_.tail) || !refine(shared)) return;
    best_ = std::max(best_, shared.log_likelihood);
    frames_.push_back(std::move(shared));
  }

  /// No subset of its matches explains more. What is less likely than the best by the odds that are asked for
  /// decides nothing.
  double most_of(const SharedFrame& shared) const {
    double sum = 0.0;
    for (const LandmarkMatch& match : shared.matches) sum += std::max(0.0, log_evidence(match));
    return sum * share_beyond_frame(shared.matches.size());
  }

  /// As two lengths say that are the same, beside what is known of the metres. docs/theory/merge.md, eq. 30a.
  Lengthening stretch_by(const Baseline& of_a, const Baseline& of_b) const {
    const double by_metre = squared(a_.metre_sigma * of_a.length_m);
    const double gain = by_metre / (of_a.variance + of_b.variance);
    return {gain * (of_b.length_m / of_a.length_m - 1.0), (1.0 - gain) * squared(a_.metre_sigma)};
  }

  /// One to one, the nearest first; besides their own a frame of two points is as uncertain as those are, the
  /// more the farther away.
  std::vector<LandmarkMatch> matches_at(const Pose2& frame, const Lengthening& stretch, const Baseline& of_a,
                                        const Baseline& of_b) const {
    std::vector<std::pair<double, LandmarkMatch>> near;
    const Matrix2 R = rotation(frame.heading);
    const Vector2 middle = 0.5 * (a_.positions[of_a.first] + a_.positions[of_a.second]);
    const double sideways = difference_covariance(own_, of_a.first, of_a.second).trace() +
                            difference_covariance(b_, of_b.first, of_b.second).trace();
    double widest_of_b = 0.0;
    for (std::size_t j = 0; j < b_.positions.size(); ++j)
      widest_of_b = std::max(widest_of_b, difference_covariance(b_, j, of_b.first).trace());
    for (std::size_t i = 0; i < a_.positions.size(); ++i) {
      const double lever = (a_.positions[i] - middle).norm() / of_a.length_m;
      const double of_frame = sideways * (0.25 + lever * lever);
      const Vector2 from_first = a_.positions[i] - a_.positions[of_a.first];
      const Matrix2 P =
          difference_covariance(own_, i, of_a.first) + stretch.variance * from_first * from_first.transpose();
      const Vector2 laid = frame * ((1.0 + stretch.share) * a_.positions[i]);
      const double reach_m = std::sqrt(gate_ * (P.trace() + widest_of_b + of_frame));
      const auto x_of = [&](std::size_t j) { return b_.positions[j].x(); };
      for (auto at = std::ranges::lower_bound(from_left_, laid.x() - reach_m, {}, x_of);
           at != from_left_.end() && x_of(*at) <= laid.x() + reach_m; ++at) {
        const std::size_t j = *at;
        if (!may_match(i, j)) continue;
        const Vector2 off = laid - b_.positions[j];
        const Matrix2 C =
            R * P * R.transpose() + difference_covariance(b_, j, of_b.first) + of_frame * Matrix2::Identity();
        const double squared = off.dot(C.inverse() * off);
        if (squared <= gate_) near.push_back({squared, {i, j}});
      }
    }
    std::ranges::sort(near, {}, [](const auto& one) { return one.first; });
    std::vector<LandmarkMatch> matches;
    for (const auto& one : near) {
      const LandmarkMatch& match = one.second;
      if (std::ranges::none_of(matches,
                               [&](const LandmarkMatch& m) { return m.a == match.a || m.b == match.b; }))
        matches.push_back(match);
    }
    std::ranges::sort(matches, {}, &LandmarkMatch::a);
    return matches;
  }

  /// By all its matches, without those that keep them from fitting together.
  bool refine(SharedFrame& shared) const {
    while (shared.matches.size() >= 2) {
      check_interruption();
      const JointFit fit = joint_fit(a_, b_, shared.matches, shared.b_from_a);
      const double freedom = 2.0 * static_cast<double>(shared.matches.size()) - 3.0;
      if (fit.cost <= chi_squared_limit(options_.tail, freedom)) {
        shared.b_from_a = fit.b_from_a;
        shared.log_likelihood = log_likelihood_of(shared, fit.cost);
        return true;
      }
      if (shared.matches.size() == 2) return false;
      const std::size_t worst = worst_of(matched(a_, b_, shared.matches, fit.b_from_a));
      shared.matches.erase(shared.matches.begin() + static_cast<std::ptrdiff_t>(worst));
    }
    return false;
  }

  /// Of the landmarks beyond those that the frame takes, one and a half, and half a one a metre: each lies as
  /// near as it does, where by chance it would lie anywhere in the area.
  double log_likelihood_of(const SharedFrame& shared, double cost) const {
    double sum = 0.0;
    for (const LandmarkMatch& match : shared.matches) sum += log_evidence(match);
    return -0.5 * cost + sum * share_beyond_frame(shared.matches.size());
  }

  double log_evidence(const LandmarkMatch& match) const {
    const Matrix2 C = block_of(own_.covariance, match.a, match.a) +
                      block_of(b_.covariance, match.b, match.b) + kLeastMapVariance * Matrix2::Identity();
    return log_area_ - std::log(2.0 * kPi) - 0.5 * std::log(C.determinant());
  }

  double share_beyond_frame(std::size_t matches) const {
    const double taken = a_.metre_sigma > 0.0 ? 2.0 : 1.5;
    return std::max(0.0, 1.0 - taken / static_cast<double>(matches));
  }

  static bool is_another(const SharedFrame& one, const SharedFrame& other) {
    const auto common = std::ranges::count_if(one.matches, [&](const LandmarkMatch& match) {
      return std::ranges::find(other.matches, match) != other.matches.end();
    });
    return 2 * static_cast<std::size_t>(common) < std::min(one.matches.size(), other.matches.size());
  }

  const JointMap& own_;  ///< a in its own metre
  JointMap a_;
  const JointMap& b_;
  MergeOptions options_;
  double gate_, gate_of_length_, log_area_;
  std::vector<std::size_t> from_left_;  ///< landmarks of b
  std::size_t tried_ = 0;
  double best_ = -std::numeric_limits<double>::infinity();  ///< log likelihood of those in frames_
  std::vector<SharedFrame> frames_;
};

/// Names that both maps have.
std::size_t shared_names(const JointMap& a, const JointMap& b) {
  return static_cast<std::size_t>(std::ranges::count_if(
      a.names, [&](const std::string& name) { return std::ranges::find(b.names, name) != b.names.end(); }));
}

}  // namespace

SharedFrame frame_between(const JointMap& a, const JointMap& b, const MergeOptions& options) {
  FrameSearch search(a, b, options);
  const std::vector<SharedFrame> found = search.run();
  const double sure = -std::log(options.tail);
  if (found.empty())
    throw CannotAnswer(
        fmt::format("{}: no overlap with {}: no two landmarks lie in both alike", a.from, b.from));
  const SharedFrame& best = found.front();
  if (options.unknown_ids && best.log_likelihood < sure + search.log_tried())
    throw CannotAnswer(
        fmt::format("{}: no overlap with {}: {} landmarks lie alike in both, no more than by chance", a.from,
                    b.from, best.matches.size()));
  const std::size_t shared = options.unknown_ids ? 0 : shared_names(a, b);
  if (2 * best.matches.size() < shared)
    throw CannotAnswer(
        fmt::format("{}: contradicts {}: of {} landmarks of the same names {} lie alike in both: names that "
                    "are wrong, or "
                    "covariances that do not know of an error all distances have in common; calibrate the "
                    "landmark sensors",
                    a.from, b.from, shared, best.matches.size()));
  if (found.size() > 1 && best.log_likelihood - found[1].log_likelihood < sure)
    throw CannotAnswer(
        fmt::format("{}: ambiguous: {} landmarks lie as in {}, and {} others as well elsewhere in it", a.from,
                    best.matches.size(), b.from, found[1].matches.size()));
  return best;
}

}  // namespace trundle::slam
