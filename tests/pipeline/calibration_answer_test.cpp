#include "trundle/pipeline/calibration_answer.hpp"

#include <algorithm>
#include <iterator>

#include <gmock/gmock.h>

#include "trundle/io/error.hpp"
#include "trundle/simulation/scenario.hpp"

namespace trundle::pipeline {
namespace {

/// Of angles in degrees a fit made a wheelbase of 3 mm.
TEST(CalibrationAnswer, of_a_steering_in_another_unit_is_none) {
  Scenario scenario;
  scenario.nominal.chassis = tricycle({.diameter_m = 0.2, .ticks_per_revolution = 2000.0}, 0.6,
                                      {.sigma_rad = 0.005, .time_offset_s = -0.025});
  scenario.nominal.wheel_names = {"front"};
  scenario.nominal.passive_names = {"rear"};
  scenario.truth = scenario.nominal;
  for (const double radius_m : {0.8, 1.2, 2.0, 3.5})
    for (const TurnSense sense : {TurnSense::ccw, TurnSense::cw})
      std::ranges::copy(circle(radius_m, 0.3, sense), std::back_inserter(scenario.path));
  scenario.steering = Steering::truth;
  scenario.reference.rate_hz = 10.0;
  Recording recording = simulate(scenario).recording;
  for (double& angle : recording.wheels.steering[0].value) angle *= 180.0 / kPi;
  try {
    (void)answer_calibration({&recording, 1}, {}, {.robot = scenario.nominal, .file = {}}, {});
    FAIL() << "degrees were calibrated";
  } catch (const CannotAnswer& reason) {
    EXPECT_THAT(reason.what(), testing::HasSubstr("write unit = \"deg\""));
  }
}

}  // namespace
}  // namespace trundle::pipeline
