#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "trundle/namespaces.hpp"
#include "trundle/slam/nth.hpp"

namespace trundle::slam {

/// Of the largest information in a front, what is added to all where rounding has left less than nothing of
/// the smallest, and how far that may go: readings that are a million times surer than the rest.
inline constexpr double kLeastRidge = 1e-15;
inline constexpr double kMostRidge = 1e-9;  ///< of which rounding, 1e-16, leaves seven digits

/// The linear system of one front while its terms are added: the lower triangle of a symmetric matrix and the
/// right side, by blocks.
class FrontSystem {
 public:
  FrontSystem(Eigen::MatrixXd& matrix, Eigen::VectorXd& right, std::span<const int> offset_of)
      : matrix_(matrix), right_(right), offset_of_(offset_of) {}

  /// Adds to the block (i, j) and, being symmetric, to (j, i). Of i = j the lower triangle counts.
  template <class Block>
  void add(int i, int j, const Block& block) {
    const int row = offset_of_[nth(i)];
    const int column = offset_of_[nth(j)];
    if (row >= column)
      matrix_.block(row, column, block.rows(), block.cols()) += block;
    else
      matrix_.block(column, row, block.cols(), block.rows()) += block.transpose();
  }
  template <class Vector>
  void add(int i, const Vector& right) {
    right_.segment(offset_of_[nth(i)], right.size()) += right;
  }

 private:
  Eigen::MatrixXd& matrix_;
  Eigen::VectorXd& right_;
  std::span<const int> offset_of_;  ///< by variable
};

/// Sparse normal equations Λ δ = b that grow and change a little at a time, and their Cholesky factor as a
/// tree of dense fronts [Kaess et al. 2012: the Bayes tree]. Λ and b are sums of terms, each among a few
/// variables. Where terms are new or have changed, the fronts that hold them and all above them are
/// eliminated anew, in an order of their own; what is below them stays. docs/theory/online-smoother.md.
class EliminationTree {
 public:
  /// A new variable, by how much each of its numbers may change before it matters to what hangs on it.
  /// Returns which it is: 0, 1, 2, ..., or the number of one that was removed before the last update().
  int add_variable(std::span<const double> tolerance);
  /// A new term among variables. Returns which it is: as of variables.
  int add_term(std::span<const int> variables);
  /// A term that is a term no longer.
  void remove_term(int term);
  /// A variable that no term is about any more; its δ is 0 from now on.
  void remove_variable(int variable);
  /// The point at which a variable's terms are linearised was moved: its δ is less by so much.
  void move(int variable, const Eigen::VectorXd& by);

  /// What a term adds to the front that holds it.
  using Linearise = std::function<void(int term, FrontSystem& system)>;
  /// Eliminates what has changed anew; `last`: these variables last, in this order. False: the matrix is not
  /// positive definite, and the tree is of no use any more.
  bool update(std::span<const int> last, const Linearise& linearise);

  /// A sum of terms, dense.
  struct Sum {
    std::vector<int> terms;
    std::vector<int> variables;  ///< in the order of the rows
    Eigen::MatrixXd matrix;
    Eigen::VectorXd right;
  };
  /// Removes variables, and all terms that they are in; returns the sum of these, with those variables first.
  [[nodiscard]] Sum take_out(std::span<const int> variables, const Linearise& linearise);

  /// Solves for δ from the root down: all of it, or as far as what is above has changed by more than its
  /// tolerance since it was handed down. Returns the variables that were solved for.
  enum class Solve { what_matters, all };
  const std::vector<int>& solve(Solve which = Solve::what_matters);
  [[nodiscard]] Eigen::Map<const Eigen::VectorXd> solution(int variable) const {
    return Eigen::Map<const Eigen::VectorXd>(numbers_.delta.data() + offset(variable), size(variable));
  }

  /// Some columns of Jᵀ: the derivatives of as many numbers by one variable.
  struct Derivative {
    int variable;
    Eigen::Index column;  ///< the first of them
    Eigen::MatrixXd transposed;
  };
  /// J Λ⁻¹ Jᵀ: covariance of so many numbers that depend on variables anywhere in the tree. Costs what lies
  /// between them and the root.
  [[nodiscard]] Eigen::MatrixXd projected_covariance(std::span<const Derivative> derivatives,
                                                     Eigen::Index numbers) const;

