// The steering's clock is set before the fit, as the gyro's is.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/calibration/calibrate.hpp"
#include "trundle/recording/time_offset.hpp"

#include "calibration/steered_drives.hpp"

namespace trundle::calibration {
namespace {
using test::rich_drive, test::simulated_drive, test::steered_robot;

TEST(SteeringClock, is_set_said_and_written_into_the_robot_file) {
  const Robot nominal = steered_robot("tricycle");
  Robot truth = nominal;
  recording::move_steering_clock(-0.2, truth.chassis);
  const double offset_s = recording::steering_time_offset_s(truth.chassis);
  const test::Path drive = simulation::joined({rich_drive(1.0), rich_drive(0.8), rich_drive(1.3)});
  const std::vector<Recording> runs = {simulated_drive(truth, drive, 1), simulated_drive(truth, drive, 2)};
  const CalibrationResult result = calibrate(runs, {}, nominal);
  ASSERT_TRUE(result.steering_clock);
  EXPECT_THAT(*result.steering_clock, testing::StartsWith("steering_time_offset_s -0.2"));
  EXPECT_THAT(result.notes, testing::Contains(*result.steering_clock));
  EXPECT_NEAR(recording::steering_time_offset_s(result.calibrated.chassis), offset_s, 0.015);
  EXPECT_EQ(recording::steering_time_offset_s(parse_robot(to_toml(result.calibrated), "r").chassis),
            recording::steering_time_offset_s(result.calibrated.chassis));
  const std::vector<Recording> right = {simulated_drive(nominal, drive, 1)};
  EXPECT_FALSE(calibrate(right, {}, nominal).steering_clock);
}

}  // namespace
}  // namespace trundle::calibration
