// What both localizers promise: their state can be stored after any step, and nothing that they are shown
// breaks them.
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>
#include <fmt/core.h>
#include <gtest/gtest.h>

#include "trundle/io/archive.hpp"
#include "trundle/io/error.hpp"
#include "trundle/statistics/distribution.hpp"
#include "trundle/statistics/random.hpp"

#include "scale.hpp"
#include "slam/field.hpp"

namespace trundle::slam {
namespace {

class EveryLocalizer : public testing::TestWithParam<LocalizerFilter> {
 protected:
  LocalizerOptions options() const { return {.filter = GetParam(), .particles = {.most = 500}, .seed = 4}; }
  /// Knows where it is.
  Localizer at_home(const test::Field& field) const {
    LocalizerOptions known = options();
    known.start.emplace();
    known.start->pose = field.truth();
    return {field.map(), field.sensor(), known};
  }
};

const LocalizerReport& take_step(test::Field& field, Localizer& localizer) {
  const SlamStep step = field.step(true);
  return localizer.step(step.motion, step.observations);
}

void expect_finite(const Localizer& localizer) {
  const auto estimate = localizer.estimate();
  if (!estimate) return;
  ASSERT_TRUE(std::isfinite(estimate->pose.x + estimate->pose.y + estimate->pose.heading));
  ASSERT_TRUE(estimate->covariance.allFinite());
}

/// Readings anywhere in sight.
void garble(std::vector<Observation>& observations, Random& random) {
  for (Observation& observation : observations) {
    observation.range_m = random.uniform(0.5, 8.0);
    observation.bearing_rad = random.uniform(-kPi, kPi);
  }
}

// A turn about the only landmark changes none of its sightings: what is known of it is what the start was
// known to, however often the landmark is seen, from wherever. By the odometry, which is exact, it stays.
TEST_P(EveryLocalizer, OneLandmarkNeverTellsHowTheRobotStandsAboutIt) {
  const LandmarkSensor sensor{{0.15, 0.05, 0.0}, 0.03, radians(1.5), 9.0, 0.0};
  const Vector2 landmark(2.0, 1.0);
  const KnownMap map({{.position = landmark}}, 18.0);
  const Vector3 sigma(1.0, 1.0, radians(20.0));
  const auto information = [&](const PoseEstimate& estimate) {
    const Vector2 lever = estimate.pose.translation() - landmark;
    const Vector3 turn(-lever.y(), lever.x(), 1.0);
    return turn.dot(estimate.covariance.ldlt().solve(turn));
  };
  for (int seed = 1; seed <= test::trials(40); ++seed) {
    Random random(static_cast<std::uint64_t>(seed), 17);
    LocalizerOptions vague = options();
    vague.start.emplace();
    vague.start->pose = {random.normal(), random.normal(), random.normal(radians(10.0))};
    vague.start->covariance = sigma.cwiseAbs2().asDiagonal();
    const double known = information(*vague.start);
    Localizer localizer(map, sensor, vague);
    Pose2 truth;
    for (int k = 0; k < 300; ++k) {
      const Motion motion = motion_of({0.05, 0.0, 0.05 * std::sin(0.05 * k)}, Matrix3::Zero());
      truth = truth * motion.mean;
      const Vector2 ahead = (truth * sensor.body_from_sensor).inverse() * landmark;
      const Observation seen{
          0, ahead.norm() + random.normal(sensor.range_sigma_m),
          wrap_angle(std::atan2(ahead.y(), ahead.x()) + random.normal(sensor.bearing_sigma_rad))};
      localizer.step(motion, std::span(&seen, 1));
    }
    ASSERT_TRUE(localizer.estimate()) << seed;
    EXPECT_NEAR(information(*localizer.estimate()) / known, 1.0, 0.02) << seed;
  }
}

/// A start as vague as it may be beside accurate sightings, of which a straight line knows nothing.
TEST_P(EveryLocalizer, IsAsSureOfItsPoseAsItMayBeAfterAVagueStart) {
  const int seeds = test::trials(100);
  const Vector3 sigma(0.5, 0.5, radians(10.0));
  double all = 0.0;
  int steps = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    Random random(static_cast<std::uint64_t>(seed));
    test::Field field({.outlier_share = 0.0,
                       .seen_at_once = 6,
                       .range_sigma_m = 0.05,
                       .bearing_sigma_rad = 0.02,
                       .seed = static_cast<std::uint64_t>(seed)});
    LocalizerOptions vague = options();
    vague.seed = static_cast<std::uint64_t>(seed);
    vague.particles.most = 5000;
    vague.start.emplace();
    vague.start->covariance = sigma.cwiseAbs2().asDiagonal();
    vague.start->pose = {field.truth().x + random.normal(sigma.x()),
                         field.truth().y + random.normal(sigma.y()),
                         field.truth().heading + random.normal(sigma.z())};
    Localizer localizer(field.map(), field.sensor(), vague);
    double sum = 0.0;
    int known = 0;
    for (int k = 0; k < 30; ++k) {
      take_step(field, localizer);
      const auto estimate = localizer.estimate();
      if (!estimate) continue;
      const Vector3 e = difference(field.truth(), estimate->pose);
      sum += e.dot(estimate->covariance.ldlt().solve(e));
      ++known;
    }
    EXPECT_EQ(known, 30) << seed;
    all += sum / std::max(1, known);
    ++steps;
  }
  // The mean over a drive of one is spread like χ² of three degrees of freedom at most.
  const double nees = all / steps;
  RecordProperty("nees", fmt::format("{}", nees));
  fmt::print("  NEES {:.2f}\n", nees);
  EXPECT_NEAR(nees, 3.0, normal_limit(1e-3) * std::sqrt(6.0 / seeds));
}

TEST_P(EveryLocalizer, ContinuesFromAStoredStateToTheLastBit) {
  for (const bool named : {true, false}) {
    test::Field field({.seed = 2});
    std::vector<SlamStep> steps;
    for (int k = 0; k < 600; ++k) {
      if (k == 300) field.carry_away();  // so that it is searched for twice
      steps.push_back(field.step(named));
    }
    Localizer uninterrupted(field.map(), field.sensor(), options());
    for (const SlamStep& step : steps) uninterrupted.step(step.motion, step.observations);
    Random random(5, static_cast<std::uint64_t>(GetParam()));
    for (int trial = 0; trial < 5; ++trial) {
      const std::size_t left_after = random.below(steps.size());
      Localizer first(field.map(), field.sensor(), options());
      for (std::size_t k = 0; k < left_after; ++k) first.step(steps[k].motion, steps[k].observations);
      Localizer second(field.map(), field.sensor(), options());
      resume_state(second, state_of(first));
      for (std::size_t k = left_after; k < steps.size(); ++k)
        second.step(steps[k].motion, steps[k].observations);
      EXPECT_TRUE(state_of(second) == state_of(uninterrupted))
          << "left after " << left_after << ", named " << named;
    }
  }
}

// What is seen in the first instant alone speaks against it so much that no row of it is ever written.
TEST_P(EveryLocalizer, TakesAStartThatTheFirstSightingsRefute) {
  for (const bool named : {true, false}) {
    test::Field field({.outlier_share = 0.0, .seen_at_once = 12, .seed = 3});
    for (int k = 0; k < 4; ++k) field.step(named);  // the next one sees
    SlamInput input;
    for (int k = 0; k < 100; ++k) input.steps.push_back(field.step(named));
    LocalizerOptions wrong = options();
    wrong.start.emplace();
    wrong.start->pose = {-40.0, -40.0, 2.0};
    const Localization found = localize(input, field.map(), field.sensor(), wrong);
    ASSERT_GE(input.steps.front().observations.size(), 5U);
    ASSERT_FALSE(found.stretches.empty());
    EXPECT_FALSE(found.stretches.back().noticed_s);
    EXPECT_GE(found.trajectory.poses.front().time_s, found.stretches.front().start_s);
    EXPECT_TRUE(test::is_right(PoseEstimate{.pose = found.trajectory.poses.back().pose,
                                            .covariance = found.trajectory.covariances.back()},
                               field.truth()));
  }
}

/// However little is known beforehand, and however sure it is afterwards.
TEST_P(EveryLocalizer, KeepsVariancesAboveZero) {
  test::Field field({.outlier_share = 0.0, .seed = 2});
  LocalizerOptions vague = options();
  vague.start.emplace();
  vague.start->pose = field.truth();
  vague.start->covariance = Vector3(1e20, 1e20, 1e2).asDiagonal();
  Localizer localizer(field.map(), field.sensor(), vague);
  for (int k = 0; k < 200; ++k) {
    SlamStep step = field.step(true);
    step.motion.covariance *= 1e20;
    localizer.step(step.motion, step.observations);
    const auto estimate = localizer.estimate();
    if (!estimate) continue;
    ASSERT_TRUE(estimate->covariance.allFinite()) << k;
    ASSERT_GE(estimate->covariance.diagonal().minCoeff(), 0.0) << k;
  }
}

TEST_P(EveryLocalizer, SurvivesNonsense) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInf = std::numeric_limits<double>::infinity();
  const std::vector<Observation> nonsense = {
      {0, kNan, 0.0},   {0, -1.0, 0.0},     {1, 2.0, kNan}, {-77, 2.0, 1.0},
      {2, 0.0, 0.0},    {1, 1e308, 0.0},    {4, kInf, 0.0}, {kUnknownLandmark, kNan, 1.0},
      {99, 2.0, 100.0}, {3, 1e-300, 0.0},   {0, 2.0, kInf}, {kUnknownLandmark, -2.0, 1.0},
      {99, 2.0, 1.0},   {1'000'000, 2, 1.0}};
  for (const bool known : {true, false}) {
    test::Field field({.seed = 3});
    Localizer localizer = known ? at_home(field) : Localizer(field.map(), field.sensor(), options());
    for (int k = 0; k < 300; ++k) {
      take_step(field, localizer);
      const LocalizerReport& report = localizer.step({}, nonsense);
      ASSERT_EQ(report.observations.size(), nonsense.size());
      for (const ObservationReport& one : report.observations) EXPECT_EQ(one.decision, Decision::invalid);
      expect_finite(localizer);
    }
    EXPECT_TRUE(test::is_right(localizer.estimate(), field.truth()));
  }
}

