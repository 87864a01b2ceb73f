// What every filter promises: its state can be stored after any step, and nothing that it is shown breaks it.
#include <cmath>
#include <limits>
#include <set>

#include <gtest/gtest.h>

#include "trundle/io/archive.hpp"
#include "trundle/io/error.hpp"
#include "trundle/slam/slam.hpp"

#include "scale.hpp"
#include "slam/every_method.hpp"
#include "slam/world.hpp"

namespace trundle::slam {
namespace {

class EveryFilter : public testing::TestWithParam<SlamMethod> {
 protected:
  SlamOptions options() const {
    return {.method = GetParam(),
            .particles = 23,
            .seed = 4,
            .prior = {.systematic_sigma = Systematic::Constant(3, 0.02)}};
  }
};

void hide_names(test::SlamWorld& world) {
  for (SlamStep& step : world.steps)
    for (Observation& observation : step.observations) observation.landmark = kUnknownLandmark;
}

void expect_finite(const SlamFilter& filter) {
  const PoseEstimate estimate = filter.estimate();
  ASSERT_TRUE(std::isfinite(estimate.pose.x + estimate.pose.y + estimate.pose.heading));
  ASSERT_TRUE(estimate.covariance.allFinite());
  for (const MappedLandmark& landmark : filter.map())
    ASSERT_TRUE(landmark.position.allFinite() && landmark.covariance.allFinite());
}

TEST_P(EveryFilter, ContinuesFromAStoredStateToTheLastBit) {
  for (const bool named : {true, false}) {
    test::SlamWorld world = test::slam_world({.steps = 160});
    if (!named) hide_names(world);
    for (std::size_t k = 0; k < 160; k += 7) world.steps[k].observations.clear();
    SlamRun uninterrupted(world.sensor, options());
    for (const SlamStep& step : world.steps) uninterrupted.step(step);
    const std::string end = state_of(uninterrupted);
    Random random(5, static_cast<std::uint64_t>(GetParam()));
    for (int trial = 0; trial < 5; ++trial) {
      const std::size_t left_after = random.below(world.steps.size());
      SlamRun first(world.sensor, options());
      for (std::size_t k = 0; k < left_after; ++k) first.step(world.steps[k]);
      SlamRun second(world.sensor, options());
      resume_state(second, state_of(first));
      ASSERT_EQ(second.steps(), left_after);
      for (std::size_t k = left_after; k < world.steps.size(); ++k) second.step(world.steps[k]);
      EXPECT_TRUE(state_of(second) == end) << "left after " << left_after << ", named " << named;
    }
  }
}

// Who reads a map holds its landmarks' covariances against the joint one.
TEST_P(EveryFilter, GivesOneCovarianceOfEachLandmark) {
  const test::SlamWorld world = test::slam_world({.steps = 160});
  SlamRun run(world.sensor, options());
  for (const SlamStep& step : world.steps) run.step(step);
  const SlamResult result = run.result();
  ASSERT_FALSE(result.map.empty());
  if (has_particles(GetParam())) {
    EXPECT_EQ(result.map_covariance.size(), 0);
    return;
  }
  for (std::size_t i = 0; i < result.map.size(); ++i) {
    const auto at = 2 * static_cast<Eigen::Index>(i);
    const Matrix2 joint = result.map_covariance.block<2, 2>(at, at);
    EXPECT_LE((joint - result.map[i].covariance).norm(), 1e-12 * joint.norm()) << "landmark " << i;
  }
}

// An innovation is that of a landmark seen before: where there is none, no mean of them is 0.
TEST_P(EveryFilter, HasNoMeanNisWhereEachLandmarkIsSeenOnce) {
  const test::SlamWorld world = test::slam_world({.steps = 60});
  SlamInput input;
  input.steps = world.steps;
  const SlamCounts often = slam(input, world.sensor, options()).counts;
  EXPECT_GT(often.matched, 0U);
  EXPECT_GT(often.mean_nis, 0.0);
  EXPECT_GT(often.median_nis, 0.0);
  std::set<LandmarkId> seen;
  for (SlamStep& step : input.steps)
    std::erase_if(step.observations, [&](const Observation& o) { return !seen.insert(o.landmark).second; });
  const SlamCounts once = slam(input, world.sensor, options()).counts;
  EXPECT_EQ(once.created, seen.size());
  EXPECT_EQ(once.matched + once.rejected, 0U);
  EXPECT_FALSE(once.mean_nis);
  EXPECT_FALSE(once.median_nis);
}

TEST_P(EveryFilter, SurvivesNonsense) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<Observation> nonsense = {
      {0, kNan, 0.0},   {0, -1.0, 0.0},
      {1, 2.0, kNan},   {kUnknownLandmark, 2.0, 1.0},
      {-77, 2.0, 1.0},  {2, 0.0, 0.0},
      {0, 1e308, 0.0},  {1, 1e-300, 0.0},
      {3, 3.0, 1.0},    {3, 3.0, 1.0},
      {3, 3.0, 1.0},    {4, std::numeric_limits<double>::infinity(), 0.0},
      {99, 2.0, 100.0}, {kUnknownLandmark, kNan, 1.0}};
  const test::SlamWorld world = test::slam_world({.steps = 40});
  SlamFilter filter(world.sensor, options());
  filter.step({}, nonsense);
  for (const SlamStep& step : world.steps) {
    filter.step(step.motion, step.observations);
    const StepReport& report = filter.step(step.motion, nonsense);
    ASSERT_EQ(report.observations.size(), nonsense.size());
    for (const std::size_t i : {0U, 1U, 2U, 5U, 6U, 7U, 11U, 13U})
      EXPECT_EQ(report.observations[i].decision, Decision::invalid) << i;
    expect_finite(filter);
  }
}

TEST_P(EveryFilter, SurvivesSensorsThatClaimTheImpossible) {
  // Readings that err by far more than their sigmas, down to where single precision ends.
  for (const double range_sigma_m : {1e-9, 1e-6, 1e-3})
    for (const double bearing_sigma_rad : {1e-9, 1e-6, 1e-2}) {
      test::SlamWorld world = test::slam_world({.steps = 30});
      world.sensor.range_sigma_m = range_sigma_m;
      world.sensor.bearing_sigma_rad = bearing_sigma_rad;
      SlamFilter filter(world.sensor, options());
      for (const SlamStep& step : world.steps) {
        filter.step(step.motion, step.observations);
        expect_finite(filter);
      }
    }
}

TEST_P(EveryFilter, SurvivesALandmarkAtTheSensor) {
  SlamFilter filter(test::slam_world({.steps = 1}).sensor, options());
  const Motion still = motion_of({}, 1e-6 * Matrix3::Identity());
  Random random(4);
  for (int k = 0; k < 200; ++k) {
    filter.step(still, std::vector<Observation>{{0, 2e-6, random.uniform(-kPi, kPi)}});
    expect_finite(filter);
  }
}

TEST_P(EveryFilter, SurvivesSightingsThatAreAllWrong) {
  const test::SlamWorld world = test::slam_world({.steps = 150});
  Random random(9);
  SlamFilter filter(world.sensor, options());
  for (const SlamStep& step : world.steps) {
    std::vector<Observation> wrong = step.observations;
    for (Observation& observation : wrong) {
      observation.range_m = random.uniform(0.1, 8.0);
      observation.bearing_rad = random.uniform(-kPi, kPi);
    }
    filter.step(step.motion, wrong);
    expect_finite(filter);
  }
}

TEST_P(EveryFilter, KnowsThatItKnowsLessWhenNothingIsSeenForLong) {
  const test::SlamWorld world = test::slam_world({.steps = 60});
  SlamFilter filter(world.sensor, options());
  for (const SlamStep& step : world.steps) filter.step(step.motion, step.observations);
  const double sure = filter.estimate().covariance.trace();
  for (int k = 0; k < 10'000; ++k) filter.step(world.steps[0].motion, {});
  EXPECT_GT(filter.estimate().covariance.trace(), 100.0 * sure);
  for (int k = 0; k < 5; ++k) filter.step(world.steps[0].motion, world.steps[0].observations);
  expect_finite(filter);
}

TEST_P(EveryFilter, OneParticleIsEnoughToRun) {
  const test::SlamWorld world = test::slam_world({.steps = 60});
  SlamOptions one = options();
  one.particles = 1;
  SlamFilter filter(world.sensor, one);
  for (const SlamStep& step : world.steps) filter.step(step.motion, step.observations);
  expect_finite(filter);
}

TEST_P(EveryFilter, NeedsAParticleIfItHasAny) {
  SlamOptions none = options();
  none.particles = 0;
  if (!has_particles(GetParam()))
    EXPECT_NO_THROW(SlamFilter(LandmarkSensor{}, none));
  else
    EXPECT_THROW(SlamFilter(LandmarkSensor{}, none), InputError);
}

/// Those that remember no past pose, and take sightings without names.
class EveryRecursiveFilter : public EveryFilter {};

// The state holds all that a filter remembers: where its bytes do not grow, nothing does.
TEST_P(EveryRecursiveFilter, DoesNotGrowInAMillionSteps) {
  const test::SlamWorld world = test::slam_world({.steps = 63});  // once around, roughly
  SlamOptions small = options();
  small.particles = 4;
  small.keep_paths = false;
  SlamFilter filter(world.sensor, small);
  const int steps = test::trials(1'000'000, 20'000);
  // Counters of the ancestors' generations come and go by a few runs of particles.
  constexpr std::size_t kMore = 4096;
  std::size_t after_a_while = 0;
  for (int k = 0; k < steps; ++k) {
    const SlamStep& step = world.steps[static_cast<std::size_t>(k) % world.steps.size()];
    const bool looks = k % 40 == 0;
    filter.step(step.motion, looks ? std::span(step.observations) : std::span<const Observation>());
    if (k == steps / 10) after_a_while = state_of(filter).size();
  }
  EXPECT_LT(state_of(filter).size(), after_a_while + kMore);
  expect_finite(filter);
}

// The robot circles among its landmarks with one spurious sighting at each look. Were none of those ever
// given up, there would be as many landmarks as looks.
TEST_P(EveryRecursiveFilter, DoesNotGrowByWhatIsSpurious) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  test::SlamWorld world = test::slam_world({.steps = 63, .landmarks = 10});
  hide_names(world);
  SlamOptions small = options();
  small.keep_paths = false;
  small.prior = {};
  SlamFilter filter(world.sensor, small);
  Random random(11);
  const int steps = test::trials(20'000, 4'000);
  std::size_t first_half_bytes = 0, second_half_bytes = 0, most_landmarks = 0;
  double told = 0.0, times = 0.0;
  for (int k = 0; k < steps; ++k) {
    const SlamStep& step = world.steps[static_cast<std::size_t>(k) % world.steps.size()];
    std::vector<Observation> seen = step.observations;
    seen.push_back({kUnknownLandmark, world.sensor.max_range_m * std::sqrt(random.uniform()),
                    random.uniform(-kPi, kPi)});
    filter.step(step.motion, seen);
    if (k % 50 != 0) continue;
    std::size_t& most_bytes = 2 * k < steps ? first_half_bytes : second_half_bytes;
    most_bytes = std::max(most_bytes, state_of(filter).size());
    most_landmarks = std::max(most_landmarks, filter.map().size() + filter.tentative().size());
    if (2 * k < steps) continue;
    told += static_cast<double>(filter.map().size());
    times += 1.0;
  }
  EXPECT_LT(static_cast<double>(second_half_bytes), 1.25 * static_cast<double>(first_half_bytes));
  EXPECT_LT(most_landmarks, 120U);
  // A landmark that was just missed may be tentative for a moment.
  EXPECT_NEAR(told / times, static_cast<double>(world.landmarks.size()), 1.0);
}

std::string test_name(const testing::TestParamInfo<SlamMethod>& test) {
  return std::string(name_of(test.param));
}

/// But for the smoother, which keeps all that it was given: its state grows with the way.
std::vector<SlamMethod> recursive_methods() {
  std::vector<SlamMethod> methods = test::every_method();
  std::erase(methods, SlamMethod::smoother);
  return methods;
}

INSTANTIATE_TEST_SUITE_P(, EveryFilter, testing::ValuesIn(test::every_method()), test_name);
INSTANTIATE_TEST_SUITE_P(, EveryRecursiveFilter, testing::ValuesIn(recursive_methods()), test_name);

}  // namespace
}  // namespace trundle::slam
