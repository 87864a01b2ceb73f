// The clock of a steering: by wheels that are not steered, the gyro, or a reference.
#include <array>
#include <cmath>
#include <filesystem>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "trundle/recording/time_offset.hpp"
#include "trundle/simulation/scenario.hpp"
#include "trundle/statistics/distribution.hpp"

#include "real_data.hpp"
#include "recording/folder.hpp"
#include "recording/robots.hpp"
#include "scale.hpp"

namespace trundle::recording {
using namespace simulation;
namespace {

enum class TurnsBy { wheels, gyro, reference };

/// How finely steering and wheels are read.
struct Resolution {
  double steering_sigma_rad = 0.002;
  double steering_ticks = 4096.0;
  double wheel_ticks = 1000.0;
};
constexpr Resolution kFine;
constexpr Resolution kCoarse = {.steering_sigma_rad = 0.01, .steering_ticks = 360.0, .wheel_ticks = 200.0};

/// A car, whose rear wheels are measured, or a tricycle, of which the front wheel is.
Robot steered_by(TurnsBy by, const Resolution& resolution = kFine) {
  const SteeringSensor steering{.sigma_rad = resolution.steering_sigma_rad,
                                .ticks_per_revolution = resolution.steering_ticks};
  const WheelSize size{0.2, resolution.wheel_ticks, 16};
  Robot robot;
  robot.name = "steered";
  if (by == TurnsBy::wheels) {
    robot.chassis = ackermann(size, 0.4, 0.4, 0.0, steering);
    robot.wheel_names = {"left", "right"};
    robot.passive_names = {"front"};
  } else {
    robot.chassis = tricycle(size, 0.4, steering);
    robot.wheel_names = {"front"};
    robot.passive_names = {"rear"};
  }
  if (by == TurnsBy::gyro) robot.chassis.gyro = Gyro{.bias_rad_s = 0.01};
  robot.chassis.noise.wheel_per_sqrt_m = 0.002;
  return robot;
}

struct Offsets {
  double steering_s = 0.0;
  double other_s = 0.0;  ///< of gyro or reference
};

Robot with_offsets(Robot robot, const Offsets& offsets) {
  move_steering_clock(offsets.steering_s, robot.chassis);
  if (robot.chassis.gyro) robot.chassis.gyro->time_offset_s = offsets.other_s;
  robot.reference_time_offset_s = offsets.other_s;
  return robot;
}

Scenario scenario_of(const Robot& nominal, const Robot& truth, const Path& path, double rate_hz) {
  Scenario scenario;
  scenario.nominal = nominal;
  scenario.truth = truth;
  scenario.path = path;
  scenario.steering = Steering::truth;
  scenario.whole_intervals = false;
  scenario.encoders.rate_hz = rate_hz;
  scenario.steered.unit = WheelUnit::ticks;
  return scenario;
}

Recording steered_tour(TurnsBy by, const Offsets& offsets, double rate_hz, std::uint64_t seed,
                       const Resolution& resolution = kFine) {
  Random random(seed, 99);
  const Path tour = random_tour({.length_m = 20.0}, {}, random, {.forward_m_s = 0.6, .turn_rad_s = 0.8});
  const Robot nominal = steered_by(by, resolution);
  Scenario scenario =
      scenario_of(nominal, with_offsets(nominal, offsets), joined({pause(3.0), tour}), rate_hz);
  if (by == TurnsBy::reference)
    scenario.reference = {.rate_hz = 5.0, .position_sigma_m = 0.001, .heading_sigma_rad = 0.002};
  scenario.seed = seed;
  return simulate(scenario).recording;
}

constexpr std::array kAtRates_hz = {10.0, 20.0, 50.0, 100.0};

class SteeringClock : public testing::TestWithParam<TurnsBy> {};

TEST_P(SteeringClock, is_found_within_its_sigma_whatever_the_other_clock_is) {
  std::uint64_t seed = 1;
  double squares = 0.0;
  int trials = 0, told = 0;
  const int times = test::trials(4, 1);
  for (const Offsets& offsets : {Offsets{-0.1, 0.0}, Offsets{0.05, 0.0}, Offsets{0.2, 0.0},
                                 Offsets{0.2, -0.05}, Offsets{0.0, 0.08}, Offsets{0.0, 0.0}})
    for (const double rate_hz : kAtRates_hz)
      for (const Resolution& resolution : {kFine, kCoarse})
        for (int i = 0; i < times; ++i) {
          const SteeringClocks found =
              steering_clocks(steered_tour(GetParam(), offsets, rate_hz, seed++, resolution),
                              steered_by(GetParam(), resolution));
          ++trials;
          if (!found.steering) continue;
          ++told;
          const double error = (found.steering->offset_s - offsets.steering_s) / found.steering->sigma_s;
          EXPECT_LT(std::abs(error), 4.5) << rate_hz << " Hz, " << offsets.steering_s << " s";
          squares += error * error;
          EXPECT_EQ(is_off(*found.steering, 0.0), offsets.steering_s != 0.0);
          for (const auto& other : {found.gyro, found.reference})
            if (other) {
              EXPECT_NEAR(other->offset_s, offsets.other_s, 5.0 * other->sigma_s + 0.002);
            }
        }
  EXPECT_LT(squares, chi_squared_limit(5e-4, told));
  // Between 5 Hz of a reference a minute's drive may not show that an offset is better than none.
  EXPECT_GE(told, GetParam() == TurnsBy::reference ? 0.9 * trials : trials);
}

INSTANTIATE_TEST_SUITE_P(By, SteeringClock,
                         testing::Values(TurnsBy::wheels, TurnsBy::gyro, TurnsBy::reference),
                         [](const auto& tested) -> std::string {
                           if (tested.param == TurnsBy::wheels) return "wheels";
                           return tested.param == TurnsBy::gyro ? "gyro" : "reference";
                         });

/// Both clocks alike move nothing but the speed, and that stays the same.
TEST(SteeringClocks, at_one_speed_it_is_told_how_far_steering_and_gyro_are_apart_and_no_more) {
  Path path;
  for (int i = 0; i < 40; ++i) {
    const double curvature_1_m = (i % 2 == 0 ? 1.0 : -1.0) * (0.4 + 0.3 * std::sin(1.7 * i));
    path.push_back({{0.9, 0.0, 0.9 * curvature_1_m}, 1.5});
  }
  const Robot nominal = steered_by(TurnsBy::gyro);
  const Recording recording =
      simulate(scenario_of(nominal, with_offsets(nominal, {0.15, 0.0}), path, 20.0)).recording;
  const SteeringClocks found = steering_clocks(recording, nominal);
  EXPECT_FALSE(found.steering);
  EXPECT_FALSE(found.gyro);
  ASSERT_TRUE(found.apart);
  EXPECT_NEAR(found.apart->offset_s, 0.15, 4.0 * found.apart->sigma_s);
  EXPECT_LT(found.apart->sigma_s, 0.01);
}

TEST(SteeringClocks, a_wrong_zero_or_scale_of_the_steering_does_not_matter) {
  Robot robot = steered_by(TurnsBy::gyro);
  const Recording recording = steered_tour(TurnsBy::gyro, {0.1, 0.0}, 20.0, 7);
  robot.chassis.wheels()[0].steering->zero_rad = 0.03;
  robot.chassis.wheels()[0].steering->scale = 1.03;
  const SteeringClocks found = steering_clocks(recording, robot);
  ASSERT_TRUE(found.steering);
  EXPECT_NEAR(found.steering->offset_s, 0.1, 4.0 * found.steering->sigma_s);
}

TEST(SteeringClocks, adds_to_what_the_robot_file_says) {
  const Robot robot = with_offsets(steered_by(TurnsBy::gyro), {0.08, 0.0});
  const SteeringClocks found = steering_clocks(steered_tour(TurnsBy::gyro, {0.1, 0.0}, 20.0, 8), robot);
  ASSERT_TRUE(found.steering && found.apart);
  EXPECT_NEAR(found.steering->offset_s, 0.1, 4.0 * found.steering->sigma_s);
  EXPECT_NEAR(found.apart->offset_s, 0.02, 4.0 * found.apart->sigma_s);
}

TEST(SteeringClocks, are_not_told_where_nothing_turns_or_nothing_is_steered) {
  const Robot nominal = steered_by(TurnsBy::gyro);
  const SteeringClocks ahead =
      steering_clocks(simulate(scenario_of(nominal, nominal, straight(20.0), 20.0)).recording, nominal);
  EXPECT_TRUE(ahead.is_possible);
  EXPECT_FALSE(ahead.steering || ahead.gyro || ahead.apart);
  EXPECT_FALSE(steering_clocks(steered_tour(TurnsBy::gyro, {}, 20.0, 1),
                               [] {
                                 Robot robot = test::with_gyro(test::two_wheels());
                                 robot.chassis.wheel_count = 1;
                                 robot.wheel_names = {"front"};
                                 return robot;
                               }())
                   .is_possible);
}

// Readings that scatter by half a degree at 100 Hz, beside bends of some seconds: an offset was found
// wherever they scattered least by chance, squares being 2.4 times those stated; where σ has but the noise of
// so few bends to go by they are 1.3 times those.
TEST(SteeringClocks, are_none_of_the_noise_of_a_steering) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const Resolution resolution{.steering_sigma_rad = 0.0087, .steering_ticks = 4096.0, .wheel_ticks = 1000.0};
  Robot nominal = steered_by(TurnsBy::wheels, resolution);
  nominal.chassis.noise.wheel_per_sqrt_m = 0.01;
  double squares = 0.0;
  int told = 0;
  constexpr int kTimes = 80;
  for (int i = 0; i < kTimes; ++i) {
    const auto seed = static_cast<std::uint64_t>(i + 1);
    const double offset_s = i % 2 == 0 ? 0.0 : -0.2;
    Random random(seed, 97);
    const double slow_s = random.uniform(8.0, 20.0), quick_s = random.uniform(5.0, 8.0);
    Path path{{{0.0, 0.0, 0.0}, 2.0}};
    for (double t = 0.0; t < 60.0; t += 0.1) {
      const double bends = std::sin(2.0 * kPi * t / slow_s + 1.0) + std::sin(2.0 * kPi * t / quick_s);
      path.push_back({{0.05, 0.0, 0.05 * (0.3 + 0.25 * bends)}, 0.1});
    }
    Scenario scenario = scenario_of(nominal, with_offsets(nominal, {.steering_s = offset_s}), path, 100.0);
    scenario.seed = seed;
    const auto found = steering_clocks(simulate(scenario).recording, nominal).steering;
    if (!found) continue;
    squares += std::pow((found->offset_s - offset_s) / found->sigma_s, 2);
    ++told;
  }
  EXPECT_GE(told, kTimes * 3 / 4);
  EXPECT_LT(squares / 1.3, chi_squared_limit(1e-3, told));
}

// Its zero turns the body by a multiple of the way, and so do wheels of which one is larger: that both start
// and stop with the robot says nothing of the steering's clock.
TEST(SteeringClocks, a_car_that_drives_straight_on_does_not_tell_one) {
  const Robot nominal = steered_by(TurnsBy::wheels, kCoarse);
  Robot truth = nominal;
  truth.chassis.wheels()[0].diameter_m *= 1.01;
  truth.chassis.all_wheels()[2].steering->zero_rad = 0.05;
  const Path path =
      joined({pause(3.0), straight(4.0), pause(2.0), straight(-4.0), straight(5.0), pause(2.0)});
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Scenario scenario = scenario_of(nominal, truth, path, 50.0);
    scenario.seed = seed;
    EXPECT_FALSE(steering_clocks(simulate(scenario).recording, nominal).steering) << seed;
  }
}