  [[nodiscard]] int variables() const { return static_cast<int>(variables_.size()); }

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.variables_, self.numbers_, self.variables_of_, self.nodes_, self.free_, self.roots_,
            self.unused_, self.changes_, self.eliminated_, self.largest_);
  }

 private:
  struct Node {
    std::vector<int> variables;  ///< those of the columns first, in order of elimination, then those of rows
    int column_variables = 0;
    int columns = 0;  ///< scalars
    int size = 0;     ///< scalars, columns among them
    int parent = -1;
    std::int64_t turn = 0;  ///< when it was eliminated: children before parents
    bool is_new = true;     ///< since the last solve()
    std::vector<int> children;
    std::vector<int> terms;
    Eigen::MatrixXd factor;        ///< L1 over L2
    Eigen::VectorXd reduced;       ///< L1⁻¹ b1
    Eigen::MatrixXd update;        ///< what eliminating the columns leaves of the rows
    Eigen::VectorXd update_right;  ///< likewise of b

    [[nodiscard]] int rows() const { return size - columns; }
    [[nodiscard]] std::span<const int> of_columns() const {
      return std::span(variables).first(nth(column_variables));
    }
    [[nodiscard]] std::span<const int> of_rows() const {
      return std::span(variables).subspan(nth(column_variables));
    }

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.variables, self.column_variables, self.columns, self.size, self.parent, self.turn,
              self.is_new, self.children, self.terms, self.factor, self.reduced, self.update,
              self.update_right);
    }
  };
  struct Variable {
    int size = 0;
    int offset = 0;  ///< where its numbers begin
    int node = -1;   ///< whose column it is; -1: new
    bool is_removed = false;
    std::vector<int> terms;

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.size, self.offset, self.node, self.is_removed, self.terms);
    }
  };
  /// Of all variables.
  struct Numbers {
    std::vector<double> tolerance;
    std::vector<double> delta;
    std::vector<double> handed_down;  ///< δ as the fronts below know it

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.tolerance, self.delta, self.handed_down);
    }
  };
  /// Since the last update().
  struct Changes {
    std::vector<int> variables;  ///< that are new
    std::vector<int> terms;      ///< likewise
    std::vector<int> touched;    ///< variables
    std::vector<int> removed_variables;
    std::vector<int> removed_terms;

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.variables, self.terms, self.touched, self.removed_variables, self.removed_terms);
    }
  };
  /// Numbers of variables and terms that are none.
  struct Unused {
    std::map<int, std::vector<int>> variables;  ///< by their size
    std::vector<int> terms;

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.variables, self.terms);
    }
  };
  /// Room to work in.
  struct Workspace {
    std::vector<int> place;  ///< by variable: its number among the affected, or where it begins in a front
    std::vector<char> has_moved;  ///< by variable: by what matters, in this solve()
    std::vector<char> is_taken;   ///< by node
    std::vector<int> solved;
    Eigen::MatrixXd matrix;
    Eigen::VectorXd right;
  };
  /// What is eliminated anew.
  struct Affected {
    std::vector<int> variables;  ///< those that come last at the end
    std::vector<int> terms;
    std::vector<int> orphans;  ///< nodes that stay, and whose parents do not
  };

  [[nodiscard]] int size(int variable) const { return variables_[nth(variable)].size; }
  [[nodiscard]] int offset(int variable) const { return variables_[nth(variable)].offset; }
  [[nodiscard]] Node& node(int n) { return nodes_[nth(n)]; }
  [[nodiscard]] const Node& node(int n) const { return nodes_[nth(n)]; }

  std::vector<int> take_touched_nodes();
  Affected take_affected(std::span<const int> last);
  std::vector<int> make_nodes(const Affected& affected, std::size_t last);
  int new_node();
  void add_terms(const Node& front, const Linearise& linearise);
  bool eliminate(Node& front, const Linearise& linearise, double ridge);
  void add_update_of(const Node& child);
  void solve_columns(const Node& front);
  void hand_down(int variable);
  [[nodiscard]] std::vector<int> path_nodes(std::span<const Derivative> derivatives) const;

  std::vector<Variable> variables_;
  Numbers numbers_;
  std::vector<std::vector<int>> variables_of_;  ///< by term; none: it is removed
  std::vector<Node> nodes_;
  std::vector<int> free_;  ///< nodes that are none
  std::vector<int> roots_;
  Unused unused_;
  Changes changes_;
  std::int64_t eliminated_ = 0;
  double largest_ = 0.0;  ///< on the diagonals of all fronts so far
  Workspace work_;
};

}  // namespace trundle::slam
