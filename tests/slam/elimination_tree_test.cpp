// A sparse system that grows and changes, against the same one solved densely.
#include "trundle/slam/smoothing/solver/elimination_tree.hpp"

#include <set>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <gtest/gtest.h>

#include "trundle/io/archive.hpp"
#include "trundle/statistics/random.hpp"

namespace trundle::slam {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Random terms among neighbours of a chain that closes now and then, and all of them as one dense system.
class GrowingSystem {
 public:
  explicit GrowingSystem(std::uint64_t seed) : random_(seed, 3) {}

  void add_variable() {
    const int size = 2 + static_cast<int>(random_.below(3));
    const std::vector<double> tolerance(static_cast<std::size_t>(size), 0.0);
    const int variable = static_cast<int>(sizes_.size());
    id_.push_back(tree_.add_variable(tolerance));
    begin_.push_back(total_);
    total_ += size;
    sizes_.push_back(size);
    add_term({variable});
    if (variable == 0) return;
    if (!is_removed(variable - 1)) add_term({variable - 1, variable});
    if (random_.below(4) == 0) {
      const int other = any_variable();
      if (!is_removed(other) && !old_.contains(other)) add_term({other, variable});
    }
  }
  /// A variable goes, with all its terms.
  void remove(int variable) {
    if (is_removed(variable)) return;
    for (std::size_t t = 0; t < terms_.size(); ++t) {
      if (std::ranges::find(terms_[t].variables, variable) == terms_[t].variables.end()) continue;
      tree_.remove_term(terms_[t].id);
      terms_[t] = {};
    }
    tree_.remove_variable(id(variable));
    removed_.insert(variable);
  }
  /// No further terms.
  void leave_alone(const std::vector<int>& variables) { old_.insert(variables.begin(), variables.end()); }
  /// Variables go, and what their terms say of others becomes a term.
  void marginalise(std::vector<int> variables) {
    std::erase_if(variables, [&](int variable) { return is_removed(variable); });
    std::vector<int> ids;
    for (const int variable : variables) ids.push_back(id(variable));
    const EliminationTree::Sum sum = tree_.take_out(ids, linearise());
    for (const int gone : sum.terms) *std::ranges::find(terms_, gone, &Term::id) = {};
    Index columns = 0;
    for (const int variable : variables) columns += size(variable);
    const Index rows = sum.matrix.rows() - columns;
    const MatrixXd G =
        sum.matrix.bottomLeftCorner(rows, columns) * sum.matrix.topLeftCorner(columns, columns).inverse();
    std::vector<int> others;
    for (std::size_t i = variables.size(); i < sum.variables.size(); ++i)
      others.push_back(static_cast<int>(std::ranges::find(id_, sum.variables[i]) - id_.begin()));
    for (const int variable : variables) {
      removed_.insert(variable);
      id_[static_cast<std::size_t>(variable)] = -1;
    }
    add_term(others, sum.matrix.bottomRightCorner(rows, rows) - G * sum.matrix.topRightCorner(columns, rows),
             sum.right.tail(rows) - G * sum.right.head(columns));
  }
  bool is_removed(int variable) const { return removed_.contains(variable); }
  /// Another value of the terms of a variable.
  void change(int variable) {
    for (Term& term : terms_)
      if (std::ranges::find(term.variables, variable) != term.variables.end()) term.b = vector(term.b.size());
    tree_.move(id(variable), VectorXd::Zero(sizes_[static_cast<std::size_t>(variable)]));
  }

  bool update() {
    std::vector<int> last{static_cast<int>(sizes_.size()) - 1};
    if (is_removed(last.front()))
      last.clear();
    else
      last.front() = id(last.front());
    return tree_.update(last, linearise());
  }

