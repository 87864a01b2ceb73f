// Feeds the pose loop of a controller: at 50 Hz the odometer turns encoder counts into a pose, the controller
// turns the pose into wheel speeds. The robot here is simulated: its true dimensions are those of
// `truth.toml`, what the controller believes is `robot.toml`. Prints how far from the goal it really stops.
//   example_drive_to_a_goal truth.toml robot.toml GOAL_X_M GOAL_Y_M
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "trundle/chassis/robot.hpp"
#include "trundle/odometry/odometer.hpp"

namespace {

constexpr double kCycle_s = 0.02;

/// Two wheels' speeds [m/s] that drive towards a goal: turn to it, go slower as it comes near.
std::array<double, 2> towards(double x_m, double y_m, const trundle::Pose2& pose, double track_m) {
  const double dx = x_m - pose.x, dy = y_m - pose.y;
  const double off_rad = std::remainder(std::atan2(dy, dx) - pose.heading, 2.0 * M_PI);
  const double forward = std::min(0.5, std::hypot(dx, dy)) * std::max(0.0, std::cos(off_rad));
  const double turn = 2.0 * off_rad;
  return {forward - 0.5 * turn * track_m, forward + 0.5 * turn * track_m};
}

/// What the encoders count of it in one cycle: whole ticks, the rest is counted later.
trundle::Increment counted(const trundle::Robot& truth, std::array<double, 2> speed,
                           std::array<double, 2>& rest) {
  trundle::Increment increment{.duration_s = kCycle_s};
  for (std::size_t i = 0; i < 2; ++i) {
    const trundle::Wheel& wheel = truth.chassis.wheels()[i];
    const double ticks =
        rest[i] + speed[i] * kCycle_s / (M_PI * wheel.diameter_m) * wheel.ticks_per_revolution;
    increment.turned[i] = std::round(ticks) / wheel.ticks_per_revolution;
    rest[i] = ticks - std::round(ticks);
  }
  return increment;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5)
    return std::fputs("usage: example_drive_to_a_goal truth.toml robot.toml X_M Y_M\n", stderr), 2;
  trundle::Robot truth = trundle::read_robot(argv[1]), believed = trundle::read_robot(argv[2]);
  truth.chassis.gyro.reset();  // this robot drives by its encoders alone
  believed.chassis.gyro.reset();
  const double x_m = std::atof(argv[3]), y_m = std::atof(argv[4]);
  const double track_m = believed.chassis.wheels()[0].y_m - believed.chassis.wheels()[1].y_m;
  trundle::Odometer odometer(believed, {}), real(truth, {});
  std::array<double, 2> rest{};
  for (int cycle = 0; cycle < 3000; ++cycle) {
    const trundle::Increment increment = counted(truth, towards(x_m, y_m, odometer.pose(), track_m), rest);
    odometer.step(increment);  // bounded time, never allocates
    real.step(increment);
  }
  const auto off_m = [&](const trundle::Pose2& pose) { return std::hypot(pose.x - x_m, pose.y - y_m); };
  std::printf("the controller believes to be %.4f m from the goal; it is %.4f m from it\n",
              off_m(odometer.pose()), off_m(real.pose()));
}
