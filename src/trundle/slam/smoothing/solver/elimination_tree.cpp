#include "trundle/slam/smoothing/solver/elimination_tree.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <set>

#include "trundle/geometry/decompositions.hpp"
#include "trundle/slam/nth.hpp"
#include "trundle/slam/smoothing/solver/elimination.hpp"

namespace trundle::slam {

using Eigen::Index;

int EliminationTree::add_variable(std::span<const double> tolerance) {
  const int size = static_cast<int>(tolerance.size());
  int variable = variables();
  if (std::vector<int>& unused = unused_.variables[size]; !unused.empty()) {
    variable = unused.back();
    unused.pop_back();
    variables_[nth(variable)] = {.size = size, .offset = offset(variable), .terms = {}};
    std::ranges::copy(tolerance, numbers_.tolerance.begin() + offset(variable));
  } else {
    variables_.push_back({.size = size, .offset = static_cast<int>(numbers_.delta.size()), .terms = {}});
    numbers_.tolerance.insert(numbers_.tolerance.end(), tolerance.begin(), tolerance.end());
    numbers_.delta.resize(numbers_.tolerance.size());
    numbers_.handed_down.resize(numbers_.tolerance.size());
  }
  changes_.variables.push_back(variable);
  return variable;
}

int EliminationTree::add_term(std::span<const int> variables) {
  int term = static_cast<int>(variables_of_.size());
  if (unused_.terms.empty()) {
    variables_of_.emplace_back(variables.begin(), variables.end());
  } else {
    term = unused_.terms.back();
    unused_.terms.pop_back();
    variables_of_[nth(term)].assign(variables.begin(), variables.end());
  }
  for (const int variable : variables) variables_[nth(variable)].terms.push_back(term);
  changes_.terms.push_back(term);
  return term;
}

void EliminationTree::remove_term(int term) {
  std::vector<int>& variables = variables_of_[nth(term)];
  for (const int variable : variables) std::erase(variables_[nth(variable)].terms, term);
  changes_.touched.insert(changes_.touched.end(), variables.begin(), variables.end());
  changes_.removed_terms.push_back(term);
  variables.clear();
}

void EliminationTree::remove_variable(int variable) {
  assert(variables_[nth(variable)].terms.empty());
  variables_[nth(variable)].is_removed = true;
  changes_.touched.push_back(variable);
  changes_.removed_variables.push_back(variable);
  for (int i = offset(variable); i < offset(variable) + size(variable); ++i)
    numbers_.delta[nth(i)] = numbers_.handed_down[nth(i)] = 0.0;
}

EliminationTree::Sum EliminationTree::take_out(std::span<const int> variables, const Linearise& linearise) {
  std::set<int> terms, others;
  for (const int variable : variables)
    terms.insert(variables_[nth(variable)].terms.begin(), variables_[nth(variable)].terms.end());
  for (const int term : terms)
    others.insert(variables_of_[nth(term)].begin(), variables_of_[nth(term)].end());
  for (const int variable : variables) others.erase(variable);
  Node all;
  all.terms.assign(terms.begin(), terms.end());
  all.variables.assign(variables.begin(), variables.end());
  all.variables.insert(all.variables.end(), others.begin(), others.end());
  for (const int variable : all.variables) all.size += size(variable);
  work_.place.resize(variables_.size());
  add_terms(all, linearise);
  for (const int term : terms) remove_term(term);
  for (const int variable : variables) remove_variable(variable);
  return {std::move(all.terms), std::move(all.variables), work_.matrix.selfadjointView<Eigen::Lower>(),
          work_.right};
}

void EliminationTree::move(int variable, const Eigen::VectorXd& by) {
  for (int i = 0; i < size(variable); ++i) {
    numbers_.handed_down[nth(offset(variable) + i)] -= by[i];
    numbers_.delta[nth(offset(variable) + i)] -= by[i];
  }
  for (const int term : variables_[nth(variable)].terms)
    changes_.touched.insert(changes_.touched.end(), variables_of_[nth(term)].begin(),
                            variables_of_[nth(term)].end());
}

bool EliminationTree::update(std::span<const int> last, const Linearise& linearise) {
  for (const int term : changes_.terms)
    changes_.touched.insert(changes_.touched.end(), variables_of_[nth(term)].begin(),
                            variables_of_[nth(term)].end());
  changes_.touched.insert(changes_.touched.end(), last.begin(), last.end());
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
  work_.is_taken.resize(nodes_.size(), 0);
  for (const int variable : changes_.touched)
    for (int n = variables_[nth(variable)].node; n >= 0 && work_.is_taken[nth(n)] == 0; n = node(n).parent) {
      work_.is_taken[nth(n)] = 1;
      taken.push_back(n);
    }
  changes_.touched.clear();
  return taken;
}

EliminationTree::Affected EliminationTree::take_affected(std::span<const int> last) {
  Affected affected{std::exchange(changes_.variables, {}), std::exchange(changes_.terms, {}), {}};
  const std::vector<int> taken = take_touched_nodes();
  for (const int n : taken) {
    const Node& old = node(n);
    affected.variables.insert(affected.variables.end(), old.of_columns().begin(), old.of_columns().end());
    affected.terms.insert(affected.terms.end(), old.terms.begin(), old.terms.end());
    for (const int child : old.children)
      if (work_.is_taken[nth(child)] == 0) affected.orphans.push_back(child);
  }
  std::erase_if(roots_, [&](int root) { return work_.is_taken[nth(root)] != 0; });
  for (const int n : taken) {
    work_.is_taken[nth(n)] = 0;
    node(n) = {};
    free_.push_back(n);
  }
  // Whatever was above a removed term is taken, and nothing that stays has its variables in its rows but
  // through another term.
  std::erase_if(affected.terms, [&](int term) { return variables_of_[nth(term)].empty(); });
  std::erase_if(affected.variables, [&](int v) { return variables_[nth(v)].is_removed; });
  // What comes last stands at the end; the rest in the order in which it came, whatever the tree was.
  std::erase_if(affected.variables, [&](int v) { return std::ranges::find(last, v) != last.end(); });
  std::ranges::sort(affected.variables);
  affected.variables.insert(affected.variables.end(), last.begin(), last.end());
  for (const int variable : std::exchange(changes_.removed_variables, {}))
    unused_.variables[size(variable)].push_back(variable);
  for (const int term : std::exchange(changes_.removed_terms, {})) unused_.terms.push_back(term);
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
  work_.place.resize(variables_.size());
  for (std::size_t i = 0; i < affected.variables.size(); ++i) {
    work_.place[nth(affected.variables[i])] = static_cast<int>(i);
    pattern.sizes.push_back(size(affected.variables[i]));
  }
  const auto couple = [&](std::span<const int> variables) {
    for (std::size_t i = 0; i < variables.size(); ++i)
      for (std::size_t j = 0; j < i; ++j)
        pattern.couplings.emplace_back(work_.place[nth(variables[i])], work_.place[nth(variables[j])]);
  };
  for (const int term : affected.terms) couple(variables_of_[nth(term)]);
  for (const int orphan : affected.orphans) couple(node(orphan).of_rows());

  std::vector<int> made;
  for (const Front& front : elimination_fronts(pattern)) {
    made.push_back(new_node());
    Node& added = node(made.back());
    for (const int block : front.blocks) added.variables.push_back(affected.variables[nth(block)]);
    added.column_variables = front.column_blocks;
    added.columns = front.columns;
    added.size = front.size;
    added.parent = front.parent;  // among those that are made; its node follows
    added.turn = eliminated_++;
    for (const int variable : added.of_columns()) variables_[nth(variable)].node = made.back();
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
        variables, {}, [&](int variable) { return node(variables_[nth(variable)].node).turn; });
    return variables_[nth(first)].node;
  };
  for (const int term : affected.terms)
    node(first_eliminated(variables_of_[nth(term)])).terms.push_back(term);
  for (const int orphan : affected.orphans) {
    node(orphan).parent = first_eliminated(node(orphan).of_rows());
    node(node(orphan).parent).children.push_back(orphan);
  }
  return made;
}

