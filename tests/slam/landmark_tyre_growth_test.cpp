// Calibration from sightings of robots on tyres that grow with their speed.
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "trundle/slam/smoothing/landmark_calibration.hpp"

#include "calibration/simulated_runs.hpp"
#include "scale.hpp"

namespace trundle::slam {
namespace {

constexpr Parameter kTyreGrowth{ParameterKind::tyre_growth, -1};

Robot growing_robot(double tyre_growth_s2_m2) {
  Robot robot = test::nominal_differential();
  robot.chassis.tyre_growth_s2_m2 = tyre_growth_s2_m2;
  robot.landmark_sensor = LandmarkSensor{{0.1, 0.0, 0.0}, 0.05, radians(1.0), 6.0, 0.0};
  return robot;
}

/// Tours among the same landmarks, a slow one and a fast one.
std::vector<Recording> slow_and_fast(double tyre_growth_s2_m2, std::uint64_t seed) {
  std::vector<Recording> recordings;
  Random landmarks(seed, 52);
  const std::vector<Landmark> map = random_landmarks(12, 8.0, 8.0, 1.0, landmarks);
  for (const double speed : {0.3, 1.5}) {
    Random tour(seed, 51);
    const Path path = random_tour({.length_m = 60.0, .box_x_m = 6.0, .box_y_m = 6.0}, {}, tour,
                                  {.forward_m_s = speed, .turn_rad_s = 2.0 * speed});
    Scenario scenario = test::scenario_of(growing_robot(0.0), growing_robot(tyre_growth_s2_m2), path, seed);
    scenario.encoders.rate_hz = 20.0;
    scenario.reference.rate_hz = 0.0;
    scenario.landmarks = map;
    scenario.sightings = {.rate_hz = 4.0, .give_map = false};
    recordings.push_back(simulate(scenario).recording);
    recordings.back().name = speed < 1.0 ? "slow" : "fast";
    recordings.back().session = "one";
  }
  return recordings;
}

TEST(LandmarkTyreGrowth, IsFoundWithinItsInterval) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const int robots = test::trials(10, 2);
  double sum = 0.0;
  for (int i = 0; i < robots; ++i) {
    const CalibrationResult result =
        calibrate_from_landmarks(slow_and_fast(0.01, static_cast<std::uint64_t>(i)), {}, growing_robot(0.0),
                                 {.free = {"tyre_growth"}, .fix = {"sensor.range_scale"}});
    const ParameterEstimate& growth =
        *std::ranges::find(result.parameters, kTyreGrowth, &ParameterEstimate::parameter);
    ASSERT_TRUE(growth.observable);
    EXPECT_LT(growth.sigma_within, 0.002);
    const double off = (growth.value - 0.01) / growth.sigma_within;
    EXPECT_LT(std::abs(off), 4.0);
    sum += off;
  }
  RecordProperty("mean", std::to_string(sum / robots));
  EXPECT_LT(std::abs(sum), 3.0 * std::sqrt(robots));
}

}  // namespace
}  // namespace trundle::slam
