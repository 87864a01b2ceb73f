// Odometry on one core: bulk poses from a log in memory, with and without covariance, one step at a time, and
// a plain scalar loop over the C library's sine and cosine as yardstick. All variants take turns; medians are
// printed.
#include <algorithm>
#include <cmath>
#include <ctime>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include <fmt/core.h>

#include "trundle/odometry/dead_reckon.hpp"
#include "trundle/odometry/odometer.hpp"

namespace {

using namespace trundle::pipeline;

constexpr std::size_t kRows = 10'000'000;
constexpr int kRounds = 7;

struct Log {
  std::vector<double> left;  // revolutions in each interval
  std::vector<double> right;
  std::vector<double> steering;  // of steered wheels [rad]
};

/// A wandering differential drive, about 2 cm and up to 2° per row; of steered wheels some 20°, now and then
/// 60°.
Log wander(std::size_t rows) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> noise(-1.0, 1.0);
  Log log;
  double bend = 0.0;
  for (std::size_t i = 0; i < rows; ++i) {
    bend = 0.99 * bend + 0.0005 * noise(random);
    log.left.push_back(0.09 - bend);
    log.right.push_back(0.09 + bend);
    log.steering.push_back(200.0 * bend);
  }
  return log;
}

Robot differential() {
  Robot robot;
  robot.name = "bench";
  robot.chassis = differential_drive({.diameter_m = 0.0704, .ticks_per_revolution = 2578.33}, 0.23);
  robot.wheel_names = {"left", "right"};
  return robot;
}

/// The same with steered wheels, which all roll and turn alike.
Robot steered(const Chassis& chassis) {
  Robot robot;
  robot.name = "steered";
  robot.chassis = chassis;
  for (int i = 0; i < chassis.wheel_count; ++i) robot.wheel_names.push_back(fmt::format("w{}", i));
  for (int i = 0; i < chassis.passive_count; ++i) robot.passive_names.push_back(fmt::format("p{}", i));
  return robot;
}

struct Poses {
  std::vector<double> x = std::vector<double>(kRows);
  std::vector<double> y = std::vector<double>(kRows);
  std::vector<double> heading = std::vector<double>(kRows);
  std::vector<Symmetric3> covariance;
};

void yardstick(const Log& log, Poses& out) {
  const double metres = kPi * 0.0704;
  double x = 0.0;
  double y = 0.0;
  double heading = 0.0;
  for (std::size_t i = 0; i < kRows; ++i) {
    const double forward = 0.5 * metres * (log.left[i] + log.right[i]);
    const double turn = metres * (log.right[i] - log.left[i]) / 0.23;
    const double half = 0.5 * turn;
    const double chord = std::abs(half) < 1e-9 ? forward : forward * std::sin(half) / half;
    x += chord * std::cos(heading + half);
    y += chord * std::sin(heading + half);
    heading += turn;
    out.x[i] = x;
    out.y[i] = y;
    out.heading[i] = heading;
  }
}

void bulk(const Robot& robot, const Log& log, Poses& out) {
  dead_reckon(robot, {.turned = {log.left, log.right}}, {}, {out.x, out.y, out.heading});
}

void bulk_steered(const Robot& robot, const Log& log, Poses& out) {
  TravelColumns travel;
  for (std::size_t i = 0; i < robot.chassis.all_wheels().size(); ++i) {
    travel.turned[i] = log.left;
    travel.steering_rad[i] = log.steering;
  }
  dead_reckon(robot, travel, {}, {out.x, out.y, out.heading});
}

void steps_steered(const Robot& robot, const Log& log, Poses& out) {
  Odometer odometer(robot, {.with_covariance = false});
  Increment increment{.duration_s = 0.01};
  for (std::size_t i = 0; i < kRows; ++i) {
    for (std::size_t k = 0; k < robot.chassis.all_wheels().size(); ++k) {
      increment.turned[k] = log.left[i];
      increment.steering_rad[k] = log.steering[i];
    }
    odometer.step(increment);
    out.x[i] = odometer.pose().x;
    out.y[i] = odometer.pose().y;
    out.heading[i] = odometer.pose().heading;
  }
}

template <bool kWithCovariance>
void steps(const Robot& robot, const Log& log, Poses& out) {
  Odometer odometer(robot, {.with_covariance = kWithCovariance});
  Increment increment{.duration_s = 0.01};
  for (std::size_t i = 0; i < kRows; ++i) {
    increment.turned[0] = log.left[i];
    increment.turned[1] = log.right[i];
    odometer.step(increment);
    out.x[i] = odometer.pose().x;
    out.y[i] = odometer.pose().y;
    out.heading[i] = odometer.pose().heading;
    if constexpr (kWithCovariance) out.covariance[i] = odometer.white();
  }
}