// The same reading over and over is no more evidence than once.
TEST_P(EveryLocalizer, IsNotPersuadedByDuplicates) {
  for (const bool named : {true, false}) {
    test::Field field({.seed = 5});
    Localizer once(field.map(), field.sensor(), options());
    Localizer often(field.map(), field.sensor(), options());
    for (int k = 0; k < 200 && !often.estimate(); ++k) {
      const SlamStep step = field.step(named);
      std::vector<Observation> repeated;
      for (int times = 0; times < 5; ++times)
        repeated.insert(repeated.end(), step.observations.begin(), step.observations.end());
      const std::size_t hypotheses = once.step(step.motion, step.observations).hypotheses;
      EXPECT_EQ(often.step(step.motion, repeated).hypotheses, hypotheses);
      EXPECT_EQ(once.estimate().has_value(), often.estimate().has_value());
    }
    EXPECT_TRUE(often.estimate());
  }
}

TEST_P(EveryLocalizer, SightingsThatAreAllWrongLeaveItWithoutAPose) {
  test::Field field({.seed = 6});
  Localizer localizer = at_home(field);
  Random random(9);
  int steps_to_notice = 0;
  int known = 0;
  constexpr int kSteps = 6000;
  for (int k = 0; k < kSteps; ++k) {
    SlamStep step = field.step(true);
    garble(step.observations, random);
    localizer.step(step.motion, step.observations);
    expect_finite(localizer);
    known += localizer.estimate() ? 1 : 0;
    if (known == k + 1) steps_to_notice = known;
  }
  EXPECT_LT(steps_to_notice, 50);  // 5 s, 30 sightings
  EXPECT_LT(known, 0.05 * kSteps);
}

