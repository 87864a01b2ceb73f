#include "trundle/inspection/sighting_checks.hpp"

#include <gmock/gmock.h>

#include "trundle/simulation/scenario.hpp"

#include "recording/findings.hpp"
#include "recording/robots.hpp"

namespace trundle::inspection {
namespace {

using test::finding;

/// A tour of a robot whose file is right, among landmarks.
struct Tour {
  Robot robot = test::two_wheels();
  Recording recording;

  Tour() {
    robot.landmark_sensor = LandmarkSensor{.body_from_sensor = {0.1, 0.0, 0.2}, .range_sigma_m = 0.03};
    Random random(1, 5);
    Scenario scenario;
    scenario.nominal = scenario.truth = robot;
    scenario.steering = Steering::truth;
    scenario.path = random_tour({.length_m = 40.0}, {}, random);
    scenario.landmarks = random_landmarks(12, 6.0, 6.0, 1.0, random);
    scenario.sightings.rate_hz = 1.0;
    recording = simulate(scenario).recording;
  }
  std::optional<Finding> wrong() const { return wrong_sightings(recording, robot, align(recording, robot)); }
};

TEST(WrongSightings, AreNoneWhereLandmarksStayWhereTheyAre) {
  EXPECT_FALSE(Tour().wrong());
}

// By headings that drift by a radian landmarks orbit, and stand nearer to where they were if ranges are less.
TEST(WrongSightings, AreNoneOfARobotThatIsNotCalibrated) {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    Tour tour;
    Random random(seed, 6);
    Scenario scenario;
    scenario.nominal = scenario.truth = tour.robot;
    scenario.truth.chassis.wheels()[0].diameter_m *= 1.0 + random.normal(0.04);
    if (seed % 2 == 0) scenario.nominal.chassis.gyro = scenario.truth.chassis.gyro = Gyro{};
    if (seed % 4 == 0) scenario.truth.chassis.gyro->bias_rad_s = 0.03;
    scenario.steering = Steering::truth;
    scenario.path = joined({random_tour({.length_m = 20.0}, {}, random),
                            {{{}, 3.0}},
                            random_tour({.length_m = 20.0}, {}, random)});
    scenario.landmarks = random_landmarks(12, 6.0, 6.0, 1.0, random);
    scenario.sightings.rate_hz = 5.0;
    tour.recording = simulate(scenario).recording;
    tour.robot = scenario.nominal;
    EXPECT_FALSE(tour.wrong()) << seed;
  }
}

/// Pods see no turns.
TEST(WrongSightings, AreNoneWhereTheGyroThatTheRobotNeedsWasNotRecorded) {
  Tour tour;
  tour.robot.chassis.gyro = Gyro{};
  tour.robot.chassis.wheels()[1] = tour.robot.chassis.wheels()[0];
  tour.robot.chassis.wheels()[1].kind = WheelKind::omni;
  tour.robot.chassis.wheels()[1].direction_rad = kPi / 2.0;
  EXPECT_FALSE(tour.wrong());
}

TEST(WrongSightings, BearingsToTheRightAreNamed) {
  Tour tour;
  for (Sighting& sighting : tour.recording.sightings) sighting.bearing_rad = -sighting.bearing_rad;
  tour.robot.landmark_sensor->body_from_sensor.heading = 0.0;
  const auto wrong = tour.wrong();
  ASSERT_TRUE(wrong);
  EXPECT_THAT(*wrong, finding(FindingCode::bearing_unit, "sign = -1"));
}

TEST(WrongSightings, RangesInAnotherUnitAreNamedWithIt) {
  for (const auto& [symbol, factor] : {std::pair{"mm", 1e3}, {"cm", 1e2}, {"ft", 1.0 / 0.3048}}) {
    Tour tour;
    for (Sighting& sighting : tour.recording.sightings) sighting.range_m *= factor;
    const auto wrong = tour.wrong();
    ASSERT_TRUE(wrong) << symbol;
    EXPECT_THAT(*wrong, finding(FindingCode::range_unit, symbol));
  }
}

TEST(WrongSightings, ASensorThatLooksOrStandsElsewhereIsNamed) {
  Tour turned;
  turned.robot.landmark_sensor->body_from_sensor.heading += kPi;
  ASSERT_TRUE(turned.wrong());
  EXPECT_THAT(*turned.wrong(), finding(FindingCode::bearing_unit, "heading_deg = "));
  Tour moved;
  moved.robot.landmark_sensor->body_from_sensor.x = 10.0;
  ASSERT_TRUE(moved.wrong());
  EXPECT_THAT(*moved.wrong(), finding(FindingCode::geometry, "x_m = 0."));
}

}  // namespace
}  // namespace trundle::inspection
