#include "trundle/slam/fastslam/swarm.hpp"

#include <gtest/gtest.h>

#include "trundle/slam/cholesky.hpp"

#include "slam/pose_target.hpp"

namespace trundle::slam {
namespace {

TEST(Lattice, IsTheMostNearlySquare) {
  const auto shape = [](std::size_t particles) {
    const Lattice lattice = lattice_of(particles);
    return std::pair(lattice.rows, lattice.columns);
  };
  EXPECT_EQ(shape(100), std::pair(std::size_t{10}, std::size_t{10}));
  EXPECT_EQ(shape(30), std::pair(std::size_t{5}, std::size_t{6}));
  EXPECT_EQ(shape(1000), std::pair(std::size_t{25}, std::size_t{40}));
  EXPECT_EQ(lattice_of(31).cells(), 30U);  // prime: one particle is free
  EXPECT_EQ(lattice_of(1).cells(), 1U);
  EXPECT_EQ(lattice_of(2).cells(), 2U);
  EXPECT_EQ(lattice_of(3).cells(), 3U);
}

TEST(Lattice, IsATorus) {
  const Lattice lattice{3, 4};
  EXPECT_EQ(lattice.neighbours(0), (std::array<std::size_t, 4>{3, 1, 8, 4}));
  EXPECT_EQ(lattice.neighbours(11), (std::array<std::size_t, 4>{10, 8, 7, 3}));
  for (std::size_t cell = 0; cell < 12; ++cell)
    for (const std::size_t neighbour : lattice.neighbours(cell)) {
      const auto back = lattice.neighbours(neighbour);
      EXPECT_NE(std::ranges::find(back, cell), back.end());
    }
}

/// Particles that were here and there, all with the same exact map of three landmarks.
struct Scene {
  LandmarkSensor sensor{{0.2, 0.0, 0.0}, 0.05, 0.01, 20.0, 0.0};
  Pose2 truth{0.1, -0.05, 0.08};
  Matrix3 Q = Vector3(0.01, 0.01, 0.0025).asDiagonal();
  std::size_t count;
  PoseColumns predicted;
  std::vector<LandmarkColumns> columns;
  std::vector<KnownReading> readings;
  TripleColumns n;

  explicit Scene(std::size_t particles, bool sees = true)
      : count(particles), predicted(particles), n(particles) {
    columns.reserve(3);
    for (const Vector2& place : {Vector2(4.0, 3.0), Vector2(-1.0, 5.0), Vector2(2.0, -3.0)}) {
      columns.emplace_back(particles);
      for (std::size_t i = 0; i < particles; ++i)
        columns.back().set(i, {place.x(), place.y(), 1e-4, 0.0, 1e-4});
      const ExpectedReading exact = expected_reading(truth, sensor.body_from_sensor, place);
      if (sees)
        readings.push_back({reading_terms({0, exact.range_m, exact.bearing_rad}, sensor), &columns.back()});
    }
    draw_normals({.seed = 5}, {0, padded(particles)}, n);
  }
  test::PoseTarget target() const { return {predicted, Q, sensor.body_from_sensor, readings}; }
  void refine(const SwarmOptions& options) {
    const Matrix3 L = semidefinite_root(Q);
    ThreadPool alone(1, count);
    Swarm(count).refine(
        {predicted, L, sensor.body_from_sensor, NearReadings(readings, {0.3, -0.2}), {.seed = 5}}, options,
        alone, n);
  }
};

TEST(Swarm, NoParticleEndsWorseAndTheBestFindsTheMode) {
  Scene scene(36);
  const test::PoseTarget target = scene.target();
  std::vector<double> before;
  for (std::size_t i = 0; i < 36; ++i)
    before.push_back(target.at(i, target.clamped(scene.n.at(i))).log_density);
  scene.refine({.iterations = 10});
  Vector3 mode = Vector3::Zero();
  for (int k = 0; k < 10; ++k) mode = target.gaussian_at(0, mode).mean;
  double best = -1e300;
  for (std::size_t i = 0; i < 36; ++i) {
    const double after = target.at(i, scene.n.at(i)).log_density;
    EXPECT_GE(after, before[i]);
    best = std::max(best, after);
  }
  EXPECT_NEAR(best, target.at(0, mode).log_density, 0.2);
}

TEST(Swarm, StaysWithinThreeSigma) {
  Scene scene(25);
  for (std::size_t i = 0; i < 25; ++i)
    scene.predicted.set(i, {-0.6, 0.6, 0.0});  // farther than the motion allows
  scene.refine({.iterations = 10});
  for (std::size_t i = 0; i < 25; ++i) EXPECT_LE(scene.n.at(i).cwiseAbs().maxCoeff(), 3.0 + 1e-12);
}

TEST(Swarm, WithoutSightingsNothingMoves) {
  Scene scene(16, false);
  const TripleColumns before = scene.n;
  scene.refine({});
  for (std::size_t i = 0; i < 16; ++i) EXPECT_EQ(scene.n.at(i), before.at(i));
}

TEST(Swarm, StopsWhenTheParticlesAgree) {
  // With a target that any particle reaches, one iteration is made: the same as asking for one.
  Scene one(16);
  Scene many(16);
  one.refine({.iterations = 1});
  many.refine({.iterations = 8, .target_agreement = 1e-300});
  for (std::size_t i = 0; i < 16; ++i) EXPECT_EQ(one.n.at(i), many.n.at(i));
}

}  // namespace
}  // namespace trundle::slam
