#include "trundle/slam/merging/shared_frame.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/LU>
#include <fmt/format.h>

#include "trundle/geometry/decompositions.hpp"
#include "trundle/geometry/rigid_motion.hpp"
#include "trundle/io/error.hpp"
#include "trundle/statistics/distribution.hpp"

namespace trundle::slam {
namespace {

using Index = Eigen::Index;

// Of each landmark so many baselines are tried, the longest: they determine a frame best, and a map of
// hundreds of landmarks takes a second.
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

/// χ² of matched landmarks, the frame being the best for them: all that errs in common is in the covariances.
struct JointFit {
  Pose2 b_from_a;
  double cost = std::numeric_limits<double>::infinity();
};

Eigen::MatrixXd covariance_of(const JointMap& map, const std::vector<std::size_t>& which) {
  std::vector<Index> rows;
  for (const std::size_t i : which) {
    rows.push_back(2 * static_cast<Index>(i));
    rows.push_back(2 * static_cast<Index>(i) + 1);
  }
  return map.covariance(rows, rows);
}

JointFit joint_fit(const JointMap& a, const JointMap& b, const std::vector<LandmarkMatch>& matches,
                   Pose2 b_from_a) {
  std::vector<std::size_t> of_a, of_b;
  for (const LandmarkMatch& match : matches) {
    of_a.push_back(match.a);
    of_b.push_back(match.b);
  }
  const Eigen::MatrixXd P_a = covariance_of(a, of_a), P_b = covariance_of(b, of_b);
  const Index n = P_a.rows();
  JointFit fit{b_from_a};
  for (int round = 0; round < kMostMergeRounds; ++round) {
    const Matrix2 R = rotation(b_from_a.heading);
    Eigen::MatrixXd C = P_b + kLeastMapVariance * Eigen::MatrixXd::Identity(n, n);
    Eigen::VectorXd e(n);
    Eigen::MatrixX3d J(n, 3);
    for (Index i = 0; i < n; i += 2) {
      const LandmarkMatch& match = matches[static_cast<std::size_t>(i / 2)];
      const Vector2 turned = R * a.positions[match.a];
      e.segment<2>(i) = turned + b_from_a.translation() - b.positions[match.b];
      J.block<2, 3>(i, 0) << 1.0, 0.0, -turned.y(), 0.0, 1.0, turned.x();
      for (Index k = 0; k < n; k += 2) C.block<2, 2>(i, k) += R * P_a.block<2, 2>(i, k) * R.transpose();
    }
    Eigen::MatrixXd right(n, 4);
    right << J, e;
    const Eigen::MatrixXd solved = solve_ldlt_columns(C, right);
    const Vector3 step = -inverse_of(J.transpose() * solved.leftCols<3>()) * (J.transpose() * solved.col(3));
    if (!step.allFinite()) return fit;
    fit = {b_from_a, e.dot(solved.col(3)) + step.dot(J.transpose() * solved.col(3))};
    b_from_a = {b_from_a.x + step.x(), b_from_a.y + step.y(), b_from_a.heading + step.z()};
    fit.b_from_a = b_from_a;
    if (step.norm() < 1e-9) break;
  }
  return fit;
}

/// Searches the frame of a map among the landmarks of another.
class FrameSearch {
 public:
  FrameSearch(const JointMap& a, const JointMap& b, const MergeOptions& options)
      : a_(a),
        b_(b),
        options_(options),
        gate_(chi_squared_limit(options.tail, 2.0)),
        gate_of_length_(chi_squared_limit(options.tail, 1.0)),
        log_area_(std::log(area_of(b))) {}

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
    if (!may_match(of_a.first, of_b.first) || !may_match(of_a.second, of_b.second)) return;
    const double off = of_a.length_m - of_b.length_m;
    if (off * off > gate_of_length_ * (of_a.variance + of_b.variance)) return;
    ++tried_;
    const auto frame =
        rigid_motion(std::array{PointPair{a_.positions[of_a.first], b_.positions[of_b.first]},
                                PointPair{a_.positions[of_a.second], b_.positions[of_b.second]}});
    if (!frame) return;
    SharedFrame shared{*frame, matches_at(*frame, of_a, of_b)};
    if (std::ranges::any_of(frames_,
                            [&](const SharedFrame& other) { return other.matches == shared.matches; }))
      return;
    if (refine(shared)) frames_.push_back(std::move(shared));
  }