  void dense(MatrixXd& A, VectorXd& b) const {
    A = MatrixXd::Zero(total_, total_);
    b = VectorXd::Zero(total_);
    for (const Term& term : terms_) {
      std::vector<Index> at;
      for (const int i : term.variables)
        for (int k = 0; k < size(i); ++k) at.push_back(begin(i) + k);
      for (std::size_t r = 0; r < at.size(); ++r) {
        b[at[r]] += term.b[static_cast<Index>(r)];
        for (std::size_t c = 0; c < at.size(); ++c)
          A(at[r], at[c]) += term.A(static_cast<Index>(r), static_cast<Index>(c));
      }
    }
    for (const int gone : removed_) A.block(begin(gone), begin(gone), size(gone), size(gone)).setIdentity();
  }
  VectorXd solution() {
    tree_.solve();
    VectorXd x(total_);
    x.setZero();
    for (int i = 0; i < static_cast<int>(sizes_.size()); ++i)
      if (!is_removed(i)) x.segment(begin(i), size(i)) = tree_.solution(id(i));
    return x;
  }
  EliminationTree& tree() { return tree_; }
  Index begin(int i) const { return begin_[static_cast<std::size_t>(i)]; }
  int size(int i) const { return sizes_[static_cast<std::size_t>(i)]; }
  MatrixXd matrix(Index rows, Index columns) {
    return MatrixXd::NullaryExpr(rows, columns, [&] { return random_.normal(1.0); });
  }
  int any_variable() { return static_cast<int>(random_.below(sizes_.size())); }

 private:
  struct Term {
    int id = -1;  ///< of the tree; variables are our own
    std::vector<int> variables;
    MatrixXd A;
    VectorXd b;
  };
  int id(int variable) const { return id_[static_cast<std::size_t>(variable)]; }
  EliminationTree::Linearise linearise() const {
    return [this](int t, FrontSystem& system) {
      const Term& term = *std::ranges::find(terms_, t, &Term::id);
      Index row = 0;
      for (const int i : term.variables) {
        Index column = 0;
        for (const int j : term.variables) {
          if (column <= row) system.add(id(i), id(j), term.A.block(row, column, size(i), size(j)));
          column += size(j);
        }
        system.add(id(i), term.b.segment(row, size(i)));
        row += size(i);
      }
    };
  }
  VectorXd vector(Index rows) {
    return VectorXd::NullaryExpr(rows, [&] { return random_.normal(1.0); });
  }
  void add_term(std::vector<int> variables) {
    if (variables.size() == 2 && variables[0] == variables[1]) return;
    Index rows = 0;
    for (const int i : variables) rows += size(i);
    const MatrixXd J = matrix(rows + 1, rows);
    add_term(std::move(variables), J.transpose() * J, vector(rows));
  }
  void add_term(std::vector<int> variables, const MatrixXd& A, const VectorXd& b) {
    std::vector<int> ids;
    for (const int i : variables) ids.push_back(id(i));
    const int term = tree_.add_term(ids);
    terms_.push_back({term, std::move(variables), A, b});
  }

  Random random_;
  EliminationTree tree_;
  std::vector<int> sizes_;
  std::vector<int> id_;  ///< of the tree, by variable
  std::vector<Index> begin_;
  Index total_ = 0;
  std::vector<Term> terms_;
  std::set<int> removed_;
  std::set<int> old_;
};

void expect_solved_as_from_scratch(GrowingSystem& system) {
  ASSERT_TRUE(system.update());
  MatrixXd A;
  VectorXd b;
  system.dense(A, b);
  const VectorXd expected = A.llt().solve(b);
  EXPECT_LT((system.solution() - expected).norm(), 1e-9 * (1.0 + expected.norm()));
}

TEST(EliminationTree, SolvesWhatItWouldSolveFromScratch) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    GrowingSystem system(seed);
    for (int step = 0; step < 80 && !testing::Test::HasFailure(); ++step) {
      SCOPED_TRACE(step);
      system.add_variable();
      if (step % 7 == 3) system.change(system.any_variable());
      expect_solved_as_from_scratch(system);
    }
  }
}

TEST(EliminationTree, ForgetsWhatIsRemoved) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    GrowingSystem system(seed);
    for (int step = 0; step < 80 && !testing::Test::HasFailure(); ++step) {
      SCOPED_TRACE(step);
      system.add_variable();
      if (step % 5 == 4) system.remove(system.any_variable());
      expect_solved_as_from_scratch(system);
    }
  }
}

