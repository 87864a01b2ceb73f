// Noises learned from what the smoother leaves: of robots whose noises are known.
#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/io/error.hpp"
#include "trundle/slam/smoothing/landmark_calibration.hpp"
#include "trundle/statistics/distribution.hpp"

#include "calibration/simulated_runs.hpp"
#include "scale.hpp"

namespace trundle::slam {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::Not;

constexpr double kRange_m = 0.05;
constexpr double kBearing_rad = radians(1.0);
constexpr double kWheel = 0.01;

Robot noisy_robot() {
  Robot robot = test::nominal_differential();
  robot.chassis.noise.wheel_per_sqrt_m = kWheel;
  robot.landmark_sensor = LandmarkSensor{{0.1, 0.0, 0.05}, kRange_m, kBearing_rad, 5.0, 0.0};
  return robot;
}

/// The robot file errs by a factor of three, one way or the other.
Robot with_wrong_noise(Robot robot) {
  robot.chassis.noise.wheel_per_sqrt_m /= 3.0;
  robot.landmark_sensor->range_sigma_m *= 3.0;
  robot.landmark_sensor->bearing_sigma_rad /= 3.0;
  return robot;
}

Robot velocity_robot(const ChassisNoise& noise) {
  Robot robot;
  robot.name = "velocity";
  robot.landmark_sensor = noisy_robot().landmark_sensor;
  robot.chassis.noise = noise;
  return robot;
}

Recording recorded(const Robot& truth, double sightings_hz, double length_m, std::uint64_t seed,
                   double readings_hz = 10.0) {
  Random random(seed, 41);
  const Path path = random_tour({.length_m = length_m, .box_x_m = 6.0, .box_y_m = 6.0}, {}, random);
  Scenario scenario = test::scenario_of(with_wrong_noise(truth), truth, path, seed);
  scenario.landmarks = random_landmarks(10, 8.0, 8.0, 1.0, random);
  scenario.encoders.rate_hz = readings_hz;
  scenario.reference.rate_hz = 0.0;
  scenario.sightings = {.rate_hz = sightings_hz, .give_map = false};
  Recording recording = simulate(scenario).recording;
  recording.name = "tour";
  recording.session = "one";
  return recording;
}

CalibrationResult learned(const Recording& recording, const Robot& nominal) {
  return calibrate_from_landmarks({&recording, 1}, {}, nominal, {.learn_noise = true});
}

/// Value and sigma of a level as the robot file notes it: "name value ± sigma (was ...".
struct Learned {
  double value = 0.0, sigma = 0.0;
};
Learned level(const CalibrationResult& result, const std::string& name) {
  for (const std::string& note : result.notes)
    if (note.starts_with(name + " ")) {
      const std::size_t sign = note.find("±");
      return {std::stod(note.substr(name.size())), std::stod(note.substr(sign + std::string("±").size()))};
    }
  ADD_FAILURE() << name << " is not learned";
  return {1.0, 1.0};
}

// z = (found − true)/σ of each noise over all tours, at one rate: its mean is 0 within four standard
// deviations of such means of normal numbers, and its sum of squares is χ². The log of a variance is skew,
// which adds a bias of a third of σ at most: 0.3 of it is allowed for.
TEST(VarianceComponents, AreUnbiasedWithinTheirSigmas) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  constexpr double kChance = 2e-3;
  const int seeds = test::trials(8, 3);
  for (const double rate_hz : {0.5, 2.0, 5.0}) {
    std::map<std::string, std::pair<double, double>> sums;
    for (int seed = 1; seed <= seeds; ++seed) {
      const Robot truth = noisy_robot();
      const Recording recording = recorded(truth, rate_hz, 30.0, static_cast<std::uint64_t>(seed));
      const CalibrationResult result = learned(recording, with_wrong_noise(truth));
      for (const auto& [name, truly] :
           {std::pair<std::string, double>{"landmark_sensor.range_sigma_m", kRange_m},
            {"landmark_sensor.bearing_sigma_deg", degrees(kBearing_rad)},
            {"noise.wheel_per_sqrt_m", kWheel}}) {
        const Learned found = level(result, name);
        const double z = (found.value - truly) / found.sigma;
        sums[name].first += z;
        sums[name].second += z * z;
      }
    }
    for (const auto& [name, sum] : sums) {
      EXPECT_NEAR(sum.first / seeds, 0.0, 0.3 + 4.0 / std::sqrt(seeds)) << name << " at " << rate_hz;
      EXPECT_LT(sum.second, statistics::chi_squared_limit(kChance, seeds)) << name << " at " << rate_hz;
    }
  }
}

