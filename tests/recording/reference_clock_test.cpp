#include <array>
#include <cmath>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "trundle/recording/detail/motion_path.hpp"
#include "trundle/recording/time_offset.hpp"
#include "trundle/simulation/scenario.hpp"
#include "trundle/statistics/distribution.hpp"

#include "recording/cut.hpp"
#include "recording/robots.hpp"
#include "scale.hpp"

namespace trundle::recording {
using namespace simulation;
namespace {

struct Sampling {
  double encoders_hz;
  double reference_hz;
};

/// Fine counts; sensors away from the middle, which is not what the robot file says.
Robot robot_on_clocks(double reference_s, double sightings_s) {
  Robot robot = test::two_wheels();
  robot.chassis.noise.wheel_per_sqrt_m = 0.003;
  for (Wheel& wheel : robot.chassis.wheels()) wheel.ticks_per_revolution = 5000.0;
  robot.reference_time_offset_s = reference_s;
  robot.landmark_sensor = LandmarkSensor{.body_from_sensor = {0.1, 0.0, 0.0},
                                         .range_sigma_m = 0.02,
                                         .bearing_sigma_rad = 0.01,
                                         .max_range_m = 8.0,
                                         .time_offset_s = sightings_s};
  return robot;
}

Scenario scenario_along(const Path& path, double reference_s, const Sampling& sampling, std::uint64_t seed) {
  Scenario scenario;
  scenario.nominal = robot_on_clocks(0.0, 0.0);
  scenario.truth = robot_on_clocks(reference_s, 0.0);
  scenario.path = path;
  scenario.steering = Steering::truth;
  scenario.whole_intervals = false;
  scenario.encoders.rate_hz = sampling.encoders_hz;
  scenario.reference = {
      .rate_hz = sampling.reference_hz, .position_sigma_m = 0.002, .heading_sigma_rad = 0.005};
  scenario.seed = seed;
  return scenario;
}

Path tour(double length_m, std::uint64_t seed) {
  Random random(seed, 99);
  return random_tour({.length_m = length_m}, {}, random);
}

std::vector<Landmark> landmarks_around() {
  std::vector<Landmark> landmarks;
  for (int i = 0; i < 12; ++i)
    landmarks.push_back({std::to_string(i), 4.0 * Vector2(std::cos(0.5 * i), std::sin(0.5 * i))});
  return landmarks;
}

std::optional<TimeOffset> found_in(const Recording& recording) {
  const Robot robot = robot_on_clocks(0.0, 0.0);
  return reference_time_offset(recording.reference, align(recording, robot), robot);
}

TEST(ReferenceClock, IsFoundWithinItsSigmaAtSeveralRates) {
  constexpr std::array kOffsets_s = {0.3, -3.0, -0.4, -0.05, 0.0, 0.012, 0.1, 2.0};
  const auto offsets_s =
      std::span(kOffsets_s).first(static_cast<std::size_t>(test::trials(kOffsets_s.size(), 2)));
  double squares = 0.0;
  int trials = 0;
  std::uint64_t seed = 1;
  for (const Sampling& sampling :
       {Sampling{20.0, 100.0}, Sampling{50.0, 20.0}, Sampling{10.0, 50.0}, Sampling{100.0, 10.0}})
    for (const double offset_s : offsets_s) {
      const auto found =
          found_in(simulate(scenario_along(tour(20.0, seed), offset_s, sampling, seed)).recording);
      ++seed;
      ASSERT_TRUE(found) << sampling.reference_hz << " Hz, " << offset_s << " s";
      const double error = found->offset_s - offset_s;
      EXPECT_LT(std::abs(error), 4.0 * found->sigma_s) << sampling.reference_hz << " Hz, " << offset_s;
      EXPECT_LT(found->sigma_s, 0.02);
      squares += std::pow(error / found->sigma_s, 2);
      ++trials;
    }
  constexpr double kChance = 0.017;  // of a mean of 1.6 over 32
  EXPECT_LT(squares, statistics::chi_squared_limit(kChance, trials));
}

TEST(ReferenceClock, AReferenceWithoutHeadingsTellsByItsWays) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Recording recording = simulate(scenario_along(tour(20.0, seed), 0.2, {20.0, 20.0}, seed)).recording;
    for (double& heading : recording.reference.heading_rad) heading = kNotMeasured;
    const auto found = found_in(recording);
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->offset_s, 0.2, 4.0 * found->sigma_s);
  }
}

