#include "trundle/slam/merging/merge.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "trundle/geometry/decompositions.hpp"
#include "trundle/geometry/squared.hpp"
#include "trundle/io/error.hpp"
#include "trundle/io/interruption.hpp"
#include "trundle/slam/merging/shared_frame.hpp"

namespace trundle::slam {
namespace {

using Index = Eigen::Index;

constexpr double kLeastMetreVariance = 1e-12;  // no sensor's ranges are known better than to a millionth

/// The maps that are placed, about one set of landmarks: of all but the first frames and metres, the latter
/// where a metre is uncertain at all, then positions.
class JointMerge {
 public:
  JointMerge(std::span<const JointMap> maps, const std::vector<std::size_t>& placed, MergedMap& merged)
      : maps_(maps), placed_(placed), merged_(merged) {
    for (const std::size_t k : placed) {
      const Index n = maps[k].covariance.rows();
      weights_.push_back(
          inverse_of(maps[k].covariance + kLeastMapVariance * Eigen::MatrixXd::Identity(n, n)));
    }
    const auto others = static_cast<Index>(placed.size()) - 1;
    metres_at_ = positions_at_ = 3 * others;
    if (std::ranges::none_of(placed, [&](std::size_t k) { return maps[k].metre_sigma > 0.0; })) return;
    positions_at_ += others;
    Eigen::MatrixXd C = Eigen::MatrixXd::Constant(others, others, squared(maps[placed.front()].metre_sigma));
    for (Index i = 0; i < others; ++i)
      C(i, i) += squared(maps[placed[static_cast<std::size_t>(i) + 1]].metre_sigma) + kLeastMetreVariance;
    metre_information_ = inverse_of(C);
  }

  void run() {
    const Index n = positions_at_ + 2 * static_cast<Index>(merged_.map.positions.size());
    Eigen::MatrixXd A;
    for (int round = 0; round < kMostMergeRounds; ++round) {
      check_interruption();
      A = Eigen::MatrixXd::Zero(n, n);
      Eigen::VectorXd g = Eigen::VectorXd::Zero(n);
      merged_.cost = 0.0;
      for (std::size_t p = 0; p < placed_.size(); ++p) add(p, A, g);
      add_metres(A, g);
      const Eigen::VectorXd step = -solve_ldlt(A, g);
      move(step);
      if (step.norm() < 1e-10) break;
    }
    const Eigen::MatrixXd covariance = inverse_of(A);
    const Eigen::MatrixXd of_map = covariance.bottomRightCorner(n - positions_at_, n - positions_at_);
    merged_.map.covariance = 0.5 * (of_map + of_map.transpose());
    merged_.degrees_of_freedom = static_cast<int>(metre_information_.rows() - n);
    for (std::size_t p = 0; p < placed_.size(); ++p) {
      const auto at = frame_column(p);
      merged_.frame_covariance[placed_[p]] =
          p == 0 ? Matrix3::Zero() : Matrix3(covariance.block<3, 3>(at, at));
      if (has_metre(p))
        merged_.metre_sigma[placed_[p]] = std::sqrt(covariance(metre_column(p), metre_column(p)));
      merged_.degrees_of_freedom += 2 * static_cast<int>(maps_[placed_[p]].positions.size());
    }
  }

 private:
  /// Of the frame of the p-th that was placed; the first one's is no unknown.
  static Index frame_column(std::size_t p) { return 3 * (static_cast<Index>(p) - 1); }
  Index metre_column(std::size_t p) const { return metres_at_ + static_cast<Index>(p) - 1; }
  /// Whether that of the p-th beside the first one's is an unknown.
  bool has_metre(std::size_t p) const { return p > 0 && positions_at_ > metres_at_; }

  /// e = (1 + s) T⁻¹ m − x of each of its landmarks.
  void add(std::size_t p, Eigen::MatrixXd& A, Eigen::VectorXd& g) {
    const std::size_t k = placed_[p];
    const JointMap& map = maps_[k];
    const Pose2& frame = merged_.first_from_map[k];
    const Matrix2 to_map = (1.0 + merged_.metre[k]) * rotation(-frame.heading);
    const Index rows = map.covariance.rows();
    Eigen::VectorXd e(rows);
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(rows, A.cols());
    for (std::size_t i = 0; i < map.positions.size(); ++i) {
      const auto row = 2 * static_cast<Index>(i);
      const std::size_t number = merged_.landmark_of[k][i];
      const Vector2 in_map = to_map * (merged_.map.positions[number] - frame.translation());
      e.segment<2>(row) = in_map - map.positions[i];
      J.block<2, 2>(row, positions_at_ + 2 * static_cast<Index>(number)) = to_map;
      if (p == 0) continue;
      J.block<2, 2>(row, frame_column(p)) = -to_map;
      J.block<2, 1>(row, frame_column(p) + 2) = Vector2(in_map.y(), -in_map.x());
      if (has_metre(p)) J.block<2, 1>(row, metre_column(p)) = in_map / (1.0 + merged_.metre[k]);
    }
    const Eigen::MatrixXd W_J = weights_[p] * J;
    A += J.transpose() * W_J;
    g += W_J.transpose() * e;
    merged_.cost += e.dot(weights_[p] * e);
  }