TEST(VarianceComponents, SayWhatStaysOpen) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  // No sideways noise in 30 m shows where the robot file says so little of it.
  const Robot truth = noisy_robot();
  const CalibrationResult result = learned(recorded(truth, 2.0, 30.0, 1), with_wrong_noise(truth));
  EXPECT_THAT(result.notes, Contains(HasSubstr("noise.lateral_per_sqrt_m stays 0.001")));
  EXPECT_EQ(result.calibrated.chassis.noise.lateral_per_sqrt_m, 0.001);
  EXPECT_THAT(result.calibrated.calibration->provenance,
              Contains(HasSubstr("noise.lateral_per_sqrt_m stays")));
}

TEST(VarianceComponents, ReportErrorsThatLast) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const Robot truth = noisy_robot();
  Recording recording = recorded(truth, 5.0, 30.0, 1);
  const auto words = testing::HasSubstr("errors of ranges last");
  EXPECT_THAT(learned(recording, truth).warnings, Not(Contains(words)));
  // Every landmark's ranges err alike for three seconds.
  for (Sighting& sighting : recording.sightings) {
    Random random(static_cast<std::uint64_t>(sighting.time_s / 3.0),
                  std::hash<std::string>{}(sighting.landmark));
    sighting.range_m += random.normal(0.1);
  }
  EXPECT_THAT(learned(recording, truth).warnings, Contains(words));
}

// By n residuals a noise is known to 1/√(2n) of itself at best, and of these drives there are 400. Where
// variances leaped with the noise (RollingGauge.WaysAreTheSameWithALittleMoreNoise), it came out known to 1
// %.
TEST(VarianceComponents, OfAVelocityWhoseRowsTurnAsLittleAsItsNoiseAreNotKnownBetterThanResidualsTell) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const Robot truth =
      velocity_robot({.wheel_per_sqrt_m = 0.01, .turn_per_sqrt_m = 0.005, .turn_per_sqrt_rad = 0.03});
  Robot nominal = truth;
  nominal.chassis.noise.turn_per_sqrt_rad /= 1.5;
  for (const std::uint64_t seed : {8, 9}) {
    const Learned found =
        level(learned(recorded(truth, 2.0, 40.0, seed, 50.0), nominal), "noise.turn_per_sqrt_rad");
    EXPECT_NEAR(found.value, 0.03, 4.0 * found.sigma) << seed;
    EXPECT_GT(found.sigma, found.value / std::sqrt(2.0 * 400.0)) << seed;
  }
}

TEST(VarianceComponents, AreAllThatIsSoughtOfAVelocityThatIsTakenAsItIs) {
  const Robot truth =
      velocity_robot({.wheel_per_sqrt_m = 0.03, .turn_per_sqrt_m = 0.01, .turn_per_sqrt_rad = 0.04});
  Robot nominal = truth;
  nominal.landmark_sensor->range_sigma_m *= 3.0;
  nominal.chassis.noise.wheel_per_sqrt_m /= 3.0;
  const Recording recording = recorded(truth, 2.0, 60.0, 2);
  const std::vector<std::string> fixed = {"velocity"};
  EXPECT_THROW(calibrate_from_landmarks({&recording, 1}, {}, nominal, {.fix = fixed}), CannotAnswer);
  const CalibrationResult result =
      calibrate_from_landmarks({&recording, 1}, {}, nominal, {.fix = fixed, .learn_noise = true});
  EXPECT_TRUE(result.parameters.empty());
  for (const auto& [name, truly] : {std::pair<std::string, double>{"landmark_sensor.range_sigma_m", kRange_m},
                                    {"noise.wheel_per_sqrt_m", 0.03}}) {
    const Learned found = level(result, name);
    EXPECT_NEAR(found.value, truly, 4.0 * found.sigma) << name;
  }
  EXPECT_EQ(parse_robot(to_toml(result.calibrated), "calibrated.toml").landmark_sensor->range_sigma_m,
            result.calibrated.landmark_sensor->range_sigma_m);
}

}  // namespace
}  // namespace trundle::slam
