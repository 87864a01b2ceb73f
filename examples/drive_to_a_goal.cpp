// Feeds the pose loop of a controller: at 50 Hz the odometer turns encoder counts into a pose, the controller
// turns the pose into wheel speeds. The robot is simulated: its dimensions are those of truth.toml, the
// controller has robot.toml. Prints how far from the goal it really stops. In the root of the repository:
//   example_drive_to_a_goal data/demo/session_01/truth.toml out/calibrated.toml -3 2
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "trundle/io/error.hpp"
#include "trundle/odometry/odometer.hpp"

using namespace trundle::odometry;

namespace {

constexpr double kCycle_s = 0.02;

/// Speeds of both wheels [m/s] towards a goal: turn to it, slow down near it.
std::array<double, 2> towards(const Vector2& goal, const Pose2& pose, double track_m) {
  const Vector2 goal_in_body = pose.inverse() * goal;
  const double off_rad = std::atan2(goal_in_body.y(), goal_in_body.x());
  const double forward = std::min(0.5, goal_in_body.norm()) * std::max(0.0, std::cos(off_rad));
  return {forward - off_rad * track_m, forward + off_rad * track_m};
}

/// What the encoders count of it in one cycle: whole ticks. `ticks`: what the wheels turned since the start.
Increment counted(const Robot& truth, std::array<double, 2> speed, std::array<double, 2>& ticks) {
  Increment increment{.duration_s = kCycle_s};
  for (std::size_t i = 0; i < 2; ++i) {
    const Wheel& wheel = truth.chassis.wheels()[i];
    const double before = std::floor(ticks[i]);
    ticks[i] += speed[i] * kCycle_s / (kPi * wheel.diameter_m) * wheel.ticks_per_revolution;
    increment.turned[i] = (std::floor(ticks[i]) - before) / wheel.ticks_per_revolution;
  }
  return increment;
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 5)
    return std::fputs("usage: example_drive_to_a_goal truth.toml robot.toml X_M Y_M\n", stderr), 2;
  Robot truth = read_robot(argv[1]), robot = read_robot(argv[2]);
  truth.chassis.gyro.reset();  // this robot drives by its encoders alone
  robot.chassis.gyro.reset();
  const Vector2 goal(std::atof(argv[3]), std::atof(argv[4]));
  const double track_m = robot.chassis.wheels()[0].y_m - robot.chassis.wheels()[1].y_m;
  Odometer odometer(robot, {}), real(truth, {});
  std::array<double, 2> ticks{};
  for (int cycle = 0; cycle < 3000; ++cycle) {
    const Increment increment = counted(truth, towards(goal, odometer.pose(), track_m), ticks);
    odometer.step(increment);  // bounded time, never allocates
    real.step(increment);
  }
  std::printf("by its odometry the robot is %.4f m from the goal; it is %.4f m from it\n",
              (goal - odometer.pose().translation()).norm(), (goal - real.pose().translation()).norm());
} catch (const std::exception& error) {
  return std::fprintf(stderr, "%s\n", error.what()), exit_code_of(error);
}
