#include "trundle/slam/consistency_checks.hpp"

#include <numbers>

#include <gmock/gmock.h>

#include "slam/world.hpp"

namespace trundle::slam {
namespace {

SlamInput input_of(const test::SlamWorld& world) {
  SlamInput input;
  input.steps = world.steps;
  for (std::size_t k = 0; k < input.steps.size(); ++k) input.steps[k].time_s = static_cast<double>(k);
  return input;
}

std::vector<Finding> findings_of(const test::SlamWorld& world) {
  const SlamInput input = input_of(world);
  const SlamResult filtered = slam(input, world.sensor, {.method = SlamMethod::ekf});
  const SmoothedSlam smoothed = smooth(input, world.sensor, filtered);
  return consistency_checks(input, filtered, &smoothed);
}

TEST(ConsistencyChecks, FindNothingInAConsistentRun) {
  EXPECT_TRUE(findings_of(test::slam_world({.steps = 200})).empty());
}

// But for landmarks whose first sighting was one, which the smoother puts right.
TEST(ConsistencyChecks, AcceptOutliersAlone) {
  test::SlamWorld world = test::slam_world({.steps = 400});
  Random random(5);
  for (SlamStep& step : world.steps)
    for (Observation& observation : step.observations)
      if (random.uniform() < 0.1) observation.bearing_rad = random.uniform(-kPi, kPi);
  for (const Finding& finding : findings_of(world)) {
    EXPECT_EQ(finding.code, FindingCode::misplaced_landmark) << describe(finding);
    EXPECT_EQ(finding.severity, Severity::note);
  }
}

TEST(ConsistencyChecks, ReportAFilterThatDiverged) {
  test::SlamWorld world = test::slam_world({.steps = 200});
  for (std::size_t k = 120; k < 200; ++k)  // someone has turned the sensor
    for (Observation& observation : world.steps[k].observations) observation.bearing_rad += 1.0;
  const std::vector<Finding> findings = findings_of(world);
  ASSERT_FALSE(findings.empty());
  EXPECT_EQ(findings.front().code, FindingCode::lost);
  EXPECT_THAT(describe(findings.front()), testing::StartsWith("from 120.0 s to "));
}

/// The same with names for its landmarks.
SlamInput named_input_of(const test::SlamWorld& world) {
  SlamInput input = input_of(world);
  for (std::size_t i = 0; i < world.landmarks.size(); ++i)
    input.landmarks.push_back("post " + std::to_string(i));
  return input;
}

/// Of what is seen in the first instant the furthest is read so much too far away.
LandmarkId misread_furthest(double by_m, SlamInput& input) {
  Observation& wrong = *std::ranges::max_element(input.steps.front().observations, {}, &Observation::range_m);
  wrong.range_m += by_m;
  return wrong.landmark;
}

// An extended Kalman filter never moves a landmark from where its first sighting put it, if no later one
// passes the gate. All others fit: the filter is not lost, and that one landmark is named.
TEST(ConsistencyChecks, NameTheLandmarkWhoseFirstSightingWasWrong) {
  for (const std::uint64_t seed : {1, 2, 3, 4, 5}) {
    const test::SlamWorld world = test::slam_world({.steps = 200, .seed = seed});
    SlamInput input = named_input_of(world);
    const SlamOptions ekf{.method = SlamMethod::ekf};
    const SlamResult clean = slam(input, world.sensor, ekf);
    const SmoothedSlam clean_smoothed = smooth(input, world.sensor, clean);
    EXPECT_TRUE(consistency_checks(input, clean, nullptr).empty()) << seed;
    EXPECT_TRUE(consistency_checks(input, clean, &clean_smoothed).empty()) << seed;
    const LandmarkId wrong = misread_furthest(1.0, input);
    const SlamResult filtered = slam(input, world.sensor, ekf);
    const std::vector<Finding> findings = consistency_checks(input, filtered, nullptr);
    ASSERT_EQ(findings.size(), 1U) << seed;
    EXPECT_EQ(findings.front().code, FindingCode::misplaced_landmark);
    EXPECT_EQ(findings.front().severity, Severity::warning);
    const std::string name = "post " + std::to_string(wrong);
    EXPECT_THAT(findings.front().subjects, testing::ElementsAre(name));
    EXPECT_THAT(describe(findings.front()), testing::HasSubstr(name + "'"));
    // The smoother takes all sightings of it: that its filter was wrong is only good to know.
    const SmoothedSlam smoothed = smooth(input, world.sensor, filtered);
    const std::vector<Finding> after = consistency_checks(input, filtered, &smoothed);
    ASSERT_EQ(after.size(), 1U) << seed;
    EXPECT_EQ(after.front().code, FindingCode::misplaced_landmark);
    EXPECT_EQ(after.front().severity, Severity::note);
  }
}

TEST(ConsistencyChecks, DoNotDoubtASmootherWhoseFilterAloneWasLost) {
  const test::SlamWorld world = test::slam_world({.steps = 200});
  const SlamInput input = input_of(world);
  SlamResult filtered = slam(input, world.sensor, {.method = SlamMethod::ekf});
  const SmoothedSlam smoothed = smooth(input, world.sensor, filtered);
  for (std::size_t k = 120; k < 200; ++k)
    for (ObservationReport& report : filtered.reports[k].observations) report.decision = Decision::rejected;
  EXPECT_EQ(consistency_checks(input, filtered, nullptr).front().severity, Severity::warning);
  const std::vector<Finding> findings = consistency_checks(input, filtered, &smoothed);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings.front().code, FindingCode::lost);
  EXPECT_EQ(findings.front().severity, Severity::note);
}

TEST(ConsistencyChecks, ReportSigmasThatAreTooSmall) {
  test::SlamWorld world = test::slam_world({.steps = 200});
  world.sensor.range_sigma_m /= 2.5;
  world.sensor.bearing_sigma_rad /= 2.5;
  const std::vector<Finding> findings = findings_of(world);
  ASSERT_FALSE(findings.empty());
  EXPECT_EQ(findings.back().code, FindingCode::noise);
}

/// A world whose readings are all off by two sigmas of one.
test::SlamWorld world_seen_askew() {
  test::SlamWorld world = test::slam_world({.steps = 200});
  for (SlamStep& step : world.steps)
    for (Observation& observation : step.observations) {
      observation.range_m += 2.0 * world.sensor.range_sigma_m;
      observation.bearing_rad -= 2.0 * world.sensor.bearing_sigma_rad;
    }
  return world;
}

void expect_range_offset(const std::vector<Finding>& findings, const test::SlamWorld& world) {
  const auto found = std::ranges::find(findings, FindingCode::range_offset, &Finding::code);
  ASSERT_NE(found, findings.end());
  const auto range = std::get<payload::Offset>(found->payload);
  EXPECT_NEAR(range.value, 2.0 * world.sensor.range_sigma_m, 4.0 * range.sigma);
  EXPECT_THAT(describe(*found), testing::HasSubstr("sensor.range_offset"));
}

TEST(ConsistencyChecks, ReportReadingsThatAreOffInCommon) {
  const test::SlamWorld world = world_seen_askew();
  expect_range_offset(findings_of(world), world);
}

// The smoother that goes along has seen as much in the end.
TEST(ConsistencyChecks, OfTheOnlineSmootherAloneAreThoseOfAllThatItSaw) {
  const auto findings_online = [](const test::SlamWorld& world, std::optional<double> window_s) {
    const SlamInput input = input_of(world);
    return consistency_checks(
        input, slam(input, world.sensor, {.method = SlamMethod::smoother, .window_s = window_s}), nullptr);
  };
  for (const std::uint64_t seed : {1, 2, 3, 4, 5})
    EXPECT_TRUE(findings_online(test::slam_world({.steps = 200, .seed = seed}), {}).empty()) << seed;
  const test::SlamWorld askew = world_seen_askew();
  expect_range_offset(findings_online(askew, {}), askew);
  // Of what a window has forgotten nothing can be said; what is left is judged by its innovations.
  for (const Finding& finding : findings_online(askew, 20.0)) EXPECT_EQ(finding.code, FindingCode::noise);
}

// Half of N squares of two normal numbers are above 2 ln 2 ± 2/√N.
TEST(ConsistencyChecks, OfInnovationsAloneKnowChanceFromSigmasThatAreTooSmall) {
  const double consistent = 2.0 * std::numbers::ln2;
  EXPECT_TRUE(innovation_checks(std::nullopt, 0).empty());
  EXPECT_TRUE(innovation_checks(1.4 * consistent, 100'000).empty());
  EXPECT_TRUE(innovation_checks(2.5 * consistent, 30).empty());
  ASSERT_EQ(innovation_checks(2.5 * consistent, 40).size(), 1U);
  EXPECT_EQ(innovation_checks(1.6 * consistent, 1000).front().code, FindingCode::noise);
}

TEST(ConsistencyChecks, OfARecursiveFilterReportSigmasThatAreTooSmall) {
  for (const SlamMethod method : {SlamMethod::ekf, SlamMethod::fastslam2}) {
    test::SlamWorld world = test::slam_world({.steps = 200});
    const SlamInput input = input_of(world);
    EXPECT_TRUE(consistency_checks(input, slam(input, world.sensor, {.method = method}), nullptr).empty());
    world.sensor.range_sigma_m /= 1.5;
    world.sensor.bearing_sigma_rad /= 1.5;
    const std::vector<Finding> findings =
        consistency_checks(input, slam(input, world.sensor, {.method = method}), nullptr);
    ASSERT_EQ(findings.size(), 1U) << name_of(method);
    EXPECT_EQ(findings.front().code, FindingCode::noise);
  }
}

/// Whether readings as a camera's are found to be, where sigmas are as large as said.
const Finding* depths_in(std::vector<Finding>& findings) {
  const auto at = std::ranges::find(findings, FindingCode::depths, &Finding::code);
  return at == findings.end() ? nullptr : &*at;
}

TEST(ConsistencyChecks, ReportDepthsForDistancesHoweverLargeTheSigmasAre) {
  test::SlamWorld world = test::slam_world({.steps = 200});
  for (SlamStep& step : world.steps)
    std::erase_if(step.observations, [](const Observation& o) { return std::abs(o.bearing_rad) > 1.0; });
  std::vector<Finding> none = findings_of(world);
  EXPECT_EQ(depths_in(none), nullptr);
  for (SlamStep& step : world.steps)
    for (Observation& observation : step.observations)
      observation.range_m *= std::cos(observation.bearing_rad);
  for (const double larger : {1.0, 5.0}) {
    world.sensor.range_sigma_m *= larger;
    world.sensor.bearing_sigma_rad *= larger;
    std::vector<Finding> findings = findings_of(world);
    const Finding* depths = depths_in(findings);
    ASSERT_NE(depths, nullptr) << larger;
    EXPECT_NEAR(std::get<payload::Offset>(depths->payload).value, 1.0, 0.3);
    EXPECT_THAT(describe(*depths), testing::HasSubstr("sensor.depth_share"));
  }
}

TEST(ConsistencyChecks, ReportASmootherThatContradictsItsFilter) {
  const test::SlamWorld world = test::slam_world({.steps = 200});
  const SlamInput input = input_of(world);
  const SlamResult filtered = slam(input, world.sensor, {.method = SlamMethod::ekf});
  SmoothedSlam smoothed = smooth(input, world.sensor, filtered);
  for (StampedPose& stamped : smoothed.trajectory.poses) stamped.pose.x += 1.0;
  const std::vector<Finding> findings = consistency_checks(input, filtered, &smoothed);
  ASSERT_FALSE(findings.empty());
  EXPECT_EQ(findings.front().code, FindingCode::smoother_contradicts);
}

}  // namespace
}  // namespace trundle::slam