// A lap later all looks the same but for the noise, and one of some laps fits best by chance: in half of
// these drives, were the least misfit to decide alone.
TEST(ReferenceClock, WhoDrivesLapsIsNotALapLate) {
  const Pace pace{.forward_m_s = 0.4, .turn_rad_s = 0.5, .rest_s = 0.0};
  const Path lap = joined({straight(1.6, pace), circle(0.8, 0.25, TurnSense::ccw, pace)});
  Path laps;
  for (int i = 0; i < 16; ++i) laps = joined({laps, lap});
  int found_in_all = 0;
  for (std::uint64_t seed = 1; seed <= static_cast<std::uint64_t>(test::trials(12, 3)); ++seed)
    for (const double offset_s : {0.0, -0.15}) {
      Scenario scenario = scenario_along(laps, offset_s, {50.0, 30.0}, seed);
      for (Wheel& wheel : scenario.truth.chassis.wheels()) wheel.ticks_per_revolution = 200.0;
      scenario.nominal = scenario.truth;
      scenario.nominal.reference_time_offset_s = 0.0;
      const Recording recording = simulate(scenario).recording;
      const auto found =
          reference_time_offset(recording.reference, align(recording, scenario.nominal), scenario.nominal);
      if (!found) continue;
      ++found_in_all;
      EXPECT_NEAR(found->offset_s, offset_s, 4.0 * found->sigma_s + 0.01) << seed;
    }
  EXPECT_GE(found_in_all, test::trials(12, 3));
}

TEST(ReferenceClock, MotionThatNeverChangesTellsNothing) {
  for (int seed = 1; seed <= test::trials(20, 4); ++seed)
    for (const Path& path : {straight(8.0), circle(1.0, 3.0, TurnSense::ccw)}) {
      const auto found = found_in(
          simulate(scenario_along(path, 0.1, {20.0, 50.0}, static_cast<std::uint64_t>(seed))).recording);
      if (found) {
        EXPECT_NEAR(found->offset_s, 0.1, 4.0 * found->sigma_s) << seed;
      }
    }
}

TEST(ReferenceClock, AJumpOfTheReferenceDoesNoHarm) {
  Recording recording = simulate(scenario_along(tour(20.0, 7), 0.25, {20.0, 50.0}, 7)).recording;
  ReferenceStream& reference = recording.reference;
  for (std::size_t i = reference.time_s.size() / 2; i < reference.time_s.size(); ++i) reference.x_m[i] += 2.0;
  const auto found = found_in(recording);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->offset_s, 0.25, 4.0 * found->sigma_s);
}

TEST(ReferenceClock, ATrajectoryTellsItLikeTheSensors) {
  Robot robot = robot_on_clocks(0.0, 0.0);
  robot.reference_time_offset_s = 0.1;
  for (const double offset_s : {-0.4, 0.1, 0.2}) {
    Scenario scenario = scenario_along(tour(20.0, 4), offset_s, {20.0, 50.0}, 4);
    scenario.truth.body_from_reference = robot.body_from_reference = {0.2, 0.1, 0.5};
    const Simulation simulation = simulate(scenario);
    Trajectory reference;
    const ReferenceStream& stream = simulation.recording.reference;
    for (std::size_t i = 0; i < stream.time_s.size(); ++i)
      reference.poses.push_back(
          {stream.time_s[i], {stream.x_m[i], stream.y_m[i], wrap_angle(stream.heading_rad[i])}});
    const auto found = reference_time_offset(reference, simulation.truth.body, 0.5, robot);
    ASSERT_TRUE(found) << offset_s;
    EXPECT_NEAR(found->offset_s, offset_s, 4.0 * found->sigma_s);
    EXPECT_EQ(is_off(*found, robot.reference_time_offset_s), offset_s != 0.1);
    EXPECT_FALSE(reference_time_offset(reference, {}, 0.5, robot));
    EXPECT_FALSE(reference_time_offset({}, simulation.truth.body, 0.5, robot));
  }
}