  /// One to one, the nearest first; besides their own a frame of two points is as uncertain as those are, the
  /// more the farther away.
  std::vector<LandmarkMatch> matches_at(const Pose2& frame, const Baseline& of_a,
                                        const Baseline& of_b) const {
    std::vector<std::pair<double, LandmarkMatch>> near;
    const Matrix2 R = rotation(frame.heading);
    const Vector2 middle = 0.5 * (a_.positions[of_a.first] + a_.positions[of_a.second]);
    const double sideways = difference_covariance(a_, of_a.first, of_a.second).trace() +
                            difference_covariance(b_, of_b.first, of_b.second).trace();
    for (std::size_t i = 0; i < a_.positions.size(); ++i) {
      const double lever = (a_.positions[i] - middle).norm() / of_a.length_m;
      const double of_frame = sideways * (0.25 + lever * lever);
      for (std::size_t j = 0; j < b_.positions.size(); ++j) {
        if (!may_match(i, j)) continue;
        const Vector2 off = frame * a_.positions[i] - b_.positions[j];
        const Matrix2 C = R * difference_covariance(a_, i, of_a.first) * R.transpose() +
                          difference_covariance(b_, j, of_b.first) + of_frame * Matrix2::Identity();
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
      const JointFit fit = joint_fit(a_, b_, shared.matches, shared.b_from_a);
      const double freedom = 2.0 * static_cast<double>(shared.matches.size()) - 3.0;
      if (fit.cost <= chi_squared_limit(options_.tail, freedom)) {
        shared.b_from_a = fit.b_from_a;
        shared.log_likelihood = log_likelihood_of(shared, fit.cost);
        return true;
      }
      if (shared.matches.size() == 2) return false;
      drop_worst(shared);
    }
    return false;
  }

  void drop_worst(SharedFrame& shared) const {
    std::size_t worst = 0;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < shared.matches.size(); ++i) {
      std::vector<LandmarkMatch> others = shared.matches;
      others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
      const double cost = joint_fit(a_, b_, others, shared.b_from_a).cost;
      if (!(cost < least)) continue;
      least = cost;
      worst = i;
    }
    shared.matches.erase(shared.matches.begin() + static_cast<std::ptrdiff_t>(worst));
  }

  /// Of the landmarks beyond those that the frame takes, one and a half: each lies as near as it does, where
  /// by chance it would lie anywhere in the area.
  double log_likelihood_of(const SharedFrame& shared, double cost) const {
    double sum = -0.5 * cost;
    double per_landmark = 0.0;
    for (const LandmarkMatch& match : shared.matches) {
      const Matrix2 C = block_of(a_.covariance, match.a, match.a) +
                        block_of(b_.covariance, match.b, match.b) + kLeastMapVariance * Matrix2::Identity();
      per_landmark += log_area_ - std::log(2.0 * kPi) - 0.5 * std::log(C.determinant());
    }
    const double count = static_cast<double>(shared.matches.size());
    return sum + per_landmark * (count - 1.5) / count;
  }

  static bool is_another(const SharedFrame& one, const SharedFrame& other) {
    const auto common = std::ranges::count_if(one.matches, [&](const LandmarkMatch& match) {
      return std::ranges::find(other.matches, match) != other.matches.end();
    });
    return 2 * static_cast<std::size_t>(common) < std::min(one.matches.size(), other.matches.size());
  }

  const JointMap& a_;
  const JointMap& b_;
  MergeOptions options_;
  double gate_, gate_of_length_, log_area_;
  std::size_t tried_ = 0;
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
