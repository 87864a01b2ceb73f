#include "trundle/slam/fastslam/particle_kernels.hpp"

#include <cmath>

#include <Eigen/LU>
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include "trundle/slam/cholesky.hpp"
#include "trundle/slam/fastslam/landmark_kernels.hpp"
#include "trundle/slam/fastslam/particle_slam.hpp"
#include "trundle/slam/fastslam/swarm_kernels.hpp"

#include "scale.hpp"
#include "slam/pose_target.hpp"
#include "slam/world.hpp"

namespace trundle::slam {
namespace {

TEST(Threefry, IsThePublishedOne) {
  using Words = std::array<std::uint32_t, 4>;
  constexpr std::uint32_t kAll = 0xffffffff;
  EXPECT_EQ(threefry({0, 0, 0, 0}, {0, 0, 0, 0}), (Words{0x9c6ca96a, 0xe17eae66, 0xfc10ecd4, 0x5256a7d8}));
  EXPECT_EQ(threefry({kAll, kAll, kAll, kAll}, {kAll, kAll, kAll, kAll}),
            (Words{0x2a881696, 0x57012287, 0xf6c7446e, 0xa16a6732}));
}

TEST(DrawNormals, AreNormalAndIndependent) {
  constexpr std::size_t kCount = 1 << 18;
  TripleColumns n(kCount);
  draw_normals({.seed = 5, .step = 7}, {0, kCount}, n);
  const double sigma = 1.0 / std::sqrt(static_cast<double>(kCount));
  for (std::size_t k = 0; k < 3; ++k) {
    std::array<double, 5> moments{};
    double with_next = 0.0;
    double with_neighbour = 0.0;
    for (std::size_t i = 0; i < kCount; ++i) {
      const double x = n[k][i];
      double power = 1.0;
      for (double& moment : moments) moment += (power *= x) / kCount;
      with_next += x * n[(k + 1) % 3][i] / kCount;
      with_neighbour += x * n[k][(i + 1) % kCount] / kCount;
    }
    EXPECT_NEAR(moments[0], 0.0, 4.0 * sigma);
    EXPECT_NEAR(moments[1], 1.0, 4.0 * std::sqrt(2.0) * sigma);
    EXPECT_NEAR(moments[2], 0.0, 4.0 * std::sqrt(15.0) * sigma);
    EXPECT_NEAR(moments[3], 3.0, 4.0 * std::sqrt(96.0) * sigma);
    EXPECT_NEAR(with_next, 0.0, 4.0 * sigma);
    EXPECT_NEAR(with_neighbour, 0.0, 4.0 * sigma);
  }
}

TEST(DrawChances, AreUniformAndUnrelated) {
  constexpr std::size_t kCount = 1 << 18;
  std::array<TripleColumns, 3> chances = {TripleColumns(kCount), TripleColumns(kCount),
                                          TripleColumns(kCount)};
  draw_chances({.seed = 5, .step = 7}, {0, kCount}, chances);
  const double sigma = 1.0 / std::sqrt(static_cast<double>(kCount));
  const auto column = [&](std::size_t k) { return chances[k / 3][k % 3]; };
  for (std::size_t k = 0; k < 9; ++k) {
    std::array<double, 1024> counts{};
    std::array<double, 9> products{};
    for (std::size_t i = 0; i < kCount; ++i) {
      const double x = column(k)[i];
      ASSERT_EQ(x * 1024.0 - 0.5, std::floor(x * 1024.0));
      counts[static_cast<std::size_t>(x * 1024.0)] += 1.0;
      for (std::size_t other = 0; other < 9; ++other)
        products[other] += (x - 0.5) * (column(other)[i] - 0.5) * 12.0 / kCount;
    }
    double chi2 = 0.0;
    for (const double count : counts) chi2 += (count - 256.0) * (count - 256.0) / 256.0;
    EXPECT_NEAR(chi2, 1023.0, 4.0 * std::sqrt(2.0 * 1023.0));
    for (std::size_t other = 0; other < 9; ++other)
      EXPECT_NEAR(products[other], other == k ? 1.0 : 0.0, 4.0 * sigma);
  }
}

TEST(Predict, IsComposition) {
  Random random(3);
  PoseColumns poses(50);
  SystematicColumns systematic(50, 3);
  for (std::size_t i = 0; i < 50; ++i) {
    poses.set(i, {random.uniform(-99.0, 99.0), random.uniform(-99.0, 99.0), random.uniform(-9.0, 9.0)});
    systematic.set(i, Vector3(random.normal(0.1), random.normal(0.1), random.normal(0.1)));
  }
  const Motion shares = motion_of({2.0, 0.3, -1.5}, Matrix3::Zero());
  const PredictedMotion motion{shares.mean, shares.by_systematic, {0.02, -0.01, 0.03}};
  PoseColumns predicted(50);
  predict(poses, systematic, motion, {0, padded(50)}, predicted);
  for (std::size_t i = 0; i < 50; ++i) {
    const Pose2 exact = poses.at(i) * motion.mean *
                        exp(Twist2::from(motion.by_systematic * systematic.at(i) + motion.offset));
    EXPECT_NEAR(predicted.at(i).x, exact.x, 1e-13);
    EXPECT_NEAR(predicted.at(i).y, exact.y, 1e-13);
    EXPECT_NEAR(wrap_angle(predicted.at(i).heading - exact.heading), 0.0, 1e-13);
  }
}

TEST(Place, IsTheExponentialAndTheSensorThere) {
  Random random(4);
  PoseColumns predicted(40);
  TripleColumns n(40);
  for (std::size_t i = 0; i < 40; ++i) {
    predicted.set(i, {random.uniform(-99.0, 99.0), random.uniform(-99.0, 99.0), random.uniform(-9.0, 9.0)});
    n.set(i, Vector3(random.normal(), random.normal(), random.normal()) *
                 std::pow(10.0, -static_cast<double>(i % 10)));
  }
  Matrix3 L = Matrix3::Zero();
  L << 0.5, 0.0, 0.0, 0.1, 0.2, 0.0, -0.1, 0.3, 1.2;
  const Pose2 B{0.4, -0.2, 0.7};
  PoseColumns poses(40);
  SensorColumns sensors(40);
  sensors.origin = {12.0, -7.0};
  place(predicted, n, {L, B}, {0, padded(40)}, poses, sensors);
  for (std::size_t i = 0; i < 40; ++i) {
    const Pose2 exact = predicted.at(i) * exp(Twist2::from(L * n.at(i)));
    const Pose2 sensor = exact * B;
    EXPECT_NEAR(poses.at(i).x, exact.x, 1e-13);
    EXPECT_NEAR(poses.at(i).y, exact.y, 1e-13);
    EXPECT_NEAR(sensors.x[i] + 12.0, sensor.x, 1e-13);
    EXPECT_NEAR(sensors.y[i] - 7.0, sensor.y, 1e-13);
    EXPECT_NEAR(sensors.cos[i], std::cos(sensor.heading), 1e-14);
    EXPECT_NEAR(sensors.sin[i], std::sin(sensor.heading), 1e-14);
  }
}

/// One landmark, many particles around it, the same readings for all.
TEST(Lanes, AgreeWithOneLandmarkAlone) {
  // A landmark keeps 24 bits of its distance from its own origin, metres, far from zero.
  const double tolerance = 2e-6;
  const Vector2 far(5e5, -3e5);
  constexpr std::size_t kParticles = 33;
  Random random(6);
  SensorColumns sensors(kParticles);
  sensors.origin = far;
  LandmarkColumns columns(kParticles, far + Vector2(3.0, 3.0));
  std::vector<LandmarkEstimate> alone;
  std::vector<SensorAt> at;
  for (std::size_t i = 0; i < kParticles; ++i) {
    const double heading = random.uniform(-kPi, kPi);
    at.push_back(
        {random.uniform(-2.0, 2.0), random.uniform(-2.0, 2.0), std::cos(heading), std::sin(heading)});
    sensors.x[i] = at[i].x;
    sensors.y[i] = at[i].y;
    sensors.cos[i] = at[i].cos;
    sensors.sin[i] = at[i].sin;
  }
  const LandmarkSensor sensor{{}, 0.1, 0.02, 20.0, 0.0};
  const ReadingTerms first = reading_terms({0, 4.0, 0.5}, sensor);
  set_first_estimates(first, sensors, {0, padded(kParticles)}, columns);
  for (const SensorAt& s : at) alone.push_back(first_estimate(s, first));
  Column<double> log_weights(padded(kParticles));
  std::vector<double> expected(kParticles);
  for (int k = 0; k < 10; ++k) {
    const ReadingTerms reading =
        reading_terms({0, 4.0 + random.normal(0.1), 0.5 + random.normal(0.02)}, sensor);
    const KnownReading known{reading, &columns};
    weigh_and_improve({{&known, 1}, sensors.origin}, sensors, {0, padded(kParticles)}, log_weights.data());
    for (std::size_t i = 0; i < kParticles; ++i) {
      const Sight sight = sight_of(at[i], reading, alone[i]);
      expected[i] += log_likelihood_of(sight);
      improve(alone[i], sight);
    }
  }
  for (std::size_t i = 0; i < kParticles; ++i) {
    const LandmarkEstimate m = columns.at(i);
    EXPECT_NEAR(m.x - far.x(), alone[i].x, tolerance);
    EXPECT_NEAR(m.y - far.y(), alone[i].y, tolerance);
    EXPECT_NEAR(m.xx, alone[i].xx, tolerance * 0.01);
    EXPECT_NEAR(m.xy, alone[i].xy, tolerance * 0.01);
    EXPECT_NEAR(m.yy, alone[i].yy, tolerance * 0.01);
    EXPECT_NEAR(log_weights[i], expected[i], 100.0 * tolerance);
  }
}

TEST(Lanes, SumHundredsOfReadingsInOneStepNeitherOverflowNorVanish) {
  const double tolerance = 1e-5;
  SensorColumns sensors(1);
  sensors.cos[0] = 1.0;
  const SensorAt at{0.0, 0.0, 1.0, 0.0};
  for (const double sigma : {1e-3, 1e3}) {
    const LandmarkSensor sensor{{}, sigma, 0.5 * sigma, 20.0, 0.0};
    std::vector<LandmarkColumns> columns(400, LandmarkColumns(1));
    std::vector<KnownReading> readings;
    double expected = 0.0;
    for (LandmarkColumns& landmark : columns) {
      const LandmarkEstimate m{3.0, 1.0, sigma * sigma, 0.0, sigma * sigma};
      landmark.set(0, m);
      readings.push_back({reading_terms({0, 3.1, 0.3}, sensor), &landmark});
      expected += log_likelihood_of(sight_of(at, readings.back().reading, landmark.at(0)));
    }
    Column<double> log_weights(kParticleLanes);
    weigh_and_improve({readings, sensors.origin}, sensors, {0, kParticleLanes}, log_weights.data());
    EXPECT_NEAR(log_weights[0], expected, tolerance * std::abs(expected));
  }
}

TEST(Swarm, FitnessIsTheTarget) {
  const double tolerance = 2e-5;
  constexpr std::size_t kParticles = 50;
  Random random(8);
  const LandmarkSensor sensor{{0.3, -0.1, 0.4}, 0.1, 0.05, 20.0, 0.0};
  PoseColumns predicted(kParticles);
  TripleColumns n(kParticles);
  for (std::size_t i = 0; i < kParticles; ++i) {
    predicted.set(i, {random.normal(0.5), random.normal(0.5), random.uniform(-9.0, 9.0)});
    n.set(i, {random.normal(), random.normal(), random.normal()});
  }
  std::vector<LandmarkColumns> columns(10, LandmarkColumns(kParticles));
  std::vector<KnownReading> readings;
  for (LandmarkColumns& landmark : columns) {
    for (std::size_t i = 0; i < kParticles; ++i)
      landmark.set(
          i, {random.uniform(-9.0, 9.0), random.uniform(-9.0, 9.0), 0.04, random.uniform(-0.03, 0.03), 0.03});
    const double bearing = random.uniform(-kPi, kPi);
    readings.push_back({reading_terms({0, random.uniform(1.0, 9.0), bearing}, sensor), &landmark});
  }
  const Matrix3 Q = Vector3(0.01, 0.02, 0.5).asDiagonal();
  const Matrix3 L = semidefinite_root(Q);
  const test::PoseTarget target(predicted, Q, sensor.body_from_sensor, readings);
  SensorColumns bodies(kParticles);
  PoseColumns poses(kParticles);
  place(predicted, TripleColumns(kParticles), {}, {0, padded(kParticles)}, poses, bodies);
  SwarmColumns swarm(kParticles);
  const NearReadings near(readings, bodies.origin);
  start_swarm(
      {near, bodies, L, L.inverse(), 3.0 * L.rowwise().norm(), sensor_at({}, sensor.body_from_sensor), true},
      n, {0, padded(kParticles)}, swarm);
  for (std::size_t i = 0; i < kParticles; ++i) {
    const test::PoseTarget::Value value = target.at(i, target.clamped(n.at(i)));
    EXPECT_NEAR(swarm.value[i], value.log_density, tolerance * std::abs(value.log_density));
    EXPECT_NEAR(swarm.best_agreement[i], value.agreement, tolerance);
  }
}

/// Poses of the particles, and a landmark, after a run on one instruction set.
struct Outcome {
  std::vector<Pose2> poses;
  Vector2 landmark;
};

Outcome outcome_of(const test::SlamWorld& world, const ParticleSlamOptions& options, std::int64_t target) {
  hwy::SetSupportedTargetsForTest(target);
  ParticleSlam filter(world.sensor, options);
  for (const SlamStep& step : world.steps) filter.step(step.motion, step.observations);
  hwy::SetSupportedTargetsForTest(0);
  return {filter.poses(), filter.landmark(3).position};
}

void expect_same_everywhere(const test::SlamWorld& world, const ParticleSlamOptions& options) {
  const std::vector<std::int64_t> targets = hwy::SupportedAndGeneratedTargets();
  const Outcome first = outcome_of(world, options, targets.front());
  for (const std::int64_t target : targets) {
    const Outcome other = outcome_of(world, options, target);
    EXPECT_EQ(other.landmark, first.landmark);
    for (std::size_t i = 0; i < options.particles; ++i) {
      EXPECT_EQ(other.poses[i].x, first.poses[i].x);
      EXPECT_EQ(other.poses[i].heading, first.poses[i].heading);
    }
  }
}

TEST(Lanes, EveryInstructionSetGivesTheSameBytes) {
  test::SlamWorld world = test::slam_world({.steps = test::kSanitizers ? 15 : 60});
  const ParticleSlamOptions base{.particles = 70};
  for (const Proposal proposal : {Proposal::motion, Proposal::linearised, Proposal::swarm_gaussian}) {
    ParticleSlamOptions options = base;
    options.proposal = proposal;
    expect_same_everywhere(world, options);
  }
  ParticleSlamOptions until_they_agree = base;
  until_they_agree.proposal = Proposal::swarm;
  until_they_agree.swarm.target_agreement = 0.5;
  expect_same_everywhere(world, until_they_agree);
  for (SlamStep& step : world.steps)
    for (Observation& observation : step.observations) observation.landmark = kUnknownLandmark;
  expect_same_everywhere(world, base);
}

}  // namespace
}  // namespace trundle::slam
