// The clock of a gyro that alone tells the turns of a robot with passive pods: by a reference, whose own is
// found too.
#include <cmath>
#include <cstdint>
#include <utility>

#include <gtest/gtest.h>

#include "trundle/recording/time_offset.hpp"
#include "trundle/simulation/scenario.hpp"
#include "trundle/statistics/distribution.hpp"

#include "recording/robots.hpp"
#include "scale.hpp"

namespace trundle::recording {
using namespace simulation;
namespace {

struct PodOffsets {
  double gyro_s = 0.0;
  double reference_s = 0.0;
};

struct PodRates {
  double pods_hz;
  double reference_hz;
  double ticks;
};

/// The reference's point is away from the middle.
Robot pods_at(const PodOffsets& offsets, double ticks) {
  Robot robot = test::pods_and_gyro(ticks, offsets.gyro_s, offsets.reference_s);
  robot.body_from_reference = {0.1, 0.05, 0.0};
  return robot;
}

Recording pod_drive(const Path& path, const PodOffsets& offsets, const PodRates& sampling,
                    std::uint64_t seed) {
  Scenario scenario;
  scenario.nominal = pods_at({}, sampling.ticks);
  scenario.truth = pods_at(offsets, sampling.ticks);
  scenario.path = joined({pause(3.0), path, pause(3.0)});
  scenario.steering = Steering::truth;
  scenario.whole_intervals = false;
  scenario.encoders.rate_hz = sampling.pods_hz;
  scenario.reference = {
      .rate_hz = sampling.reference_hz, .position_sigma_m = 0.002, .heading_sigma_rad = 0.005};
  scenario.seed = seed;
  return simulate(scenario).recording;
}

Path pod_tour(std::uint64_t seed) {
  Random random(seed, 99);
  return random_tour({.length_m = 20.0}, {}, random, {.forward_m_s = 0.6, .turn_rad_s = 0.8});
}

TEST(GyroAndReferenceClocks, are_found_within_their_sigmas) {
  double squares = 0.0;
  int told = 0, trials = 0;
  std::uint64_t seed = 1;
  const int times = test::trials(3, 1);
  for (const PodOffsets& offsets : {PodOffsets{0.06, 0.0}, PodOffsets{-0.1, 0.0}, PodOffsets{0.0, 0.2},
                                    PodOffsets{0.06, -0.1}, PodOffsets{0.0, 0.0}})
    for (const PodRates& sampling :
         {PodRates{20.0, 20.0, 2000.0}, PodRates{50.0, 50.0, 2000.0}, PodRates{100.0, 20.0, 400.0}})
      for (int i = 0; i < times; ++i) {
        const Recording recording = pod_drive(pod_tour(seed), offsets, sampling, seed);
        const GyroClocks found = gyro_and_reference_clocks(recording, pods_at({}, sampling.ticks));
        ++seed;
        ++trials;
        EXPECT_TRUE(found.is_possible);
        if (!found.gyro || !found.reference) continue;
        ++told;
        for (const auto& [clock, truth_s] :
             {std::pair(*found.gyro, offsets.gyro_s), std::pair(*found.reference, offsets.reference_s)}) {
          const double error = (clock.offset_s - truth_s) / clock.sigma_s;
          EXPECT_LT(std::abs(error), 4.5) << truth_s << " s at " << sampling.pods_hz << " Hz";
          squares += error * error;
          EXPECT_EQ(is_off(clock, 0.0), truth_s != 0.0);
        }
      }
  EXPECT_LT(squares, chi_squared_limit(5e-4, 2.0 * told));
  EXPECT_GE(told, 0.95 * trials);
}

TEST(GyroAndReferenceClocks, at_one_speed_it_is_told_how_far_they_are_apart_and_no_more) {
  Path path;
  for (int i = 0; i < 60; ++i) {
    const double curvature_1_m = (i % 2 == 0 ? 1.0 : -1.0) * (0.4 + 0.3 * std::sin(1.7 * i));
    path.push_back({{0.9, 0.0, 0.9 * curvature_1_m}, 1.5});
  }
  Scenario scenario;
  scenario.nominal = pods_at({}, 2000.0);
  scenario.truth = pods_at({.gyro_s = 0.08}, 2000.0);
  // A point beside the middle would be faster in some curves than in others.
  scenario.truth.body_from_reference = scenario.nominal.body_from_reference = {};
  scenario.path = path;
  scenario.steering = Steering::truth;
  scenario.whole_intervals = false;
  scenario.encoders.rate_hz = 50.0;
  scenario.reference = {.rate_hz = 50.0, .position_sigma_m = 0.002, .heading_sigma_rad = 0.005};
  for (int seed = 1; seed <= test::trials(10, 2); ++seed) {
    scenario.seed = static_cast<std::uint64_t>(seed);
    const GyroClocks found = gyro_and_reference_clocks(simulate(scenario).recording, scenario.nominal);
    for (const auto& clock : {found.gyro, found.reference})
      EXPECT_FALSE(clock && is_off(*clock, 0.0)) << seed;
    ASSERT_TRUE(found.apart);
    EXPECT_NEAR(found.apart->offset_s, 0.08, 4.0 * found.apart->sigma_s);
    EXPECT_LT(found.apart->sigma_s, 0.01);
  }
}

TEST(GyroAndReferenceClocks, are_for_robots_whose_wheels_see_no_turns) {
  const Recording recording = pod_drive(pod_tour(1), {}, {50.0, 50.0, 2000.0}, 1);
  Recording without_headings = recording;
  without_headings.reference.heading_rad.assign(without_headings.reference.time_s.size(), NAN);
  EXPECT_FALSE(gyro_and_reference_clocks(without_headings, pods_at({}, 2000.0)).is_possible);
  const Robot wheeled = test::with_gyro(test::two_wheels());
  EXPECT_FALSE(gyro_and_reference_clocks(recording, wheeled).is_possible);
}

}  // namespace
}  // namespace trundle::recording