TEST(ReferenceClock, IsSetOnlyWhereItIsOff) {
  const Robot robot = robot_on_clocks(0.0, 0.0);
  for (const double offset_s : {0.0, 0.04, 0.2}) {
    Recording recording = simulate(scenario_along(tour(20.0, 3), offset_s, {20.0, 50.0}, 3)).recording;
    const ReferenceStream before = recording.reference;
    const auto moved = set_reference_clock(found_in(recording), robot, recording.reference);
    EXPECT_EQ(moved.has_value(), offset_s > 0.07);  // steps at 20 and 50 Hz
    const double by = recording.reference.time_s.front() - before.time_s.front();
    EXPECT_NEAR(by, moved ? offset_s : 0.0, 0.03);
    if (!moved) {
      EXPECT_EQ(recording.reference.time_s, before.time_s);
    }
  }
}

TEST(ReferenceClock, PiecesThatAreTooShortTellItTogether) {
  const Robot robot = robot_on_clocks(0.0, 0.0);
  const Recording whole = simulate(scenario_along(tour(30.0, 5), 0.1, {20.0, 20.0}, 5)).recording;
  std::vector<Recording> pieces;
  for (double start_s = 1.0; start_s < 60.0; start_s += 3.0)
    pieces.push_back(test::cut(whole, start_s, start_s + 2.5));
  std::vector<AlignedReadings> readings;
  for (const Recording& piece : pieces) readings.push_back(align(piece, robot));
  std::vector<ReferenceLog> logs;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    EXPECT_FALSE(reference_time_offset(pieces[i].reference, readings[i], robot)) << i;
    logs.push_back({pieces[i].reference, readings[i]});
  }
  const auto found = reference_time_offset(logs, robot);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->offset_s, 0.1, 4.0 * found->sigma_s);
  EXPECT_LT(found->sigma_s, 0.02);
}

TEST(SightingClock, IsFoundWithinItsSigma) {
  double squares = 0.0;
  int trials = 0;
  const auto seeds = static_cast<std::uint64_t>(test::trials(4, 1));
  for (const double offset_s : {-0.4, -0.1, 0.0, 0.05, 0.3}) {
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
      Scenario scenario = scenario_along(tour(25.0, seed), 0.0, {20.0, 20.0}, seed);
      scenario.truth = robot_on_clocks(0.0, offset_s);
      scenario.landmarks = landmarks_around();
      scenario.sightings.rate_hz = 10.0;
      const Recording recording = simulate(scenario).recording;
      const Robot robot = robot_on_clocks(0.0, 0.0);
      const auto found = sighting_time_offset(recording.sightings, align(recording, robot), robot);
      ASSERT_TRUE(found) << offset_s << " s";
      const double error = found->offset_s - offset_s;
      EXPECT_LT(std::abs(error), 4.5 * found->sigma_s) << offset_s << " s";
      squares += std::pow(error / found->sigma_s, 2);
      ++trials;
    }
  }
  EXPECT_LT(squares / trials, 2.0);
}

