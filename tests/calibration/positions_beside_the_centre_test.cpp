// References of positions alone, of a sensor that goes round the robot's centre where the robot turns.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "trundle/calibration/calibrate.hpp"

#include "calibration/simulated_runs.hpp"

namespace trundle::calibration {
namespace {

Robot with_sensor_beside(Robot robot, double distance_m, double azimuth_rad) {
  robot.chassis.noise.wheel_per_sqrt_m = 0.001;
  robot.body_from_reference = {distance_m * std::cos(azimuth_rad), distance_m * std::sin(azimuth_rad), 0.0};
  return robot;
}

std::vector<Recording> turns_both_ways(const Robot& nominal, const Robot& truth) {
  std::vector<Recording> recordings;
  for (const double sense : {1.0, -1.0, 1.0, -1.0}) {
    Scenario scenario = test::scenario_of(nominal, truth, simulation::turn_on_the_spot(sense * 4.0 * kPi),
                                          50 + static_cast<std::uint64_t>(recordings.size()));
    scenario.encoders.rate_hz = scenario.reference.rate_hz = 20.0;
    scenario.reference.with_heading = false;
    recordings.push_back(simulate(scenario).recording);
    recordings.back().name = "run " + std::to_string(recordings.size());
    recordings.back().session = "one";
  }
  return recordings;
}

/// Where the sensor goes first is not where the robot looks: by that the heading at the start was off, and
/// with it the weight of all that follows.
TEST(PositionsBesideTheCentre, ShowTheTrackWhereverTheirSensorIs) {
  for (const double distance_m : {0.2, 1.0}) {
    std::vector<double> sigma_m;
    for (const double azimuth_deg : {0.0, 60.0, 120.0, 180.0}) {
      const double azimuth_rad = radians(azimuth_deg);
      const Robot nominal = with_sensor_beside(test::nominal_differential(), distance_m, azimuth_rad);
      const Robot truth = with_sensor_beside(test::true_differential(), distance_m, azimuth_rad);
      Robot given = nominal;  // turns alone do not tell the track from the diameters
      for (int i = 0; i < 2; ++i) {
        const Parameter diameter{ParameterKind::diameter, i};
        set_value(diameter, value_of(diameter, truth), given);
      }
      const CalibrationResult result =
          calibrate(turns_both_ways(nominal, truth), {}, given, {.fix = {"left.diameter", "right.diameter"}});
      const auto track = std::ranges::find(result.parameters, Parameter{ParameterKind::track, -1},
                                           &ParameterEstimate::parameter);
      ASSERT_NE(track, result.parameters.end());
      const double error_m = track->value - value_of(track->parameter, truth);
      std::printf("sensor at %.1f m, %3.0f degrees: track %.5f m, off by %5.2f sigmas, sigma %.5f m\n",
                  distance_m, azimuth_deg, track->value, error_m / track->sigma_within, track->sigma_within);
      EXPECT_TRUE(track->observable);
      EXPECT_LT(std::abs(error_m), 4.0 * track->sigma_within) << distance_m << " " << azimuth_deg;
      EXPECT_LT(track->sigma_within, 0.0005) << distance_m << " " << azimuth_deg;
      sigma_m.push_back(track->sigma_within);
    }
    const auto [least, most] = std::ranges::minmax(sigma_m);
    EXPECT_LT(most, 2.0 * least) << distance_m;
  }
}

}  // namespace
}  // namespace trundle::calibration
