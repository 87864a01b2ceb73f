// EliminationTree: what its factor says, from the root down.
#include <algorithm>
#include <cmath>

#include "trundle/slam/nth.hpp"
#include "trundle/slam/smoothing/solver/elimination_tree.hpp"

namespace trundle::slam {

using Eigen::Index;
using Eigen::MatrixXd;

const std::vector<int>& EliminationTree::solve(Solve which) {
  work_.solved.clear();
  work_.has_moved.resize(variables_.size(), 0);
  std::vector<int> waiting = roots_;
  while (!waiting.empty()) {
    Node& front = node(waiting.back());
    waiting.pop_back();
    const auto has_moved = [&](int variable) { return work_.has_moved[nth(variable)] != 0; };
    if (which == Solve::what_matters && !front.is_new && std::ranges::none_of(front.of_rows(), has_moved))
      continue;
    solve_columns(front);
    for (const int variable : front.of_columns()) hand_down(variable);
    front.is_new = false;
    waiting.insert(waiting.end(), front.children.begin(), front.children.end());
  }
  for (const int variable : work_.solved) work_.has_moved[nth(variable)] = 0;
  return work_.solved;
}

/// L1ᵀ x1 = y − L2ᵀ x2.
void EliminationTree::solve_columns(const Node& front) {
  Eigen::VectorXd above(front.rows());
  Index i = 0;
  for (const int variable : front.of_rows()) {
    above.segment(i, size(variable)) = solution(variable);
    i += size(variable);
  }
  Eigen::VectorXd x = front.reduced;
  x.noalias() -= front.factor.bottomRows(front.rows()).transpose() * above;
  front.factor.topRows(front.columns).triangularView<Eigen::Lower>().transpose().solveInPlace(x);
  i = 0;
  for (const int variable : front.of_columns())
    for (int k = 0; k < size(variable); ++k) numbers_.delta[nth(offset(variable) + k)] = x[i++];
}

void EliminationTree::hand_down(int variable) {
  work_.solved.push_back(variable);
  const int begin = offset(variable);
  bool matters = false;
  for (int i = begin; i < begin + size(variable); ++i)
    matters = matters ||
              std::abs(numbers_.delta[nth(i)] - numbers_.handed_down[nth(i)]) > numbers_.tolerance[nth(i)];
  if (!matters) return;
  work_.has_moved[nth(variable)] = 1;
  std::copy_n(numbers_.delta.begin() + begin, size(variable), numbers_.handed_down.begin() + begin);
}

/// Those of variables and all above them, children before parents.
std::vector<int> EliminationTree::path_nodes(std::span<const Derivative> derivatives) const {
  std::vector<int> nodes;
  for (const Derivative& derivative : derivatives)
    for (int n = variables_[nth(derivative.variable)].node; n >= 0; n = node(n).parent) {
      if (std::ranges::find(nodes, n) != nodes.end()) break;
      nodes.push_back(n);
    }
  std::ranges::sort(nodes, {}, [&](int n) { return node(n).turn; });
  return nodes;
}

// Eq. 22.
MatrixXd EliminationTree::projected_covariance(std::span<const Derivative> derivatives, Index numbers) const {
  const std::vector<int> nodes = path_nodes(derivatives);
  std::vector<std::pair<int, Index>> begins;  // of variables among the rows of X
  Index total = 0;
  for (const int n : nodes)
    for (const int variable : node(n).of_columns()) {
      begins.emplace_back(variable, total);
      total += size(variable);
    }
  std::ranges::sort(begins);
  const auto begin = [&](int variable) {
    return std::ranges::lower_bound(begins, variable, {}, &std::pair<int, Index>::first)->second;
  };
  MatrixXd X = MatrixXd::Zero(total, numbers);
  for (const Derivative& d : derivatives)
    X.block(begin(d.variable), d.column, d.transposed.rows(), d.transposed.cols()) += d.transposed;
  for (const int n : nodes) {
    const Node& front = node(n);
    auto Y = X.middleRows(begin(front.variables.front()), front.columns);
    front.factor.topRows(front.columns).triangularView<Eigen::Lower>().solveInPlace(Y);
    Index row = front.columns;
    for (const int variable : front.of_rows()) {
      X.middleRows(begin(variable), size(variable)).noalias() -=
          front.factor.middleRows(row, size(variable)) * Y;
      row += size(variable);
    }
  }
  return X.transpose() * X;
}

}  // namespace trundle::slam