// Wheels of coarse counts that scatter by 1 % of √m beside bends of some seconds: an offset was found
// wherever they scattered least by chance, up to 0.2 s off, and three of its sigmas.
TEST(SightingClock, IsNoneOfTheNoiseOfWheels) {
  double squares = 0.0;
  int told = 0;
  const auto seeds = static_cast<std::uint64_t>(test::trials(40, 20));
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    Random random(seed, 98);
    Path path;
    for (int i = 0; i < 12; ++i) path.push_back({{2.5, 0.0, 0.5 + 0.5 * random.normal(1.0)}, 5.0});
    Scenario scenario = scenario_along(path, 0.0, {100.0, 20.0}, seed);
    scenario.truth.chassis.noise.wheel_per_sqrt_m = 0.01;
    for (Robot* robot : {&scenario.truth, &scenario.nominal})
      for (Wheel& wheel : robot->chassis.wheels()) wheel.ticks_per_revolution = 360.0;
    scenario.landmarks = landmarks_around();
    scenario.sightings.rate_hz = 5.0;
    scenario.truth.landmark_sensor->time_offset_s = seed % 2 == 0 ? 0.0 : -0.25;
    Recording recording = simulate(scenario).recording;
    for (double& time_s : recording.wheels.time_s) time_s += 0.23;  // a log that does not begin at 0
    for (Sighting& sighting : recording.sightings) sighting.time_s += 0.23;
    const auto found =
        sighting_time_offset(recording.sightings, align(recording, scenario.nominal), scenario.nominal);
    if (!found) continue;
    squares +=
        std::pow((found->offset_s - scenario.truth.landmark_sensor->time_offset_s) / found->sigma_s, 2);
    ++told;
  }
  EXPECT_GE(told, static_cast<int>(seeds) / 4);
  EXPECT_LT(squares, chi_squared_limit(1e-3, told));
}

/// A body that goes ahead ever faster, from 0.1 s on, whose 0.1 is not the sum of its steps.
MotionPath speeding_path() {
  MotionPath path{.time_s = {0.1}, .poses = {Pose2{}}, .twists = {}, .bridged = {}};
  for (int i = 0; i < 100; ++i) {
    path.time_s.push_back(0.1 + 0.05 * (i + 1));
    path.twists.push_back({0.001 * i, 0.0, 0.01});
    path.poses.push_back(path.poses.back() * exp(path.twists.back()));
    path.bridged.push_back(false);
  }
  return path;
}

TEST(MotionPath, SmoothedIsTheMeanOfAsMuchAheadAsBack) {
  const MotionPath path = speeding_path();
  MotionPath with_gap = path;
  with_gap.bridged[50] = true;
  with_gap.twists[50] = {3.0, 0.0, 0.0};
  for (const double over_s : {0.3, 1.0, 2.0}) {
    const auto half = static_cast<std::size_t>(std::ceil(0.5 * over_s / 0.05));
    const MotionPath smooth = smoothed(path, over_s), beside = smoothed(with_gap, over_s);
    Vector3 sum = Vector3::Zero(), smooth_sum = Vector3::Zero();
    for (std::size_t i = 0; i < path.twists.size(); ++i) {
      // Of what changes evenly the mean is what is in the middle; less is known of it at the ends.
      const bool is_inside = i >= half && i + half < path.twists.size();
      const bool is_off_the_gap = i + half < 50 || i > 50 + half || i == 50;
      EXPECT_NEAR(smooth.twists[i].dx, path.twists[i].dx, is_inside ? 1e-9 : 0.01) << over_s << " s, " << i;
      EXPECT_NEAR(smooth.twists[i].dtheta, 0.01, 1e-9) << over_s << " s, " << i;
      EXPECT_NEAR(beside.twists[i].dx, with_gap.twists[i].dx, is_inside && is_off_the_gap ? 1e-9 : 0.01)
          << over_s << " s beside a gap, " << i;
      sum += path.twists[i].vector();
      smooth_sum += smooth.twists[i].vector();
    }
    EXPECT_NEAR((smooth_sum - sum).norm(), 0.0, 1e-9);  // and it goes as far
  }
}

TEST(SightingClock, LandmarksWithoutNamesTellNothing) {
  Scenario scenario = scenario_along(tour(25.0, 1), 0.0, {20.0, 20.0}, 1);
  scenario.landmarks = landmarks_around();
  scenario.sightings.rate_hz = 10.0;
  Recording recording = simulate(scenario).recording;
  for (Sighting& sighting : recording.sightings) sighting.landmark.clear();
  const Robot robot = robot_on_clocks(0.0, 0.0);
  EXPECT_FALSE(sighting_time_offset(recording.sightings, align(recording, robot), robot));
}

}  // namespace
}  // namespace trundle::recording
