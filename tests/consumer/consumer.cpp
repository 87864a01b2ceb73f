// Uses the installed library as a robot's program would: a robot file, a step of odometry.
#include <cstdio>
#include <numbers>

#include "trundle/chassis/robot.hpp"
#include "trundle/odometry/odometer.hpp"

namespace {

constexpr const char* kRobot = R"(
name = "consumer"
[[wheel]]
name = "left"
y_m = 0.1
diameter_m = 0.1
ticks_per_revolution = 1000
[[wheel]]
name = "right"
y_m = -0.1
diameter_m = 0.1
ticks_per_revolution = 1000
)";

}  // namespace

int main() {
  const trundle::chassis::Robot robot = trundle::chassis::parse_robot(kRobot, "robot.toml");
  trundle::odometry::Odometer odometer(robot, {});
  trundle::chassis::Increment one_revolution;
  one_revolution.duration_s = 1.0;
  one_revolution.turned = {1.0, 1.0};
  odometer.step(one_revolution);
  std::printf("%s: %.3f diameters\n", robot.name.c_str(), odometer.pose().x / 0.1);
}