TEST_P(EveryLocalizer, KnowsThatItKnowsLessWhenNothingIsSeenForLong) {
  test::Field field({.seed = 7});
  Localizer localizer = at_home(field);
  for (int k = 0; k < 300; ++k) take_step(field, localizer);
  const double sure = localizer.estimate()->covariance.trace();
  for (int k = 0; k < 10'000; ++k) {
    const SlamStep step = field.step(true);
    localizer.step(step.motion, {});
  }
  ASSERT_TRUE(localizer.estimate());
  EXPECT_GT(localizer.estimate()->covariance.trace(), 100.0 * sure);
  for (int k = 0; k < 300; ++k) take_step(field, localizer);
  EXPECT_TRUE(test::is_right(localizer.estimate(), field.truth()));
}

TEST_P(EveryLocalizer, OneParticleIsEnoughToRun) {
  test::Field field({.seed = 8});
  LocalizerOptions one = options();
  one.particles.most = 1;
  one.start.emplace();
  one.start->pose = field.truth();
  Localizer localizer(field.map(), field.sensor(), one);
  std::size_t most = 0;
  for (int k = 0; k < 300; ++k) {
    SlamStep step = field.step(false);
    step.motion.covariance *= 1e3;  // so vague that readings without names may show several landmarks
    most = std::max(most, localizer.step(step.motion, step.observations).particles);
    expect_finite(localizer);
  }
  EXPECT_EQ(most, GetParam() == LocalizerFilter::particles ? 1U : 0U);
}

