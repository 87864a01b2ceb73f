#include "trundle/calibration/install_angle/install_angle.hpp"

#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/io/error.hpp"
#include "trundle/simulation/scenario.hpp"

#include "scale.hpp"

namespace trundle::calibration {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

/// Where the robot of docs/theory/dead-wheels.md, eq. 1 ends.
LRun l_run_with(double alpha, double side_m = 2.0, double sense = 1.0) {
  return {.side_m = side_m,
          .end_x_m = side_m,
          .end_y_m = -side_m * std::tan(alpha) + sense * side_m / std::cos(alpha)};
}

Robot two_pods(double alpha) {
  Robot robot;
  robot.name = "pods";
  const std::array<Pod, 2> pods{{{0.0, 0.0, 0.0}, {0.0, 0.0, 0.5 * kPi - alpha}}};
  robot.chassis =
      dead_wheels({0.05, 2048.0, 0}, pods, Gyro{.noise_rad_s_sqrt_hz = 0.0, .bias_walk_rad_s_sqrt_s = 0.0});
  robot.chassis.noise = {.wheel_per_sqrt_m = 0.0, .lateral_per_sqrt_m = 0.0, .skid_per_sqrt_m = 0.0};
  robot.wheel_names = {"ahead", "across"};
  return robot;
}

Scenario scenario_with(double alpha, const Path& path) {
  Scenario scenario;
  scenario.nominal = two_pods(0.0);
  scenario.truth = two_pods(alpha);
  scenario.path = path;
  scenario.encoders = {.rate_hz = 20.0, .unit = WheelUnit::radians, .quantised = false};
  scenario.reference.rate_hz = 20.0;
  return scenario;
}

TEST(InstallAngle, is_exact_from_the_end_position) {
  for (int i = -300; i <= 300; i += 5)
    for (const double sense : {1.0, -1.0}) {
      const double alpha = 0.001 * i;
      const InstallAngle found = install_angle(std::vector{l_run_with(alpha, 2.0, sense)});
      EXPECT_NEAR(found.alpha_rad, alpha, 1e-12) << "sense " << sense;
      EXPECT_NEAR(found.theta_rad, 0.5 * kPi - alpha, 1e-12);
      EXPECT_NEAR(found.scale, 1.0, 1e-15);
    }
}

TEST(InstallAngle, is_exact_from_recordings_of_the_run) {
  for (int i = -30; i <= 30; i += 5)
    for (const TurnSense sense : {TurnSense::ccw, TurnSense::cw}) {
      const double alpha = 0.01 * i;
      const Recording recording = simulate(scenario_with(alpha, l_run(2.0, sense))).recording;
      const LRun run = l_run_of(recording, two_pods(0.0));
      EXPECT_NEAR(run.side_m, 2.0, 1e-12);
      EXPECT_NEAR(install_angle(std::vector{run}).alpha_rad, alpha, 1e-12);
    }
}

TEST(InstallAngle, takes_the_end_from_a_tape_measure_as_well) {
  Scenario scenario = scenario_with(0.2, l_run(1.0));
  scenario.reference.rate_hz = 0.0;
  scenario.partial = {.end_pose = true, .position_sigma_m = 0.0, .heading_sigma_rad = 0.0};
  const LRun run = l_run_of(simulate(scenario).recording, two_pods(0.0));
  EXPECT_NEAR(install_angle(std::vector{run}).alpha_rad, 0.2, 1e-12);
}

TEST(InstallAngle, allows_for_legs_of_unlike_length) {
  const Path path = joined({straight(2.0), Path{{{0.0, 1.3, 0.0}, 6.5}}});
  const LRun run = l_run_of(simulate(scenario_with(-0.1, path)).recording, two_pods(0.0));
  EXPECT_NEAR(run.leg_ratio, 0.65, 1e-12);
  EXPECT_NEAR(install_angle(std::vector{run}).alpha_rad, -0.1, 1e-12);
}

TEST(InstallAngle, is_the_same_driven_backwards) {
  const LRun forwards = l_run_with(0.1);
  const LRun backwards{.side_m = 2.0, .end_x_m = -forwards.end_x_m, .end_y_m = -forwards.end_y_m};
  EXPECT_EQ(install_angle(std::vector{backwards}).alpha_rad, install_angle(std::vector{forwards}).alpha_rad);
}

LRun seen_from(LRun run, double start_heading_error) {
  const Vector2 end = rotation(-start_heading_error) * Vector2(run.end_x_m, run.end_y_m);
  return {.side_m = run.side_m, .end_x_m = end.x(), .end_y_m = end.y()};
}

TEST(InstallAngle, an_error_of_the_start_heading_counts_twice) {
  const double error = radians(1.0);
  for (const double sense : {1.0, -1.0}) {
    const LRun run = seen_from(l_run_with(0.05, 2.0, sense), error);
    EXPECT_NEAR(install_angle(std::vector{run}).alpha_rad - 0.05, 2.0 * error, 1e-12);
  }
}

TEST(InstallAngle, unlike_scales_cancel_between_runs_to_the_two_sides) {
  LRun plain = l_run_with(0.0);
  LRun mirrored = l_run_with(0.0, 2.0, -1.0);
  plain.end_y_m *= 1.01;
  mirrored.end_y_m *= 1.01;
  const InstallAngle both = install_angle(std::vector{plain, mirrored, mirrored});
  EXPECT_NEAR(both.alpha_rad, 0.0, 1e-12);
  EXPECT_NEAR(*both.between_senses_rad, 0.01, 1e-4);
  EXPECT_THAT(install_angle(std::vector{plain}).warnings, Contains(HasSubstr("all runs go to one side")));
  EXPECT_THAT(
      install_angle(std::vector{plain, mirrored}, {.sigma_m = 0.0, .sigma_heading_rad = 1e-3}).warnings,
      Contains(HasSubstr("pod 1 rolls +1.0 % further")));
}

TEST(InstallAngle, one_percent_between_the_scales_looks_like_half_a_degree) {
  LRun run = l_run_with(0.0);
  run.end_y_m *= 1.01;
  EXPECT_NEAR(degrees(install_angle(std::vector{run}).alpha_rad), -0.57, 0.005);
}

/// A run as measured: `options` has what it errs by, `common_rad` what its start heading shares with others.
LRun measured(const LRun& truth, const InstallAngleOptions& options, double common_rad, Random& random) {
  const double own_rad =
      options.start_heading == StartHeading::each_run ? options.sigma_heading_rad * random.normal() : 0.0;
  LRun run = seen_from(truth, common_rad + own_rad);
  run.end_x_m += options.sigma_m * random.normal();
  run.end_y_m += options.sigma_m * random.normal();
  return run;
}

// Of the mean of several runs to both sides, aligned once or anew for each.
TEST(InstallAngle, sigma_is_the_scatter_of_measured_ends) {
  constexpr double kAlpha = 0.1;
  const int trials = test::trials(4000);
  for (const StartHeading start_heading : {StartHeading::one_alignment, StartHeading::each_run})
    for (const int runs : {1, 2, 4}) {
      const InstallAngleOptions options{
          .sigma_m = 0.01, .sigma_heading_rad = radians(0.5), .start_heading = start_heading};
      Random random(7, 1);
      double squares = 0.0, predicted = 0.0;
      for (int i = 0; i < trials; ++i) {
        const double common =
            start_heading == StartHeading::one_alignment ? options.sigma_heading_rad * random.normal() : 0.0;
        std::vector<LRun> all;
        for (int k = 0; k < runs; ++k)
          all.push_back(measured(l_run_with(kAlpha, 1.5, k % 2 == 0 ? 1.0 : -1.0), options, common, random));
        const InstallAngle found = install_angle(all, options);
        if (found.sigma_from_scatter) continue;
        squares += std::pow((found.alpha_rad - kAlpha) / found.sigma_rad, 2);
        predicted += 1.0;
      }
      // The scatter of runs does not depend on their mean. σ of a standard deviation of n values: √(1/2n).
      EXPECT_NEAR(std::sqrt(squares / predicted), 1.0, 4.0 / std::sqrt(2.0 * predicted))
          << runs << " runs, start heading " << static_cast<int>(start_heading);
    }
}

TEST(InstallAngle, repeats_average_what_errs_anew_and_no_more) {
  const std::vector<LRun> four = {l_run_with(0.1), l_run_with(0.1), l_run_with(0.1), l_run_with(0.1)};
  const std::vector<LRun> one = {four.front()};
  const auto sigma = [](const std::vector<LRun>& runs, double sigma_m, StartHeading start_heading) {
    return install_angle(runs, {.sigma_m = sigma_m, .start_heading = start_heading}).sigma_rad;
  };
  EXPECT_NEAR(sigma(four, 0.01, StartHeading::each_run), 0.5 * sigma(one, 0.01, StartHeading::each_run),
              1e-12);
  EXPECT_NEAR(sigma(four, 0.0, StartHeading::one_alignment), sigma(one, 0.0, StartHeading::one_alignment),
              1e-12);
}

// Runs that scatter by three times what measuring explains: the 95 % interval still holds the angle.
TEST(InstallAngle, scatter_beyond_measuring_is_what_sigma_is_from) {
  constexpr double kAlpha = 0.1;
  const int trials = test::trials(4000);
  const InstallAngleOptions truth{
      .sigma_m = 0.0, .sigma_heading_rad = radians(0.6), .start_heading = StartHeading::each_run};
  const InstallAngleOptions said{
      .sigma_m = 0.0, .sigma_heading_rad = radians(0.2), .start_heading = StartHeading::each_run};
  for (const int runs : {3, 6}) {
    Random random(8, 1);
    int from_scatter = 0, inside = 0;
    for (int i = 0; i < trials; ++i) {
      std::vector<LRun> all;
      for (int k = 0; k < runs; ++k) all.push_back(measured(l_run_with(kAlpha), truth, 0.0, random));
      const InstallAngle found = install_angle(all, said);
      if (!found.sigma_from_scatter) continue;
      ++from_scatter;
      inside += std::abs(found.alpha_rad - kAlpha) <= 1.959964 * found.sigma_rad ? 1 : 0;
    }
    // P(scatter > said) = P(χ²/dof > 1/9): 0.8948 for 2, 0.9899 for 5 degrees of freedom. Mean and scatter
    // are independent, and a larger scatter is a larger interval: at least 95 %.
    const double expected = runs == 3 ? 0.8948 : 0.9899;
    const double sigma = std::sqrt(expected * (1.0 - expected) * trials);
    EXPECT_NEAR(from_scatter, expected * trials, 3.0 * sigma + 0.5);
    EXPECT_GE(static_cast<double>(inside) / from_scatter, 0.95 - 3.0 * std::sqrt(0.95 * 0.05 / from_scatter));
  }
}

TEST(InstallAngle, one_run_has_no_scatter) {
  const InstallAngle found = install_angle(std::vector{l_run_with(0.1)});
  EXPECT_FALSE(found.scatter_rad);
  EXPECT_FALSE(found.sigma_from_scatter);
}

TEST(InstallAngle, the_way_along_x_shows_the_scale_of_pod_2) {
  LRun run = l_run_with(0.0);
  run.end_x_m *= 1.08;
  run.end_y_m *= 1.08;
  const InstallAngle found = install_angle(std::vector{run});
  EXPECT_NEAR(found.scale, 1.08, 1e-12);
  EXPECT_THAT(found.warnings, Contains(HasSubstr("1.080 m for each metre")));
}

TEST(InstallAngle, refuses_numbers_that_are_none) {
  for (const LRun& run : {LRun{0.0, 1.0, 1.0}, LRun{-1.0, 1.0, 1.0}, LRun{std::nan(""), 1.0, 1.0},
                          LRun{1.0, std::nan(""), 1.0}, LRun{1.0, 1.0, INFINITY}})
    EXPECT_THROW(install_angle(std::vector{run}), InputError);
  EXPECT_THROW(install_angle({}), InputError);
  EXPECT_THROW(install_angle(std::vector{l_run_with(0.0)}, {.sigma_m = -1.0}), InputError);
}

TEST(InstallAngle, says_when_the_end_is_not_that_of_an_l) {
  for (const LRun& run : {LRun{1.0, 0.0, 0.0}, LRun{1.0, 1.0, 0.0}, LRun{1.0, 0.0, 1.0}, LRun{1.0, 3.0, 3.0}})
    EXPECT_THROW(install_angle(std::vector{run}), CannotAnswer);
  EXPECT_THROW(install_angle(std::vector{l_run_with(0.0, 0.1)}, {.sigma_m = 0.05}), CannotAnswer);
}

template <class Spoil>
std::string refusal_of(const Spoil& spoil, const Path& path = l_run(1.0)) {
  Recording recording = simulate(scenario_with(0.0, path)).recording;
  spoil(recording);
  try {
    l_run_of(recording, two_pods(0.0));
  } catch (const CannotAnswer& reason) {
    return reason.what();
  }
  return "accepted";
}

TEST(InstallAngle, names_swapped_ports_and_a_pod_that_counts_backwards) {
  EXPECT_THAT(refusal_of([](Recording& r) { std::swap(r.wheels.series[0].value, r.wheels.series[1].value); }),
              HasSubstr("ports of 'ahead' and 'across' are swapped"));
  EXPECT_THAT(
      refusal_of([](Recording& r) {
        for (double& v : r.wheels.series[1].value) v = -v;
      }),
      HasSubstr("'across' reads -1.000 m where the robot moved 1.000 m that way: it counts backwards"));
}

TEST(InstallAngle, refuses_recordings_of_other_runs) {
  const auto nothing = [](Recording&) {};
  EXPECT_THAT(refusal_of(nothing, circle(1.0, 1.0, TurnSense::ccw)), Not(HasSubstr("accepted")));
  EXPECT_THAT(refusal_of(nothing, {{{1.0, 1.0, 0.0}, 5.0}}), HasSubstr("roll at the same time"));
  EXPECT_THAT(refusal_of(nothing, pause(5.0)), HasSubstr("never roll"));
  EXPECT_THAT(refusal_of([](Recording& r) { r.reference = {}; }), HasSubstr("not measured"));
  EXPECT_THAT(refusal_of([](Recording& r) { std::ranges::fill(r.reference.heading_rad, kNotMeasured); }),
              HasSubstr("no heading"));
  EXPECT_THROW(refusal_of([](Recording& r) { r.reference.heading_rad.clear(); }), InputError);
  Robot three = two_pods(0.0);
  three.chassis.add(three.chassis.wheels()[0]);
  three.wheel_names.push_back("third");
  EXPECT_THROW(l_run_of(simulate(scenario_with(0.0, l_run(1.0))).recording, three), InputError);
}

}  // namespace
}  // namespace trundle::calibration
