// A robot whose velocity another program computed, from its scenario to the run that uses what was found.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/chassis/robot.hpp"
#include "trundle/io/file.hpp"

#include "app/process.hpp"
#include "app/sample.hpp"

namespace trundle::test {
using namespace pipeline;
namespace {

using testing::HasSubstr;

constexpr const char* kCartTour = R"(robot = "cart.toml"
steering = "truth"
[truth.velocity]
forward_scale = 1.03
yaw_per_forward_rad_m = 0.02
[encoders]
rate_hz = 10
[reference]
rate_hz = 5
position_sigma_m = 0.005
heading_sigma_deg = 0.5
[[run]]
[[run.path]]
drive = "tour"
length_m = 20
)";

class VelocityRobot : public testing::Test {
 protected:
  VelocityRobot() {
    write_file(sample_.folder() / "cart.toml", "name = \"cart\"\n[noise]\nwheel_per_sqrt_m = 0.005\n");
    write_file(sample_.folder() / "cart_tour.toml", kCartTour);
    EXPECT_EQ(run({"simulate", "cart_tour.toml", "-o", "cart"}).exit_code, 0);
  }
  Outcome run(const Arguments& arguments) const { return run_program(sample_.folder(), arguments); }

  Sample sample_;
};

TEST_F(VelocityRobot, IsCalibratedAndDrivesByWhatWasFound) {
  const Outcome found = run({"calibrate", "cart", "--robot", "cart.toml", "-o", "calibrated.toml"});
  ASSERT_EQ(found.exit_code, 0) << found.err;
  EXPECT_THAT(found.out, HasSubstr("velocity.forward_scale"));
  const Robot robot = read_robot(sample_.folder() / "calibrated.toml");
  ASSERT_TRUE(robot.calibration);
  ASSERT_EQ(robot.calibration->covariance.rows(), 4);
  const auto sigma = robot.calibration->covariance.diagonal().cwiseSqrt().eval();
  EXPECT_NEAR(robot.chassis.velocity.forward_scale, 1.03, 4.0 * sigma[0]);
  EXPECT_NEAR(robot.chassis.velocity.yaw_per_forward_rad_m, 0.02, 4.0 * sigma[2]);
  const Outcome driven = run({"odometry", "cart", "--robot", "calibrated.toml", "-o", "t.csv"});
  EXPECT_EQ(driven.exit_code, 0) << driven.err;
  const Outcome all = run({"run", "cart", "--robot", "cart.toml", "-o", "all"});
  EXPECT_EQ(all.exit_code, 0) << all.err;
  EXPECT_THAT(read_file(sample_.folder() / "all/calibrated.toml"), HasSubstr("[velocity]"));
  const Outcome exported =
      run({"calibrate", "cart", "--robot", "cart.toml", "--export", "ros2_control", "-o", "c.toml"});
  EXPECT_EQ(exported.exit_code, 4);
}

TEST_F(VelocityRobot, WithAMistakeIsRefusedInOneLine) {
  write_file(sample_.folder() / "cart.toml", "[velocity]\nyaw_scale = 0\n");
  const Outcome refused = run({"odometry", "cart", "--robot", "cart.toml", "-o", "t.csv"});
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_THAT(refused.err, HasSubstr("cart.toml:2: yaw_scale is 0"));
}

}  // namespace
}  // namespace trundle::test