  /// What is known of the metres of all but the first beside its own.
  void add_metres(Eigen::MatrixXd& A, Eigen::VectorXd& g) {
    const Index others = metre_information_.rows();
    Eigen::VectorXd s(others);
    for (Index i = 0; i < others; ++i) s[i] = merged_.metre[placed_[static_cast<std::size_t>(i) + 1]];
    A.block(metres_at_, metres_at_, others, others) += metre_information_;
    g.segment(metres_at_, others) += metre_information_ * s;
    merged_.cost += s.dot(metre_information_ * s);
  }

  void move(const Eigen::VectorXd& step) {
    for (std::size_t p = 1; p < placed_.size(); ++p) {
      const Vector3 by = step.segment<3>(frame_column(p));
      Pose2& frame = merged_.first_from_map[placed_[p]];
      frame = {frame.x + by.x(), frame.y + by.y(), frame.heading + by.z()};
      if (has_metre(p)) merged_.metre[placed_[p]] += step[metre_column(p)];
    }
    for (std::size_t i = 0; i < merged_.map.positions.size(); ++i)
      merged_.map.positions[i] += step.segment<2>(positions_at_ + 2 * static_cast<Index>(i));
  }

  std::span<const JointMap> maps_;
  const std::vector<std::size_t>& placed_;  ///< in the order in which they were
  MergedMap& merged_;
  std::vector<Eigen::MatrixXd> weights_;  ///< in that order
  Index metres_at_ = 0, positions_at_ = 0;
  Eigen::MatrixXd metre_information_;
};

/// Its metre beside that of the first one.
JointMap beside(const JointMap& first, JointMap map) {
  map.metre_sigma = std::hypot(first.metre_sigma, map.metre_sigma);
  return map;
}

/// Names of the merged map: those that maps give; one that two landmarks have is the first one's, the others
/// get that of their map before it.
std::string free_name(const std::vector<std::string>& taken, const std::string& name, std::size_t map) {
  std::string free = name;
  for (int n = 0; std::ranges::find(taken, free) != taken.end(); ++n)
    free = n == 0 ? fmt::format("{}/{}", map + 1, name) : fmt::format("{}/{}/{}", map + 1, name, n);
  return free;
}

/// Adds a map's landmarks: matched ones are there already.
void append(const JointMap& map, std::size_t k, const Pose2& frame, const std::vector<LandmarkMatch>& matches,
            MergedMap& merged) {
  merged.first_from_map[k] = frame;
  std::vector<std::size_t>& numbers = merged.landmark_of[k];
  for (std::size_t i = 0; i < map.positions.size(); ++i) {
    const auto match = std::ranges::find(matches, i, &LandmarkMatch::a);
    if (match != matches.end()) {
      numbers.push_back(match->b);
      continue;
    }
    numbers.push_back(merged.map.positions.size());
    merged.map.positions.push_back(frame * map.positions[i]);
    merged.map.names.push_back(free_name(merged.map.names, map.names[i], k));
  }
}

}  // namespace

MergedMap merge_maps(std::span<const JointMap> maps, const MergeOptions& options) {
  MergedMap merged{.map = {.from = maps.front().from, .metre_sigma = maps.front().metre_sigma}};
  merged.first_from_map.resize(maps.size());
  merged.frame_covariance.resize(maps.size());
  merged.metre.resize(maps.size());
  merged.metre_sigma.resize(maps.size());
  merged.landmark_of.resize(maps.size());
  std::vector<std::size_t> placed = {0}, left;
  for (std::size_t k = 1; k < maps.size(); ++k) left.push_back(k);
  append(maps[0], 0, {}, {}, merged);
  JointMerge(maps, placed, merged).run();
  while (!left.empty()) {
    std::optional<std::pair<std::size_t, SharedFrame>> best;
    std::optional<CannotAnswer> why;
    for (const std::size_t k : left) try {
        SharedFrame frame = frame_between(beside(maps[0], maps[k]), merged.map, options);
        if (!best || frame.log_likelihood > best->second.log_likelihood) best = {k, std::move(frame)};
      } catch (const CannotAnswer& error) {
        if (!why) why = error;
      }
    if (!best) throw CannotAnswer(*why);
    const auto& [k, frame] = *best;
    append(maps[k], k, frame.b_from_a, frame.matches, merged);
    merged.map.from += ", " + maps[k].from;
    placed.push_back(k);
    std::erase(left, k);
    JointMerge(maps, placed, merged).run();
  }
  return merged;
}

}  // namespace trundle::slam
