#include "trundle/slam/fastslam/ancestry.hpp"

#include <algorithm>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include "trundle/slam/fastslam/particle_paths.hpp"
#include "trundle/statistics/random.hpp"

namespace trundle::slam {
namespace {

std::vector<Ancestry::Index> random_parents(std::size_t count, Random& random) {
  std::vector<Ancestry::Index> parents(count);
  for (Ancestry::Index& parent : parents) parent = static_cast<Ancestry::Index>(random.below(count));
  std::ranges::sort(parents);
  return parents;
}

/// As Ancestry::resample wants it, of ascending parents.
std::vector<Ancestry::Index> first_children(const std::vector<Ancestry::Index>& parents) {
  std::vector<Ancestry::Index> first;
  for (Ancestry::Index parent = 0; parent <= parents.size(); ++parent)
    first.push_back(
        static_cast<Ancestry::Index>(std::ranges::lower_bound(parents, parent) - parents.begin()));
  return first;
}

template <class T>
void copy_from_parents(std::vector<T>& values, const std::vector<Ancestry::Index>& parents) {
  const std::vector<T> before = values;
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = before[parents[i]];
}

TEST(Ancestry, GatheringLateIsCopyingAtOnce) {
  constexpr std::size_t kParticles = 37;
  Random random(3);
  Ancestry ancestry(kParticles);
  struct Column {
    Ancestry::Epoch epoch;
    std::vector<double> lazy, copied;
  };
  std::vector<Column> columns(20);
  for (Column& column : columns) {
    for (std::size_t i = 0; i < kParticles; ++i) column.copied.push_back(random.uniform());
    column.lazy = column.copied;
    column.epoch = ancestry.now();
    ancestry.hold(column.epoch);
  }
  for (int generation = 0; generation < 500; ++generation) {
    const auto parents = random_parents(kParticles, random);
    ancestry.resample(first_children(parents));
    for (Column& column : columns) copy_from_parents(column.copied, parents);
    Column& seen = columns[random.below(columns.size())];
    for (Ancestry::Index i = 0; i < kParticles; ++i)
      ASSERT_EQ(seen.lazy[ancestry.ancestor(seen.epoch, i)], seen.copied[i]);
    const std::vector<double> old = seen.lazy;
    std::vector<Ancestry::Index> ancestors(kParticles);
    ancestry.write_ancestors(seen.epoch, ancestors);
    for (std::size_t i = 0; i < kParticles; ++i) seen.lazy[i] = old[ancestors[i]];
    ancestry.hold(ancestry.now());
    ancestry.release(seen.epoch);
    seen.epoch = ancestry.now();
    ASSERT_EQ(seen.lazy, seen.copied);
    for (std::size_t i = 0; i < kParticles; ++i) {
      seen.lazy[i] += static_cast<double>(i);
      seen.copied[i] += static_cast<double>(i);
    }
  }
}

TEST(Ancestry, OldMapsShrinkToFewAncestors) {
  constexpr std::size_t kParticles = 200;
  Random random(4);
  Ancestry ancestry(kParticles);
  ancestry.hold(0);
  std::size_t before = kParticles;
  for (int generation = 0; generation < 4000; ++generation) {
    ancestry.resample(first_children(random_parents(kParticles, random)));
    ASSERT_LE(ancestry.survivors(0), before);
    before = ancestry.survivors(0);
    // Wright–Fisher: about 2N/g ancestors remain of g generations ago.
    if (generation == 20) {
      EXPECT_NEAR(static_cast<double>(before), 20.0, 15.0);
    }
  }
  EXPECT_EQ(before, 1U);
}

TEST(ParticlePaths, AreThoseOfACopyingFilter) {
  constexpr std::size_t kParticles = 30;
  Random random(5);
  Ancestry ancestry(kParticles);
  ParticlePaths paths;
  std::vector<std::vector<double>> copied(kParticles);
  std::size_t most_stored = 0;
  for (int step = 0; step < 2000; ++step) {
    PoseColumns poses(kParticles);
    for (std::size_t i = 0; i < kParticles; ++i) {
      poses.set(i, {random.uniform(), 0.0, 0.0});
      copied[i].push_back(poses.at(i).x);
    }
    paths.add({});
    paths.add_keyframe(poses, ancestry);
    if (random.below(3) == 0) {
      const auto parents = random_parents(kParticles, random);
      ancestry.resample(first_children(parents));
      paths.resampled(ancestry);
      copy_from_parents(copied, parents);
    }
    most_stored = std::max(most_stored, paths.stored());
  }
  for (Ancestry::Index i = 0; i < kParticles; ++i) {
    std::vector<double> path;
    for (const Pose2& pose : paths.path_of({.particle = i}, ancestry)) path.push_back(pose.x);
    ASSERT_EQ(path, copied[i]);
  }
  EXPECT_LT(most_stored, 2000U + 3000U);  // and not 2000 · 30
}

TEST(ParticlePaths, StepsBetweenKeyframesAreAsProbableAsPossible) {
  // Monte Carlo of a blind stretch, conditioned on where it ended: of many draws, those that end near the
  // keyframe have the mean at the middle step that path_of() says.
  Random random(6);
  const Twist2 twist{0.5, 0.0, 0.3};
  Matrix3 Q = Vector3(1e-4, 1e-6, 4e-4).asDiagonal();
  const Motion motion = motion_of(twist, Q);
  Motion middle, end;
  for (int k = 0; k < 6; ++k) {
    end = end * motion;
    if (k == 2) middle = end;
  }
  const Twist2 error{0.01, -0.02, 0.015};
  const Pose2 keyframe = end.mean * exp(error);
  Ancestry ancestry(1);
  ParticlePaths paths;
  for (int k = 0; k < 6; ++k) paths.add(motion);
  PoseColumns there(1);
  there.set(0, keyframe);
  paths.add_keyframe(there, ancestry);
  paths.add(motion);
  const std::vector<Pose2> path = paths.path_of({}, ancestry);
  ASSERT_EQ(path.size(), 7U);
  EXPECT_EQ(path[5].x, keyframe.x);
  EXPECT_NEAR(path[6].x, (keyframe * motion.mean).x, 1e-15);
  const Vector3 found = log(middle.mean.inverse() * path[2]).vector();
  // Least squares: regress the middle's error on the end's over simulated stretches.
  Matrix3 middle_end = Matrix3::Zero();
  Matrix3 end_end = Matrix3::Zero();
  for (int run = 0; run < 20000; ++run) {
    Pose2 at, at_middle;
    for (int k = 0; k < 6; ++k) {
      const Twist2 noise{random.normal(0.01), random.normal(0.001), random.normal(0.02)};
      at = at * motion.mean * exp(noise);
      if (k == 2) at_middle = at;
    }
    const Vector3 e = log(end.mean.inverse() * at).vector();
    const Vector3 m = log(middle.mean.inverse() * at_middle).vector();
    middle_end += m * e.transpose();
    end_end += e * e.transpose();
  }
  const Vector3 expected = middle_end * end_end.ldlt().solve(error.vector());
  EXPECT_LT((found - expected).norm(), 0.03 * expected.norm() + 2e-4);
}

}  // namespace
}  // namespace trundle::slam
