#include "trundle/simulation/sensors.hpp"

#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "robots.hpp"

namespace trundle::simulation {
namespace {

using test::exact_scenario;
using test::quiet_differential;

Scenario tour(double length_m = 20.0) {
  Random random(3);
  return exact_scenario(quiet_differential(), quiet_differential(),
                        random_tour({.length_m = length_m}, {}, random));
}

TEST(Encoders, RoundedCountsStayWithinHalfATick) {
  Scenario exact = tour();
  Scenario rounded = exact;
  rounded.encoders.quantised = true;
  const auto a = simulate(exact).recording.wheels;
  const auto b = simulate(rounded).recording.wheels;
  double worst = 0.0;
  for (std::size_t i = 0; i < a.time_s.size(); ++i) {
    EXPECT_EQ(b.series[1].value[i], std::round(b.series[1].value[i]));
    worst = std::max(worst, std::abs(a.series[1].value[i] - b.series[1].value[i]));
  }
  EXPECT_LE(worst, 0.5);
  EXPECT_GT(worst, 0.4);  // of some hundred samples
}

TEST(Encoders, CountersWrapBothWays) {
  Scenario scenario =
      exact_scenario(quiet_differential(), quiet_differential(), joined({straight(2.0), straight(-4.0)}));
  scenario.encoders.quantised = true;
  scenario.truth.chassis.wheels()[0].tick_bits = 8;
  scenario.truth.chassis.wheels()[0].ticks_per_revolution = -2000.0;
  const auto wheels = simulate(scenario).recording.wheels;
  std::set<double> seen;
  for (std::size_t i = 0; i < wheels.time_s.size(); ++i) {
    const double value = wheels.series[0].value[i];
    EXPECT_GE(value, 0.0);
    EXPECT_LT(value, 256.0);
    EXPECT_EQ(std::remainder(value + wheels.series[1].value[i], 256.0),
              0.0);  // the other wheel counts forwards
    seen.insert(value);
  }
  EXPECT_GT(seen.size(), 100u);
}

TEST(Encoders, EveryUnitTellsTheSameTravel) {
  Scenario scenario = tour(5.0);
  const auto ticks = simulate(scenario).recording.wheels;
  scenario.encoders.unit = WheelUnit::metres;
  const auto metres = simulate(scenario).recording.wheels;
  scenario.encoders.unit = WheelUnit::rate;
  const auto rates = simulate(scenario).recording.wheels;
  double sum = 0.0;
  for (std::size_t i = 0; i < ticks.time_s.size(); ++i) {
    const double turned = ticks.series[0].value[i] / 2000.0;
    sum += rates.series[0].value[i] / (2.0 * kPi * 20.0);
    EXPECT_NEAR(metres.series[0].value[i], turned * kPi * 0.15, 1e-9);
    EXPECT_NEAR(sum, turned, 1e-9);
  }
}

TEST(Encoders, StampsCarryStartAndOffset) {
  Scenario scenario = tour(2.0);
  scenario.start_s = 1000.0;
  scenario.truth.chassis.wheels_time_offset_s = 0.03;
  const Simulation simulation = simulate(scenario);
  EXPECT_NEAR(simulation.recording.wheels.time_s.front(), 999.97, 1e-9);  // true time = stamp + offset
  EXPECT_NEAR(simulation.truth.body.poses.front().time_s, 1000.0, 1e-9);
}

TEST(Velocity, OfARobotWithoutWheelsIntegratesToTheTruth) {
  Robot robot;
  robot.chassis.noise = {0.0, 0.0, 0.0, 0.0, 0.0};
  Scenario scenario = exact_scenario(robot, robot, square(1.0, TurnSense::ccw));
  const Simulation simulation = simulate(scenario);
  const auto& velocity = simulation.recording.velocity;
  EXPECT_TRUE(simulation.recording.wheels.time_s.empty());
  Pose2 pose;
  for (std::size_t i = 1; i < velocity.time_s.size(); ++i)
    pose = pose * exp({0.05 * velocity.forward_m_s[i], 0.0, 0.05 * velocity.yaw_rate_rad_s[i]});
  EXPECT_NEAR(pose.x, 0.0, 1e-9);
  EXPECT_NEAR(pose.heading, 2.0 * kPi, 1e-9);
}

Scenario with_gyro(const Gyro& gyro) {
  Scenario scenario = tour();
  scenario.truth.chassis.gyro = gyro;
  return scenario;
}

TEST(GyroReadings, IntegralIsTheTurnWithoutBiasAndScale) {
  const Scenario scenario = with_gyro({0.02, -1.05, 0.0, 0.0, 8.7, 0.0});
  const Simulation simulation = simulate(scenario);
  double turned = 0.0;
  for (const double reading : simulation.recording.gyro.yaw_rate_rad_s)
    turned += (reading - 0.02) * -1.05 / 100.0;
  EXPECT_NEAR(turned, simulation.truth.body.poses.back().pose.heading, 1e-9);
}

TEST(GyroReadings, NoiseBiasWalkAndSaturationAreAsDescribed) {
  Scenario scenario = exact_scenario(quiet_differential(), quiet_differential(), pause(400.0));
  scenario.truth.chassis.gyro = Gyro{0.1, 1.0, 0.002, 0.0, 8.7, 0.0};
  const auto rates = simulate(scenario).recording.gyro.yaw_rate_rad_s;
  double mean = 0.0, variance = 0.0;
  const auto n = static_cast<double>(rates.size());
  for (const double r : rates) mean += r / n;
  for (const double r : rates) variance += (r - mean) * (r - mean) / (n - 1.0);
  EXPECT_NEAR(mean, 0.1, 4.0 * 0.02 / std::sqrt(n));
  EXPECT_NEAR(std::sqrt(variance), 0.02, 4.0 * 0.02 / std::sqrt(2.0 * n));  // 0.002 · √100

  scenario.path = pause(25.0);
  scenario.truth.chassis.gyro = Gyro{0.0, 1.0, 0.0, 0.01, 8.7, 0.0};
  double sum2 = 0.0;
  for (std::uint64_t seed = 0; seed < 500; ++seed) {
    scenario.seed = seed;
    sum2 += std::pow(simulate(scenario).truth.last_gyro_bias_rad_s, 2);
  }
  EXPECT_NEAR(sum2 / 500.0 / (0.01 * 0.01 * 25.0), 1.0, 4.0 * std::sqrt(2.0 / 499.0) + 0.001);

  scenario.path = turn_on_the_spot(3.0, {.turn_rad_s = 2.0});
  scenario.truth.chassis.gyro = Gyro{0.0, 1.0, 0.0, 0.0, 0.5, 0.0};
  for (const double rate : simulate(scenario).recording.gyro.yaw_rate_rad_s) EXPECT_LE(rate, 0.5);
}

TEST(Reference, IsThePoseOfItsSensorAtTheTimeItIsMeant) {
  Scenario scenario = tour(5.0);
  scenario.truth.body_from_reference = {0.2, -0.1, 0.3};
  scenario.truth.reference_time_offset_s = 0.04;
  scenario.reference.rate_hz = 7.0;
  const Simulation simulation = simulate(scenario);
  const auto& reference = simulation.recording.reference;
  ASSERT_GT(reference.time_s.size(), 100u);
  for (std::size_t i = 0; i < reference.time_s.size(); ++i) {
    const auto body = pose_at(simulation.truth.body, reference.time_s[i] + 0.04, 1.0);
    ASSERT_TRUE(body || i == 0 || i + 1 == reference.time_s.size());
    if (!body) continue;
    const Pose2 sensor = *body * scenario.truth.body_from_reference;
    EXPECT_NEAR(reference.x_m[i], sensor.x, 1e-9);
    EXPECT_NEAR(reference.y_m[i], sensor.y, 1e-9);
    EXPECT_NEAR(wrap_angle(reference.heading_rad[i] - sensor.heading), 0.0, 1e-9);
  }
}

TEST(Reference, NoiseGapsAndMissingHeadings) {
  Scenario scenario = exact_scenario(quiet_differential(), quiet_differential(), pause(200.0));
  scenario.reference = {.rate_hz = 50.0, .with_heading = false, .position_sigma_m = 0.003};
  scenario.reference.gaps = {{20.0, 5.0}};
  const auto reference = simulate(scenario).recording.reference;
  double sum2 = 0.0;
  const auto n = static_cast<double>(reference.time_s.size());
  for (std::size_t i = 0; i < reference.time_s.size(); ++i) {
    EXPECT_FALSE(reference.time_s[i] > 20.0 && reference.time_s[i] < 25.0);
    EXPECT_TRUE(std::isnan(reference.heading_rad[i]));
    sum2 += reference.x_m[i] * reference.x_m[i];
  }
  EXPECT_NEAR(n, 50.0 * 195.0, 5.0);
  EXPECT_NEAR(sum2 / n / 9e-6, 1.0, 4.0 * std::sqrt(2.0 / n));
}

TEST(Reference, WanderIsCorrelatedOverItsTime) {
  Scenario scenario = exact_scenario(quiet_differential(), quiet_differential(), pause(20000.0));
  scenario.encoders.rate_hz = 1.0;
  scenario.reference = {.rate_hz = 1.0, .wander_sigma_m = 0.05, .wander_time_s = 10.0};
  const auto x = simulate(scenario).recording.reference.x_m;
  double variance = 0.0, covariance = 0.0;
  constexpr std::size_t lag = 10;
  for (std::size_t i = 0; i + lag < x.size(); ++i) variance += x[i] * x[i], covariance += x[i] * x[i + lag];
  const auto n = static_cast<double>(x.size() - lag);
  // About n/20 independent values: 2τ samples each.
  EXPECT_NEAR(variance / n / 0.0025, 1.0, 4.0 * std::sqrt(2.0 * 10.0 / n));
  EXPECT_NEAR(covariance / variance, std::exp(-1.0), 4.0 * std::sqrt(20.0 / n));
}

TEST(PartialReference, MeasuresTheRunAsAWhole) {
  Scenario scenario = exact_scenario(quiet_differential(), quiet_differential(), l_run_with_turn(2.0));
  scenario.start = {5.0, 1.0, 1.0};
  scenario.partial = {.end_pose = true, .distance = true, .turns = true, .closed = true};
  scenario.partial.position_sigma_m = scenario.partial.heading_sigma_rad = 1e-9;
  const PartialReference partial = simulate(scenario).recording.partial;
  EXPECT_NEAR(partial.end_x_m->value, 2.0, 1e-7);
  EXPECT_NEAR(partial.end_y_m->value, 2.0, 1e-7);
  EXPECT_NEAR(partial.end_heading_rad->value, 0.5 * kPi, 1e-7);
  EXPECT_NEAR(partial.distance_m->value, std::sqrt(8.0), 1e-7);
  EXPECT_NEAR(partial.turns->value, 0.25, 1e-7);
  EXPECT_EQ(partial.closed->value, 0.0);
  EXPECT_TRUE(simulate(tour()).recording.partial.empty());
}

Scenario among_landmarks() {
  Scenario scenario = tour();
  scenario.truth.landmark_sensor = LandmarkSensor{{0.2, 0.05, 0.4}, 0.0, 0.0, 2.0, 0.0};
  scenario.sightings.rate_hz = 2.0;
  Random random(8);
  scenario.landmarks = random_landmarks(15, 6.0, 6.0, 0.5, random);
  return scenario;
}

TEST(Sightings, PointFromTheSensorAtTheLandmark) {
  const Scenario scenario = among_landmarks();
  const Simulation simulation = simulate(scenario);
  ASSERT_GT(simulation.recording.sightings.size(), 100u);
  for (const Sighting& sighting : simulation.recording.sightings) {
    const Pose2 sensor = *pose_at(simulation.truth.body, sighting.time_s, 10.0) *
                         scenario.truth.landmark_sensor->body_from_sensor;
    const Vector2 seen = sensor * Vector2(sighting.range_m * std::cos(sighting.bearing_rad),
                                          sighting.range_m * std::sin(sighting.bearing_rad));
    const auto index = static_cast<std::size_t>(std::stoi(sighting.landmark) - 1);
    EXPECT_LT((seen - scenario.landmarks[index].position).norm(), 1e-9);
    EXPECT_LE(sighting.range_m, 2.0);
  }
  EXPECT_EQ(simulation.recording.landmarks.size(), 15u);
}

TEST(Sightings, FieldOfViewDetectionAndHiddenNames) {
  Scenario scenario = among_landmarks();
  const auto all = simulate(scenario).recording.sightings.size();
  scenario.sightings.field_of_view_rad = kPi;
  for (const Sighting& s : simulate(scenario).recording.sightings)
    EXPECT_LE(std::abs(s.bearing_rad), 0.5 * kPi);
  scenario.sightings = {.rate_hz = 2.0, .detection = 0.5, .hide_names = true};
  const auto half = simulate(scenario).recording.sightings;
  const auto n = static_cast<double>(all);
  EXPECT_NEAR(static_cast<double>(half.size()), 0.5 * n, 4.0 * 0.5 * std::sqrt(n));
  for (const Sighting& s : half) EXPECT_TRUE(s.landmark.empty());
}

TEST(Landmarks, KeepTheirDistance) {
  Random random(2);
  const auto landmarks = random_landmarks(20, 6.0, 4.0, 0.6, random);
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    EXPECT_LE(std::abs(landmarks[i].position.x()), 3.0);
    EXPECT_LE(std::abs(landmarks[i].position.y()), 2.0);
    for (std::size_t j = 0; j < i; ++j)
      EXPECT_GE((landmarks[i].position - landmarks[j].position).norm(), 0.6);
  }
}

Scenario noisy_everything() {
  Scenario scenario = among_landmarks();
  scenario.truth.chassis.noise = {};
  scenario.truth.chassis.gyro = Gyro{};
  scenario.truth.landmark_sensor = LandmarkSensor{};
  scenario.reference = {.rate_hz = 10.0, .position_sigma_m = 0.01};
  return scenario;
}

TEST(Simulate, EqualScenariosGiveEqualRecordings) {
  Scenario scenario = noisy_everything();
  const Simulation a = simulate(scenario);
  const Simulation b = simulate(scenario);
  EXPECT_EQ(a.recording.wheels.series[0].value, b.recording.wheels.series[0].value);
  EXPECT_EQ(a.recording.gyro.yaw_rate_rad_s, b.recording.gyro.yaw_rate_rad_s);
  EXPECT_EQ(a.recording.reference.x_m, b.recording.reference.x_m);
  EXPECT_EQ(a.recording.sightings.back().range_m, b.recording.sightings.back().range_m);
  scenario.seed = 2;
  EXPECT_NE(a.recording.reference.x_m, simulate(scenario).recording.reference.x_m);
}

TEST(Simulate, ASensorDoesNotDisturbTheOthers) {
  const Scenario with = noisy_everything();
  Scenario without = with;
  without.truth.chassis.gyro.reset();
  without.sightings.rate_hz = 0.0;
  without.reference.rate_hz = 0.0;
  const Simulation a = simulate(with);
  const Simulation b = simulate(without);
  EXPECT_TRUE(b.recording.gyro.time_s.empty());
  EXPECT_EQ(a.recording.wheels.series[0].value, b.recording.wheels.series[0].value);
  EXPECT_EQ(a.truth.body.poses.back().pose.x, b.truth.body.poses.back().pose.x);
}

}  // namespace
}  // namespace trundle::simulation