// What is taken out and put back for the others: a tree of bounded size, and the same solution as that of
// all terms ever.
TEST(EliminationTree, MarginalisesExactly) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    GrowingSystem windowed(seed), whole(seed);
    for (int step = 0; step < 60 && !testing::Test::HasFailure(); ++step) {
      SCOPED_TRACE(step);
      windowed.add_variable();
      whole.add_variable();
      if (step % 4 == 3 && step > 8) {
        for (GrowingSystem* system : {&windowed, &whole}) system->leave_alone({step - 8, step - 7});
        windowed.marginalise({step - 8, step - 7});
      }
      expect_solved_as_from_scratch(windowed);
      ASSERT_TRUE(whole.update());
      const VectorXd x = windowed.solution(), all = whole.solution();
      for (int i = 0; i <= step; ++i)
        if (!windowed.is_removed(i)) {
          const Index from = windowed.begin(i), count = windowed.size(i);
          EXPECT_LT((x - all).segment(from, count).norm(), 1e-9 * (1.0 + all.norm()));
        }
    }
    EXPECT_LT(windowed.tree().variables(), whole.tree().variables());
  }
}

TEST(EliminationTree, ProjectsTheInverse) {
  GrowingSystem system(5);
  for (int step = 0; step < 60; ++step) {
    system.add_variable();
    ASSERT_TRUE(system.update());
  }
  MatrixXd A;
  VectorXd b;
  system.dense(A, b);
  MatrixXd J = MatrixXd::Zero(5, A.rows());
  std::vector<EliminationTree::Derivative> derivatives;
  for (const int variable : {3, 59, 20, 3}) {  // one of them twice
    const Index numbers = variable == 59 ? 5 : 2;
    const Index first = variable == 20 ? 3 : 0;
    derivatives.push_back({variable, first, system.matrix(system.size(variable), numbers)});
    J.block(first, system.begin(variable), numbers, system.size(variable)) +=
        derivatives.back().transposed.transpose();
  }
  const MatrixXd expected = J * A.inverse() * J.transpose();
  EXPECT_LT((system.tree().projected_covariance(derivatives, 5) - expected).norm(), 1e-9 * expected.norm());
}

TEST(EliminationTree, HandsDownWhatMatters) {
  EliminationTree tree;
  const std::vector<double> coarse{1.0};
  for (int i = 0; i < 3; ++i) tree.add_variable(coarse);
  double b = 0.0;
  const auto update = [&] {
    const std::vector<int> last{2};
    ASSERT_TRUE(tree.update(last, [&](int term, FrontSystem& system) {
      const MatrixXd one = MatrixXd::Identity(1, 1);
      if (term < 2) {
        system.add(term, term, one);
        system.add(term + 1, term + 1, one);
        system.add(term, term + 1, -one);
      } else {
        system.add(2, 2, one);
        system.add(2, VectorXd::Constant(1, b));
      }
    }));
  };
  for (int i = 0; i < 2; ++i) tree.add_term(std::vector<int>{i, i + 1});
  tree.add_term(std::vector<int>{2});
  update();
  tree.solve();
  b = 3.0;
  tree.move(2, VectorXd::Zero(1));
  update();
  const std::vector<int> solved = tree.solve();
  EXPECT_EQ(solved.size(), 3U);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(tree.solution(i)[0], 3.0, 1e-12);
}

TEST(EliminationTree, IsTheSameAfterItWasStored) {
  GrowingSystem system(7);
  for (int step = 0; step < 40; ++step) {
    system.add_variable();
    ASSERT_TRUE(system.update());
  }
  system.solution();
  EliminationTree again;
  resume_state(again, state_of(system.tree()));
  EXPECT_TRUE(state_of(again) == state_of(system.tree()));
}

TEST(EliminationTree, SaysThatAMatrixIsNotPositiveDefinite) {
  EliminationTree tree;
  const std::vector<double> tolerance{0.0, 0.0};
  tree.add_variable(tolerance);
  tree.add_term(std::vector<int>{0});
  const std::vector<int> last{0};
  EXPECT_FALSE(tree.update(last, [](int, FrontSystem& system) {
    system.add(0, 0, MatrixXd(Eigen::Vector2d(1.0, -1.0).asDiagonal()));
  }));
}

}  // namespace
}  // namespace trundle::slam