/// To the matrix at hand.
void EliminationTree::add_terms(const Node& front, const Linearise& linearise) {
  int begin = 0;
  for (const int variable : front.variables) {
    work_.place[nth(variable)] = begin;
    begin += size(variable);
  }
  work_.matrix.setZero(front.size, front.size);
  work_.right.setZero(front.size);
  FrontSystem system(work_.matrix, work_.right, work_.place);
  for (const int term : front.terms) linearise(term, system);
}

// docs/theory/online-smoother.md, eq. 21.
bool EliminationTree::eliminate(Node& front, const Linearise& linearise, double ridge) {
  add_terms(front, linearise);
  for (const int child : front.children) add_update_of(node(child));

  auto diagonal = work_.matrix.diagonal().head(front.columns);
  largest_ = std::max(largest_, diagonal.maxCoeff());
  diagonal.array() += ridge * largest_;
  if (!geometry::eliminate_columns(work_.matrix, front.columns)) return false;
  front.factor = work_.matrix.leftCols(front.columns);
  front.reduced = work_.right.head(front.columns);
  front.factor.topRows(front.columns).triangularView<Eigen::Lower>().solveInPlace(front.reduced);
  if (front.rows() > 0) {
    front.update = work_.matrix.bottomRightCorner(front.rows(), front.rows());
    front.update_right = work_.right.tail(front.rows());
    front.update_right.noalias() -= front.factor.bottomRows(front.rows()) * front.reduced;
  }
  return true;
}

/// To the front at hand.
void EliminationTree::add_update_of(const Node& child) {
  std::vector<Index> row;
  for (const int variable : child.of_rows())
    for (int i = 0; i < size(variable); ++i) row.push_back(work_.place[nth(variable)] + i);
  for (std::size_t j = 0; j < row.size(); ++j) {
    work_.right[row[j]] += child.update_right[static_cast<Index>(j)];
    for (std::size_t i = j; i < row.size(); ++i)
      work_.matrix(std::max(row[i], row[j]), std::min(row[i], row[j])) +=
          child.update(static_cast<Index>(i), static_cast<Index>(j));
  }
}

}  // namespace trundle::slam