/// Runs of a minute or two, most of them of squares, whose corners a tricycle turns on the spot: it steers
/// while it stands, and any offset does as long as that lasts.
TEST(SteeringClocks, real_runs_that_do_not_show_a_steering_late_do_not_say_so) {
  TRUNDLE_NEEDS_REAL_DATA("optiodom_tricyc");
  Robot robot;
  robot.chassis = tricycle({0.065, 1600.0, 0}, 0.15);
  robot.wheel_names = {"front"};
  robot.passive_names = {"rear"};
  int runs = 0;
  for (const auto& entry :
       std::filesystem::recursive_directory_iterator(test::real_data() / "optiodom_tricyc")) {
    if (entry.path().filename().string().find("_run-") == std::string::npos) continue;
    const test::Folder folder;
    folder.write("recording.toml", fmt::format(R"([wheels]
file = "{0}"
header = false
increments = true
columns = {{ time_s = 1, front_ticks = 5, front_steering_rad = 6 }}
[reference]
file = "{0}"
header = false
columns = {{ time_s = 1, x_m = 2, y_m = 3, heading_rad = 4 }}
)",
                                               entry.path().string()));
    const SteeringClocks found = steering_clocks(read_recording(folder.path()), robot);
    EXPECT_TRUE(found.is_possible);
    EXPECT_FALSE(found.steering && is_off(*found.steering, 0.0)) << entry.path();
    EXPECT_FALSE(found.apart && is_off(*found.apart, 0.0)) << entry.path();
    ++runs;
  }
  EXPECT_EQ(runs, 14);
}

}  // namespace
}  // namespace trundle::recording