/// As `steps`, with the sensitivity to both diameters and the track: both parts of the covariance.
void steps_with_parameters(const Robot& robot, const Log& log, Poses& out) {
  Odometer odometer(
      robot, {.parameters = {
                  {ParameterKind::diameter, 0}, {ParameterKind::diameter, 1}, {ParameterKind::track, -1}}});
  Increment increment{.duration_s = 0.01};
  for (std::size_t i = 0; i < kRows; ++i) {
    increment.turned[0] = log.left[i];
    increment.turned[1] = log.right[i];
    odometer.step(increment);
    out.x[i] = odometer.pose().x;
    out.covariance[i] = odometer.white();
  }
}

/// With a gyro whose bias is learned: the detectors of rest and of dead encoders at work.
void steps_learning_bias(const Robot& robot, const Log& log, Poses& out) {
  Robot with_gyro = robot;
  with_gyro.chassis.gyro = Gyro{};
  Odometer odometer(with_gyro, {.learn_gyro_bias = true});
  Increment increment{.duration_s = 0.01, .has_gyro = true};
  for (std::size_t i = 0; i < kRows; ++i) {
    increment.turned[0] = log.left[i];
    increment.turned[1] = log.right[i];
    increment.gyro_rad = kPi * 0.0704 * (log.right[i] - log.left[i]) / 0.23;
    odometer.step(increment);
    out.x[i] = odometer.pose().x;
    out.covariance[i] = odometer.white();
  }
}

/// The same at rest.
void steps_at_rest(const Robot& robot, Poses& out) {
  Robot with_gyro = robot;
  with_gyro.chassis.gyro = Gyro{};
  Odometer odometer(with_gyro, {.learn_gyro_bias = true});
  const Increment increment{.duration_s = 0.01, .gyro_rad = 1e-4, .has_gyro = true};
  for (std::size_t i = 0; i < kRows; ++i) {
    odometer.step(increment);
    out.x[i] = odometer.pose().x;
    out.covariance[i] = odometer.white();
  }
}

/// This thread's processor time: what other programs take does not count.
double processor_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double seconds_of(const std::function<void()>& work) {
  const double start = processor_seconds();
  work();
  return processor_seconds() - start;
}

double median(std::vector<double> values) {
  std::ranges::nth_element(values, values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2));
  return values[values.size() / 2];
}

struct Variant {
  std::string name;
  std::function<void()> work;
  std::vector<double> seconds = {};
};

double largest_difference(const Poses& a, const Poses& b) {
  double largest = 0.0;
  for (std::size_t i = 0; i < kRows; ++i)
    largest = std::max({largest, std::abs(a.x[i] - b.x[i]), std::abs(a.y[i] - b.y[i])});
  return largest;
}

}  // namespace

int main() {
  const Log log = wander(kRows);
  const Robot robot = differential();
  const WheelSize size{.diameter_m = 0.0704, .ticks_per_revolution = 2578.33};
  const Robot on_three = steered(tricycle(size, 0.5)), on_four = steered(swerve(size, 0.4, 0.5)),
              car = steered(ackermann(size, 0.4, 0.5));
  Poses plain;
  Poses ours;
  Poses stepped;
  ours.covariance.resize(kRows);
  stepped.covariance.resize(kRows);
  std::vector<Variant> variants = {
      {"plain scalar loop, libm", [&] { yardstick(log, plain); }},
      {"dead_reckon", [&] { bulk(robot, log, ours); }},
      {"Odometer::step, pose alone", [&] { steps<false>(robot, log, stepped); }},
      {"Odometer::step, white covariance", [&] { steps<true>(robot, log, stepped); }},
      {"Odometer::step, both parts, 3 parameters", [&] { steps_with_parameters(robot, log, stepped); }},
      {"Odometer::step, gyro, bias learned", [&] { steps_learning_bias(robot, log, stepped); }},
      {"Odometer::step, the same at rest", [&] { steps_at_rest(robot, stepped); }},
      {"dead_reckon, tricycle", [&] { bulk_steered(on_three, log, ours); }},
      {"Odometer::step, tricycle, pose alone", [&] { steps_steered(on_three, log, stepped); }},
      {"dead_reckon, car", [&] { bulk_steered(car, log, ours); }},
      {"dead_reckon, swerve", [&] { bulk_steered(on_four, log, ours); }},
  };
  for (Variant& variant : variants) variant.work();  // touch all memory once
  steps<false>(robot, log, stepped);
  bulk(robot, log, ours);
  fmt::print("{} rows, differential drive, processor time of one thread, median of {} rounds in turn\n",
             kRows, kRounds);
  fmt::print("same poses: dead_reckon - step {} m, dead_reckon - libm {:.1e} m\n",
             largest_difference(ours, stepped), largest_difference(ours, plain));
  for (int round = 0; round < kRounds; ++round)
    for (Variant& variant : variants) variant.seconds.push_back(seconds_of(variant.work));
  const double yard = median(variants.front().seconds);
  for (const Variant& variant : variants) {
    const double seconds = median(variant.seconds);
    fmt::print("{:42} {:7.1f} M rows/s {:7.1f} ns/row {:6.2f} x plain\n", variant.name,
               kRows / seconds * 1e-6, seconds / kRows * 1e9, yard / seconds);
  }
}
