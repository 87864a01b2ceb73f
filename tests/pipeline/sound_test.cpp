#include "trundle/pipeline/sound.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/io/error.hpp"

namespace trundle::pipeline {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

CalibrationResult result_for(const Robot& calibrated) {
  CalibrationResult result;
  result.calibrated = calibrated;
  return result;
}

Robot two_wheels() {
  Robot robot;
  robot.chassis = differential_drive({0.1, 0.0}, 0.5);
  robot.wheel_names = {"left", "right"};
  return robot;
}

std::string refusal_of(const CalibrationResult& result) {
  try {
    require_sound(result);
  } catch (const CannotAnswer& reason) {
    return reason.what();
  }
  return {};
}

TEST(SoundCalibration, IsARobotThatAFileCanSay) {
  Robot robot = two_wheels();
  EXPECT_EQ(refusal_of(result_for(robot)), "");
  robot.chassis.noise.wheel_per_sqrt_m = 40.3;
  EXPECT_THAT(refusal_of(result_for(robot)), AllOf(HasSubstr("wheel_per_sqrt_m is 40.3"),
                                                   HasSubstr("at most 10"), Not(HasSubstr(".toml:"))));
}

TEST(SoundCalibration, HasATrack) {
  CalibrationResult result = result_for(two_wheels());
  ParameterEstimate& track = result.parameters.emplace_back();
  track.parameter = {ParameterKind::track, -1};
  track.name = "track";
  track.value = 1e-10;
  track.sigma_total = 1e-9;
  EXPECT_THAT(refusal_of(result), HasSubstr("track comes out as 1e-10 m"));
}

}  // namespace
}  // namespace trundle::pipeline
