#include "trundle/slam/smoothing/elimination_tree.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "trundle/slam/smoothing/elimination.hpp"
#include "trundle/slam/smoothing/nth.hpp"

namespace trundle::slam {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

// Of the largest information in a front, what is added to all where rounding has left less than nothing of
// the smallest, and how far that may go: readings that are a million times surer than the rest.
constexpr double kLeastRidge = 1e-15;
constexpr double kMostRidge = 1e-9;

}  // namespace

int EliminationTree::add_variable(std::span<const double> tolerance) {
  const int variable = variables();
  size_.push_back(static_cast<int>(tolerance.size()));
  offset_.push_back(static_cast<int>(delta_.size()));
  node_of_.push_back(-1);
  terms_of_.emplace_back();
  tolerance_.insert(tolerance_.end(), tolerance.begin(), tolerance.end());
  delta_.resize(tolerance_.size());
  handed_down_.resize(delta_.size());
  new_variables_.push_back(variable);
  return variable;
}

int EliminationTree::add_term(std::span<const int> variables) {
  const int term = static_cast<int>(variables_of_.size());
  variables_of_.emplace_back(variables.begin(), variables.end());
  for (const int variable : variables) terms_of_[nth(variable)].push_back(term);
  new_terms_.push_back(term);
  return term;
}

void EliminationTree::move(int variable, const Eigen::VectorXd& by) {
  for (int i = 0; i < size(variable); ++i) {
    handed_down_[nth(offset(variable) + i)] -= by[i];
    delta_[nth(offset(variable) + i)] -= by[i];
  }
  for (const int term : terms_of_[nth(variable)])
    touched_.insert(touched_.end(), variables_of_[nth(term)].begin(), variables_of_[nth(term)].end());
}

bool EliminationTree::update(std::span<const int> last, const Linearise& linearise) {
  for (const int term : new_terms_)
    touched_.insert(touched_.end(), variables_of_[nth(term)].begin(), variables_of_[nth(term)].end());
  touched_.insert(touched_.end(), last.begin(), last.end());
  const std::vector<int> made = make_nodes(take_affected(last), last.size());
  return std::ranges::all_of(made, [&](int n) {
    bool done = eliminate(node(n), linearise, 0.0);
    for (double ridge = kLeastRidge; !done && ridge <= kMostRidge; ridge *= 10.0)
      done = eliminate(node(n), linearise, ridge);
    return done;
  });
}

/// Those of the touched variables, and all above them.
std::vector<int> EliminationTree::take_touched_nodes() {
  std::vector<int> taken;
  is_taken_.resize(nodes_.size(), 0);
  for (const int variable : touched_)
    for (int n = node_of_[nth(variable)]; n >= 0 && is_taken_[nth(n)] == 0; n = node(n).parent) {
      is_taken_[nth(n)] = 1;
      taken.push_back(n);
    }
  touched_.clear();
  return taken;
}

EliminationTree::Affected EliminationTree::take_affected(std::span<const int> last) {
  Affected affected{std::exchange(new_variables_, {}), std::exchange(new_terms_, {}), {}};
  const std::vector<int> taken = take_touched_nodes();
  for (const int n : taken) {
    const Node& old = node(n);
    affected.variables.insert(affected.variables.end(), old.of_columns().begin(), old.of_columns().end());
    affected.terms.insert(affected.terms.end(), old.terms.begin(), old.terms.end());
    for (const int child : old.children)
      if (is_taken_[nth(child)] == 0) affected.orphans.push_back(child);
  }
  std::erase_if(roots_, [&](int root) { return is_taken_[nth(root)] != 0; });
  for (const int n : taken) {
    is_taken_[nth(n)] = 0;
    node(n) = {};
    free_.push_back(n);
  }
  // What comes last stands at the end; the rest in the order in which it came, whatever the tree was.
  std::erase_if(affected.variables, [&](int v) { return std::ranges::find(last, v) != last.end(); });
  std::ranges::sort(affected.variables);
  affected.variables.insert(affected.variables.end(), last.begin(), last.end());
  return affected;
}

int EliminationTree::new_node() {
  if (free_.empty()) {
    nodes_.emplace_back();
    return static_cast<int>(nodes_.size()) - 1;
  }
  const int n = free_.back();
  free_.pop_back();
  return n;
}

