#include "trundle/slam/association/joint_compatibility.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Dense>

#include "trundle/slam/association/association.hpp"
#include "trundle/statistics/distribution.hpp"

namespace trundle::slam {
namespace {

using Index = Eigen::Index;
using Eigen::Matrix2d;
using Eigen::Vector2d;

/// Depth-first over the observations, each with its pairings, the likely ones first, or none. The Cholesky
/// factor of the chosen innovations' covariance grows and shrinks with the path.
class BranchAndBound {
 public:
  BranchAndBound(const JointReadings& readings, const JointCompatibilityOptions& options)
      : readings_(readings), options_(options), choice_(readings.observations, JointExplanation::kNone) {
    const auto most = 2 * static_cast<Index>(std::min(readings.observations, readings.pairings.size()));
    L_ = Eigen::MatrixXd::Zero(most, most);
    whitened_ = Eigen::VectorXd::Zero(most);
    sort_choices();
  }

  std::vector<JointExplanation> run() {
    descend(0, 0, {});
    return std::move(found_);
  }

 private:
  static constexpr double kWorst = std::numeric_limits<double>::infinity();
  struct Sum {
    double cost = 0.0;
    double nis = 0.0;
  };

  static Index row(std::size_t pairing) { return 2 * static_cast<Index>(pairing); }

  static Sum cost_of(const Vector2d& nu, const Matrix2d& S) {
    const double nis = nu.dot(S.inverse() * nu);
    return {nis + cost_at_peak(S), nis};
  }

  /// Observations with few choices come first: what they say helps with the others.
  void sort_choices() {
    pairings_of_.resize(readings_.observations);
    std::vector<double> alone(readings_.pairings.size());
    for (std::size_t p = 0; p < alone.size(); ++p) {
      alone[p] =
          cost_of(readings_.innovation.segment<2>(row(p)), readings_.S.block<2, 2>(row(p), row(p))).cost;
      pairings_of_[readings_.pairings[p].observation].push_back(p);
    }
    for (auto& pairings : pairings_of_)
      std::ranges::sort(pairings, {}, [&](std::size_t p) { return std::pair(alone[p], p); });
    for (std::size_t i = 0; i < readings_.observations; ++i) order_.push_back(i);
    std::ranges::stable_sort(order_, {}, [&](std::size_t i) { return pairings_of_[i].size(); });
    to_come_.assign(readings_.observations + 1, 0.0);
    for (std::size_t depth = readings_.observations; depth-- > 0;) {
      const bool has_choice = !pairings_of_[order_[depth]].empty();
      to_come_[depth] =
          to_come_[depth + 1] + (has_choice ? std::min(options_.least, options_.none) : options_.none);
    }
  }

  void descend(std::size_t depth, std::size_t pairs, const Sum& sum) {
    if (++nodes_ > options_.most_nodes && !found_.empty()) return;
    if (sum.cost + to_come_[depth] >= limit()) return;
    if (depth == readings_.observations) return note(sum.cost);
    const std::size_t observation = order_[depth];
    for (const std::size_t p : pairings_of_[observation]) {
      if (is_taken(readings_.pairings[p].landmark)) continue;
      const Sum added = append(p, pairs);
      const Sum with{sum.cost + added.cost, sum.nis + added.nis};
      if (with.nis > options_.limit[std::min(pairs + 1, options_.limit.size() - 1)]) continue;
      choice_[observation] = static_cast<int>(p);
      chosen_.push_back(p);
      descend(depth + 1, pairs + 1, with);
      chosen_.pop_back();
      choice_[observation] = JointExplanation::kNone;
    }
    descend(depth + 1, pairs, {sum.cost + options_.none, sum.nis});
  }

  bool is_taken(std::size_t landmark) const {
    return std::ranges::any_of(chosen_,
                               [&](std::size_t p) { return readings_.pairings[p].landmark == landmark; });
  }

  /// Two more rows of the factor; what the innovation costs given those chosen before.
  Sum append(std::size_t p, std::size_t pairs) {
    const Index n = row(pairs);
    Eigen::Matrix<double, Eigen::Dynamic, 2> x(n, 2);
    for (std::size_t k = 0; k < pairs; ++k)
      x.middleRows<2>(row(k)) = readings_.S.block<2, 2>(row(chosen_[k]), row(p));
    const auto before = L_.topLeftCorner(n, n);
    before.triangularView<Eigen::Lower>().solveInPlace(x);
    const Matrix2d S = readings_.S.block<2, 2>(row(p), row(p)) - x.transpose() * x;
    const Vector2d nu = readings_.innovation.segment<2>(row(p)) - x.transpose() * whitened_.head(n);
    const Eigen::LLT<Matrix2d> factor(S);
    L_.block(n, 0, 2, n) = x.transpose();
    L_.block<2, 2>(n, n) = factor.matrixL();
    whitened_.segment<2>(n) = factor.matrixL().solve(nu);
    return cost_of(nu, S);
  }

  /// What costs as much is of no interest any more.
  double limit() const {
    if (found_.empty()) return kWorst;
    const double last = found_.size() < options_.most ? kWorst : found_.back().cost;
    return std::min(last, found_.front().cost + options_.within);
  }

  void note(double cost) {
    const auto at = std::ranges::upper_bound(found_, cost, {}, &JointExplanation::cost);
    found_.insert(at, {choice_, cost});
    while (found_.size() > options_.most || found_.back().cost > found_.front().cost + options_.within)
      found_.pop_back();
  }

  const JointReadings& readings_;
  const JointCompatibilityOptions& options_;
  std::vector<std::vector<std::size_t>> pairings_of_;
  std::vector<std::size_t> order_;
  std::vector<double> to_come_;  ///< at least, from each depth on
  std::vector<int> choice_;
  std::vector<std::size_t> chosen_;
  Eigen::MatrixXd L_;
  Eigen::VectorXd whitened_;
  std::vector<JointExplanation> found_;
  int nodes_ = 0;
};

}  // namespace

std::vector<double> joint_limits(double gate, std::size_t most) {
  std::vector<double> limits = {0.0};
  const double tail = chi_squared_tail(gate, 2.0);
  for (std::size_t k = 1; k <= most; ++k)
    limits.push_back(tail > 0.0 ? chi_squared_limit(tail, 2.0 * static_cast<double>(k))
                                : std::numeric_limits<double>::infinity());
  return limits;
}

// Eq. 21, 22.
std::vector<JointExplanation> most_probable_explanations(const JointReadings& readings,
                                                         const JointCompatibilityOptions& options) {
  return BranchAndBound(readings, options).run();
}

}  // namespace trundle::slam
