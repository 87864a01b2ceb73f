#include "trundle/slam/smoothing/solver/block_cholesky.hpp"

#include <set>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <gtest/gtest.h>

#include "trundle/statistics/random.hpp"

namespace trundle::slam {
namespace {

/// A chain of blocks of three among blocks of two, each of which some of the chain see, and one block that
/// all do.
struct LinearSystem {
  BlockPattern pattern;
  Eigen::MatrixXd dense;
};

int offset_of(const BlockPattern& pattern, int block) {
  int offset = 0;
  for (int i = 0; i < block; ++i) offset += pattern.sizes[static_cast<std::size_t>(i)];
  return offset;
}

LinearSystem problem_of(int chain, int others, std::uint64_t seed) {
  Random random(seed, 1);
  LinearSystem problem;
  BlockPattern& pattern = problem.pattern;
  pattern.sizes.assign(static_cast<std::size_t>(chain), 3);
  pattern.sizes.insert(pattern.sizes.end(), static_cast<std::size_t>(others), 2);
  pattern.sizes.push_back(4);
  pattern.last = 1;
  for (int i = 0; i < chain; ++i) {
    if (i > 0) pattern.couplings.emplace_back(i - 1, i);
    pattern.couplings.emplace_back(i, chain + others);
    for (int seen = 0; seen < 2 && others > 0; ++seen)
      pattern.couplings.emplace_back(chain + static_cast<int>(random.uniform(0.0, 0.999) * others), i);
  }
  const int size = offset_of(pattern, chain + others + 1);
  problem.dense = Eigen::MatrixXd::Identity(size, size);
  return problem;
}

/// Each coupling adds J Jᵀ over its two blocks, to both.
void fill(LinearSystem& problem, BlockCholesky& sparse, std::uint64_t seed) {
  Random random(seed, 2);
  const auto& sizes = problem.pattern.sizes;
  for (int i = 0; i < static_cast<int>(sizes.size()); ++i) {
    const int n = sizes[static_cast<std::size_t>(i)];
    sparse.add(i, i, Eigen::MatrixXd::Identity(n, n));
  }
  for (const auto& [i, j] : problem.pattern.couplings) {
    const int n = sizes[static_cast<std::size_t>(i)];
    const int m = sizes[static_cast<std::size_t>(j)];
    Eigen::MatrixXd J(2, n + m);
    for (double& entry : J.reshaped()) entry = random.normal(1.0);
    const Eigen::MatrixXd N = J.transpose() * J;
    sparse.add(i, i, N.topLeftCorner(n, n));
    sparse.add(j, j, N.bottomRightCorner(m, m));
    sparse.add(i, j, N.topRightCorner(n, m));
    const int a = offset_of(problem.pattern, i);
    const int b = offset_of(problem.pattern, j);
    problem.dense.block(a, a, n, n) += N.topLeftCorner(n, n);
    problem.dense.block(b, b, m, m) += N.bottomRightCorner(m, m);
    problem.dense.block(a, b, n, m) += N.topRightCorner(n, m);
    problem.dense.block(b, a, m, n) += N.bottomLeftCorner(m, n);
  }
}

TEST(BlockCholesky, SolvesAndInvertsAsADenseMatrixDoes) {
  for (const auto& [chain, others] : {std::pair{1, 0}, {2, 1}, {30, 4}, {60, 25}}) {
    LinearSystem problem = problem_of(chain, others, 7);
    BlockCholesky sparse(problem.pattern);
    fill(problem, sparse, 8);
    const double damping = 0.5;
    ASSERT_TRUE(sparse.factor(damping));
    const Eigen::MatrixXd damped =
        problem.dense + damping * Eigen::MatrixXd::Identity(sparse.size(), sparse.size());
    const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(sparse.size(), -1.0, 2.0);
    EXPECT_LT((damped * sparse.solve(b) - b).norm(), 1e-10);

    sparse.invert();
    const Eigen::MatrixXd inverse = damped.inverse();
    const auto expect_block = [&](int i, int j) {
      const Eigen::MatrixXd block = sparse.inverse(i, j);
      EXPECT_LT((block - inverse.block(offset_of(problem.pattern, i), offset_of(problem.pattern, j),
                                       block.rows(), block.cols()))
                    .norm(),
                1e-12);
    };
    for (int i = 0; i < static_cast<int>(problem.pattern.sizes.size()); ++i) expect_block(i, i);
    for (const auto& [i, j] : problem.pattern.couplings) {
      expect_block(i, j);
      expect_block(j, i);
    }
  }
}

TEST(BlockCholesky, SaysThatAMatrixIsNotPositiveDefinite) {
  LinearSystem problem = problem_of(10, 3, 7);
  BlockCholesky sparse(problem.pattern);
  fill(problem, sparse, 8);
  EXPECT_FALSE(sparse.factor(-5.0));
  EXPECT_TRUE(sparse.factor(0.0));
}

TEST(Elimination, EveryBlockIsEliminatedOnceAndParentsComeLater) {
  const LinearSystem problem = problem_of(200, 20, 3);
  const std::vector<Front> fronts = elimination_fronts(problem.pattern);
  std::set<int> eliminated;
  for (std::size_t f = 0; f < fronts.size(); ++f) {
    for (int i = 0; i < fronts[f].column_blocks; ++i)
      EXPECT_TRUE(eliminated.insert(fronts[f].blocks[static_cast<std::size_t>(i)]).second);
    EXPECT_EQ(fronts[f].rows() > 0, fronts[f].parent >= 0);
    EXPECT_TRUE(fronts[f].parent < 0 || fronts[f].parent > static_cast<int>(f));
  }
  EXPECT_EQ(eliminated.size(), problem.pattern.sizes.size());
}

}  // namespace
}  // namespace trundle::slam
