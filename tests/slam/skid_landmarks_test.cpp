// Calibration from sightings of robots on skid wheels. Whether their readings err or the ground moves
// otherwise, the track is the true one: docs/theory/effective-track.md, eq. 3.
#include <algorithm>
#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "trundle/calibration/likelihood/reading_noise.hpp"
#include "trundle/slam/smoothing/landmark_calibration.hpp"

#include "calibration/simulated_runs.hpp"
#include "scale.hpp"

namespace trundle::slam {
namespace {

constexpr Parameter kEffectiveTrack{ParameterKind::track, -1};

/// Of two wheels or of four.
Robot skid_robot(double per_sqrt_m, bool has_four = true) {
  const Chassis four = skid_steer({0.2, 360.0}, 0.8, 0.3);
  Chassis two;
  for (const double y : {0.4, -0.4})
    two.add({.y_m = y, .kind = WheelKind::skid, .diameter_m = 0.2, .ticks_per_revolution = 360.0});
  Robot robot = has_four ? test::robot_of(four, {"fl", "fr", "rl", "rr"}) : test::robot_of(two, {"l", "r"});
  robot.chassis.noise.wheel_per_sqrt_m = robot.chassis.noise.skid_per_sqrt_m = per_sqrt_m;
  robot.landmark_sensor = LandmarkSensor{{0.1, 0.0, 0.0}, 0.05, radians(1.0), 6.0, 0.0};
  return robot;
}

struct Drive {
  double wheel_per_sqrt_m;
  double sightings_hz;
  bool has_four;
};
constexpr std::array kDrives = {Drive{0.03, 4.0, false}, Drive{0.03, 4.0, true}, Drive{0.03, 2.0, false},
                                Drive{0.02, 4.0, false}};

Recording recorded(const Robot& robot, double sightings_hz, simulation::Steering steering,
                   std::uint64_t seed) {
  Random tour(seed, 41), landmarks(seed, 42);
  const Path path = random_tour({.length_m = 40.0, .box_x_m = 6.0, .box_y_m = 6.0}, {}, tour);
  Scenario scenario = test::scenario_of(robot, robot, path, seed);
  scenario.steering = steering;
  scenario.encoders.rate_hz = 20.0;
  scenario.reference.rate_hz = 0.0;
  scenario.landmarks = random_landmarks(12, 8.0, 8.0, 1.0, landmarks);
  scenario.sightings = {.rate_hz = sightings_hz, .give_map = false};
  Recording recording = simulate(scenario).recording;
  recording.name = "tour";
  recording.session = "one";
  return recording;
}

/// Errors of the track over its sigma have the mean 0 and the mean square 1, each to four standard
/// deviations of the mean of so many.
void expect_true_track(simulation::Steering steering) {
  const int robots = test::trials(20, 4);
  double sum = 0.0, squares = 0.0;
  for (int i = 0; i < robots; ++i) {
    const Drive& drive = kDrives[static_cast<std::size_t>(i) % kDrives.size()];
    const Robot robot = skid_robot(drive.wheel_per_sqrt_m, drive.has_four);
    const Recording recording =
        recorded(robot, drive.sightings_hz, steering, static_cast<std::uint64_t>(i + 1));
    const CalibrationResult result = calibrate_from_landmarks({&recording, 1}, {}, robot);
    const auto track = std::ranges::find(result.parameters, kEffectiveTrack, &ParameterEstimate::parameter);
    const double z = (track->value - value_of(kEffectiveTrack, robot)) / track->sigma_within;
    sum += z;
    squares += z * z;
  }
  EXPECT_NEAR(sum / robots, 0.0, 4.0 / std::sqrt(robots));
  EXPECT_NEAR(squares / robots, 1.0, 4.0 * std::sqrt(2.0 / robots));
}

TEST(SkidLandmarks, TrackIsTrueWhereReadingsErr) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  expect_true_track(simulation::Steering::truth);
}

// The wheels turn as they are told, and the ground moves otherwise.
TEST(SkidLandmarks, TrackIsTrueWhereWheelsScrub) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  expect_true_track(simulation::Steering::odometry);
}

/// At 0.5 m/s, of stamps that are not even; with white noise of the readings.
recording::Increments steady(const Chassis& chassis, double per_sqrt_m, int count) {
  Random random(1, 43);
  recording::Increments increments;
  double time_s = 0.0;
  for (int i = 0; i < count; ++i) {
    Increment one{.duration_s = random.uniform(0.04, 0.06)};
    one.time_s = time_s += one.duration_s;
    for (std::size_t w = 0; w < chassis.wheels().size(); ++w) {
      const double way_m = 0.5 * one.duration_s;
      one.turned[w] =
          (way_m + random.normal(per_sqrt_m * std::sqrt(way_m))) / (kPi * chassis.wheels()[w].diameter_m);
    }
    increments.push_back(one);
  }
  return increments;
}

TEST(ReadingNoise, OfSkidWheelsIsWhatTheirReadingsJumpBy) {
  constexpr int kCount = 4000;
  const Chassis chassis = skid_robot(0.1).chassis;
  // Squares of jumps of white noise that meet their neighbours' with −2/3 and 1/6 vary as if there were
  // 1 + 2 (4/9 + 1/36) times fewer; forward and turn are two; and a root deviates half as far.
  const double sigma = 0.5 * std::sqrt(2.0 * (35.0 / 18.0) / (2 * kCount));
  for (const double noise : {0.003, 0.03}) {
    const calibration::ReadingNoise found =
        calibration::noise_in_readings(steady(chassis, noise, kCount), chassis);
    for (std::size_t w = 0; w < 4; ++w)
      EXPECT_NEAR(found.wheel_per_sqrt_m[w].value_or(0.0) / noise, 1.0, 4.0 * sigma);
  }
}

TEST(ReadingNoise, IsNoneOfSteadyReadingsAndNeverMoreThanAllNoise) {
  const Chassis chassis = skid_robot(0.03).chassis;
  const auto read = [&](double noise) {
    return calibration::as_read(chassis,
                                calibration::noise_in_readings(steady(chassis, noise, 100), chassis));
  };
  EXPECT_LT(wheel_noise(read(0.0), 0), 1e-9);
  EXPECT_EQ(wheel_noise(read(0.3), 0), 0.03);
}

// What wheels of one side read apart moves nothing: it says nothing of what the readings of a motion err by.
TEST(ReadingNoise, IsNoneOfWheelsThatContradictEachOther) {
  const Chassis chassis = skid_robot(0.03).chassis;
  recording::Increments apart;
  for (const Increment& even : steady(chassis, 0.0, 100)) {
    Increment one = even;
    const double jump = apart.size() % 2 == 0 ? 0.01 : -0.01;
    for (const std::size_t w : {std::size_t{0}, std::size_t{1}})
      one.turned[w] += jump, one.turned[w + 2] -= jump;
    apart.push_back(one);
  }
  EXPECT_LT(calibration::noise_in_readings(apart, chassis).wheel_per_sqrt_m[0].value_or(1.0), 1e-6);
}

TEST(ReadingNoise, OfOtherWheelsIsAllOfIt) {
  const Chassis chassis = test::nominal_differential().chassis;
  EXPECT_FALSE(calibration::noise_in_readings(steady(chassis, 0.0, 100), chassis).wheel_per_sqrt_m[0]);
}

}  // namespace
}  // namespace trundle::slam