TEST_P(EveryLocalizer, NeedsAParticleIfItHasAny) {
  const test::Field field({.seed = 8});
  LocalizerOptions none = options();
  none.particles.most = 0;
  if (GetParam() == LocalizerFilter::ekf)
    EXPECT_NO_THROW(Localizer(field.map(), field.sensor(), none));
  else
    EXPECT_THROW(Localizer(field.map(), field.sensor(), none), InputError);
}

// The state holds all that it remembers: where its bytes do not grow, nothing does.
TEST_P(EveryLocalizer, DoesNotGrowInAMillionSteps) {
  test::Field field({.seed = 9});
  LocalizerOptions small = options();
  small.particles.most = 60;
  Localizer localizer(field.map(), field.sensor(), small);
  std::vector<SlamStep> steps;
  for (int k = 0; k < 1000; ++k) steps.push_back(field.step(true));
  const int count = test::trials(1'000'000, 20'000);
  // So many particles, and points of the constellation, may come and go.
  const std::size_t most =
      state_of(localizer).size() + 60 * 5 * sizeof(double) + 24 * 9 * sizeof(double) + 4096;
  for (int k = 0; k < count; ++k) {
    const SlamStep& step = steps[static_cast<std::size_t>(k) % steps.size()];
    const bool looks = k % 40 == 4;
    localizer.step(step.motion, looks ? std::span(step.observations) : std::span<const Observation>());
    if (k % 1000 == 0) {
      ASSERT_LT(state_of(localizer).size(), most) << k;
    }
  }
  expect_finite(localizer);
}

INSTANTIATE_TEST_SUITE_P(, EveryLocalizer, testing::Values(LocalizerFilter::ekf, LocalizerFilter::particles),
                         [](const auto& test) { return std::string(name_of(test.param)); });

}  // namespace
}  // namespace trundle::slam
