#include "trundle/inspection/partial_reference_checks.hpp"

#include <gmock/gmock.h>

#include "trundle/inspection/findings.hpp"
#include "trundle/simulation/scenario.hpp"

#include "recording/findings.hpp"
#include "recording/robots.hpp"

namespace trundle::inspection {
namespace {

using test::finding;
using testing::Contains;
using testing::ElementsAre;
using testing::Field;
using testing::IsEmpty;
using testing::Not;

const Robot kRobot = test::two_wheels();

/// A run by a robot whose track is a twentieth wider than its file says: no mistake.
Recording driven(const Path& path) {
  Scenario scenario;
  scenario.nominal = scenario.truth = kRobot;
  scenario.truth.chassis = differential_drive({1.0 / kPi, 100.0, 0}, 0.525);
  scenario.path = path;
  scenario.partial = {.end_pose = true, .distance = true, .turns = true};
  return simulate(scenario).recording;
}

std::vector<Finding> wrong(const Recording& recording) {
  return wrong_partial_reference(recording, kRobot, align(recording, kRobot));
}

TEST(WrongPartialReference, IsNoneWhereTheRobotFileIsALittleOff) {
  EXPECT_THAT(wrong(driven(straight(4.0))), IsEmpty());
  EXPECT_THAT(wrong(driven(square(2.0, TurnSense::ccw))), IsEmpty());
  EXPECT_THAT(wrong(driven(circle(0.5, 5.0, TurnSense::cw))), IsEmpty());
}

TEST(WrongPartialReference, ADistanceInAnotherUnitIsNamed) {
  Recording run = driven(straight(4.0));
  run.partial.distance_m->value *= 3.28;
  EXPECT_THAT(wrong(run), ElementsAre(finding(FindingCode::reference_unit, "13.")));
}

TEST(WrongPartialReference, AClaimToCloseIsNamedWhereTheRobotEndsElsewhere) {
  Recording run = driven(straight(4.0));
  run.partial = {};
  run.partial.closed = Measured{0.0, 0.005};
  EXPECT_THAT(wrong(run), ElementsAre(finding(FindingCode::reference_unit, "0 m from start to end")));
}

TEST(WrongPartialReference, TurnsInDegreesOrTheOtherWayRoundAreNamed) {
  for (const double factor : {360.0, 2.0 * kPi, -1.0}) {
    Recording run = driven(circle(0.5, 5.0, TurnSense::ccw));
    run.partial.turns->value *= factor;
    EXPECT_THAT(wrong(run), ElementsAre(finding(FindingCode::reference_unit, "turns counter-clockwise")))
        << factor;
  }
}

TEST(OneColumnForTwo, IsNamedWhereTheRobotTurns) {
  const auto is_named = Contains(Field(&Finding::code, FindingCode::indistinguishable_wheels));
  const Robot robot = test::with_gyro(kRobot);
  Scenario scenario;
  scenario.nominal = scenario.truth = robot;
  scenario.path = square(2.0, TurnSense::ccw);
  Recording run = simulate(scenario).recording;
  EXPECT_THAT(find_in(run, &robot).problems, Not(is_named));
  run.wheels.series[1].value = run.wheels.series[0].value;
  EXPECT_THAT(find_in(run, &robot).problems, is_named);
  scenario.path = straight(4.0);
  EXPECT_THAT(find_in(simulate(scenario).recording, &robot).problems, Not(is_named));
}

}  // namespace
}  // namespace trundle::inspection
