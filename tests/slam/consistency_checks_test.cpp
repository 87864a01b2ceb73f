#include "trundle/slam/consistency_checks.hpp"

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

TEST(ConsistencyChecks, AcceptOutliersAlone) {
  test::SlamWorld world = test::slam_world({.steps = 400});
  Random random(5);
  for (SlamStep& step : world.steps)
    for (Observation& observation : step.observations)
      if (random.uniform() < 0.1) observation.bearing_rad = random.uniform(-kPi, kPi);
  EXPECT_TRUE(findings_of(world).empty());
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

TEST(ConsistencyChecks, ReportReadingsThatAreOffInCommon) {
  test::SlamWorld world = test::slam_world({.steps = 200});
  for (SlamStep& step : world.steps)
    for (Observation& observation : step.observations) {
      observation.range_m += 2.0 * world.sensor.range_sigma_m;
      observation.bearing_rad -= 2.0 * world.sensor.bearing_sigma_rad;
    }
  const std::vector<Finding> findings = findings_of(world);
  const auto found = [&](FindingCode code) { return std::ranges::find(findings, code, &Finding::code); };
  ASSERT_NE(found(FindingCode::range_offset), findings.end());
  const auto range = std::get<payload::Offset>(found(FindingCode::range_offset)->payload);
  EXPECT_NEAR(range.value, 2.0 * world.sensor.range_sigma_m, 4.0 * range.sigma);
  EXPECT_THAT(describe(*found(FindingCode::range_offset)), testing::HasSubstr("sensor.range_offset"));
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