/// The fronts of an order of elimination of what is affected, children before parents; each with its terms
/// and with the orphans that go on to it.
std::vector<int> EliminationTree::make_nodes(const Affected& affected, std::size_t last) {
  BlockPattern pattern;
  pattern.last = static_cast<int>(last);
  place_.resize(size_.size());
  for (std::size_t i = 0; i < affected.variables.size(); ++i) {
    place_[nth(affected.variables[i])] = static_cast<int>(i);
    pattern.sizes.push_back(size(affected.variables[i]));
  }
  const auto couple = [&](std::span<const int> variables) {
    for (std::size_t i = 0; i < variables.size(); ++i)
      for (std::size_t j = 0; j < i; ++j)
        pattern.couplings.emplace_back(place_[nth(variables[i])], place_[nth(variables[j])]);
  };
  for (const int term : affected.terms) couple(variables_of_[nth(term)]);
  for (const int orphan : affected.orphans) couple(node(orphan).of_rows());

  std::vector<int> made;
  for (const Front& front : elimination_fronts(pattern)) {
    made.push_back(new_node());
    Node& fresh = node(made.back());
    for (const int block : front.blocks) fresh.variables.push_back(affected.variables[nth(block)]);
    fresh.column_variables = front.column_blocks;
    fresh.columns = front.columns;
    fresh.size = front.size;
    fresh.parent = front.parent;  // among those that are made; its node follows
    fresh.turn = eliminated_++;
    for (const int variable : fresh.of_columns()) node_of_[nth(variable)] = made.back();
  }
  for (const int n : made) {
    int& parent = node(n).parent;
    if (parent >= 0) {
      parent = made[nth(parent)];
      node(parent).children.push_back(n);
    } else {
      roots_.push_back(n);
    }
  }
  const auto first_eliminated = [&](std::span<const int> variables) {
    const int first = *std::ranges::min_element(
        variables, {}, [&](int variable) { return node(node_of_[nth(variable)]).turn; });
    return node_of_[nth(first)];
  };
  for (const int term : affected.terms)
    node(first_eliminated(variables_of_[nth(term)])).terms.push_back(term);
  for (const int orphan : affected.orphans) {
    node(orphan).parent = first_eliminated(node(orphan).of_rows());
    node(node(orphan).parent).children.push_back(orphan);
  }
  return made;
}

// [A11 · ; A21 A22] = [L1 0 ; L2 I] [I 0 ; 0 A22 − L2 L2ᵀ] [L1ᵀ L2ᵀ ; 0 I]: docs/theory/online-smoother.md,
// eq. 21.
bool EliminationTree::eliminate(Node& front, const Linearise& linearise, double ridge) {
  int begin = 0;
  for (const int variable : front.variables) {
    place_[nth(variable)] = begin;
    begin += size(variable);
  }
  matrix_.setZero(front.size, front.size);
  right_.setZero(front.size);
  FrontSystem system(matrix_, right_, place_);
  for (const int term : front.terms) linearise(term, system);
  for (const int child : front.children) add_update_of(node(child));

  Eigen::Ref<MatrixXd> A11 = matrix_.topLeftCorner(front.columns, front.columns);
  largest_ = std::max(largest_, A11.diagonal().maxCoeff());
  A11.diagonal().array() += ridge * largest_;
  const Eigen::LLT<Eigen::Ref<MatrixXd>> L1(A11);
  if (L1.info() != Eigen::Success) return false;
  auto y = right_.head(front.columns);
  A11.triangularView<Eigen::Lower>().solveInPlace(y);
  if (front.rows() > 0) {
    auto L2 = matrix_.bottomLeftCorner(front.rows(), front.columns);
    A11.triangularView<Eigen::Lower>().transpose().solveInPlace<Eigen::OnTheRight>(L2);
    auto A22 = matrix_.bottomRightCorner(front.rows(), front.rows());
    A22.selfadjointView<Eigen::Lower>().rankUpdate(L2, -1.0);
    front.update = A22;
    front.update_right = right_.tail(front.rows()) - L2 * y;
  }
  front.factor = matrix_.leftCols(front.columns);
  front.reduced = y;
  return true;
}

/// To the front at hand.
void EliminationTree::add_update_of(const Node& child) {
  std::vector<Index> row;
  for (const int variable : child.of_rows())
    for (int i = 0; i < size(variable); ++i) row.push_back(place_[nth(variable)] + i);
  for (std::size_t j = 0; j < row.size(); ++j) {
    right_[row[j]] += child.update_right[static_cast<Index>(j)];
    for (std::size_t i = j; i < row.size(); ++i)
      matrix_(std::max(row[i], row[j]), std::min(row[i], row[j])) +=
          child.update(static_cast<Index>(i), static_cast<Index>(j));
  }
}

const std::vector<int>& EliminationTree::solve(Solve which) {
  solved_.clear();
  has_moved_.resize(size_.size(), 0);
  std::vector<int> waiting = roots_;
  while (!waiting.empty()) {
    Node& front = node(waiting.back());
    waiting.pop_back();
    const auto has_moved = [&](int variable) { return has_moved_[nth(variable)] != 0; };
    if (which == Solve::what_matters && !front.is_new && std::ranges::none_of(front.of_rows(), has_moved))
      continue;
    solve_columns(front);
    for (const int variable : front.of_columns()) hand_down(variable);
    front.is_new = false;
    waiting.insert(waiting.end(), front.children.begin(), front.children.end());
  }
  for (const int variable : solved_) has_moved_[nth(variable)] = 0;
  return solved_;
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
    for (int k = 0; k < size(variable); ++k) delta_[nth(offset(variable) + k)] = x[i++];
}

void EliminationTree::hand_down(int variable) {
  solved_.push_back(variable);
  const int begin = offset(variable);
  bool matters = false;
  for (int i = begin; i < begin + size(variable); ++i)
    matters = matters || std::abs(delta_[nth(i)] - handed_down_[nth(i)]) > tolerance_[nth(i)];
  if (!matters) return;
  has_moved_[nth(variable)] = 1;
  std::copy_n(delta_.begin() + begin, size(variable), handed_down_.begin() + begin);
}

/// Those of variables and all above them, children before parents.
std::vector<int> EliminationTree::path_nodes(std::span<const Derivative> derivatives) const {
  std::vector<int> nodes;
  for (const Derivative& derivative : derivatives)
    for (int n = node_of_[nth(derivative.variable)]; n >= 0; n = node(n).parent) {
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
