#include "trundle/calibration/squares/square.hpp"

#include <cmath>

#include <gmock/gmock.h>

#include "trundle/io/error.hpp"

namespace trundle::calibration {
namespace {

constexpr SidedDrive kNominalDrive = {0.15, 0.15, 0.50};
constexpr double kSide_m = 2.0;

SquareMeans measured(const SidedDrive& truth, bool with_leg = true) {
  SquareMeans means = {.cw = predict_square(truth, kNominalDrive, kSide_m, Turn::cw),
                       .ccw = predict_square(truth, kNominalDrive, kSide_m, Turn::ccw)};
  if (with_leg) means.leg_m = predict_leg(truth, kNominalDrive, kSide_m);
  return means;
}

double e_max(const SidedDrive& truth, const SidedDrive& assumed) {
  const Pose2 cw = predict_square(truth, assumed, kSide_m, Turn::cw);
  const Pose2 ccw = predict_square(truth, assumed, kSide_m, Turn::ccw);
  return std::max(std::hypot(cw.x, cw.y), std::hypot(ccw.x, ccw.y));
}

// The check values of docs/theory/umbmark.md, each to the digits printed there.
struct CheckValue {
  SidedDrive truth;
  double e_max_before, before_digits;
  SidedDrive classic;
  double e_max_after, after_digits;
};
const CheckValue kCheckValues[] = {
    {{0.1503, 0.1497, 0.51}, 0.2688, 5e-5, {0.150274, 0.149726, 0.509519}, 0.0161, 5e-5},
    {{0.1500, 0.1515, 0.53}, 0.7149, 5e-5, {0.149449, 0.150551, 0.523639}, 0.120, 5e-4},
    {{0.1550, 0.1530, 0.47}, 1.0404, 5e-5, {0.151181, 0.148819, 0.452686}, 0.174, 5e-4},
};

TEST(Square, CheckValuesOfTheClassicalMethod) {
  for (const CheckValue& check : kCheckValues) {
    EXPECT_NEAR(e_max(check.truth, kNominalDrive), check.e_max_before, check.before_digits);
    const SidedDrive found = solve_classic(measured(check.truth), kSide_m, kNominalDrive);
    EXPECT_NEAR(found.left_diameter_m, check.classic.left_diameter_m, 5e-7);
    EXPECT_NEAR(found.right_diameter_m, check.classic.right_diameter_m, 5e-7);
    EXPECT_NEAR(found.track_m, check.classic.track_m, 5e-7);
    EXPECT_NEAR(e_max(check.truth, found), check.e_max_after, check.after_digits);
  }
}

void expect_near(const SidedDrive& found, const SidedDrive& truth, double relative) {
  EXPECT_NEAR(found.left_diameter_m / truth.left_diameter_m, 1.0, relative);
  EXPECT_NEAR(found.right_diameter_m / truth.right_diameter_m, 1.0, relative);
  EXPECT_NEAR(found.track_m / truth.track_m, 1.0, relative);
}

const SidedDrive kTruths[] = {
    {0.1503, 0.1497, 0.51}, {0.1500, 0.1515, 0.53}, {0.1550, 0.1530, 0.47}, {0.15, 0.15, 0.50},
    {0.15, 0.15, 0.55},     {0.151, 0.149, 0.50},   {0.1425, 0.1575, 0.70},  // diameters ∓5 %, track +40 %
    {0.1575, 0.1425, 0.70}, {0.1575, 0.1575, 0.80},                          // both +5 %, track +60 %
    {0.1425, 0.1425, 0.35},
};

TEST(Square, OrientationIsExactAlsoForStrongErrors) {
  for (const SidedDrive& truth : kTruths) {
    const SidedDrive found = solve_orientation(measured(truth), kSide_m, kNominalDrive);
    expect_near(found, truth, 1e-12);
    EXPECT_NEAR(e_max(truth, found), 0.0, 1e-10);
  }
}

TEST(Square, OrientationWithoutALegFindsEverythingButTheScale) {
  for (const SidedDrive& truth : kTruths) {
    const SidedDrive found = solve_orientation(measured(truth, false), kSide_m, kNominalDrive);
    const double scale = truth.mean_diameter_m() / kNominalDrive.mean_diameter_m();
    EXPECT_NEAR(found.mean_diameter_m(), kNominalDrive.mean_diameter_m(), 1e-15);
    expect_near(found, SidedDrive::from(truth.vector() / scale), 1e-12);
  }
}

TEST(Square, UnequalNominalWheelsAreScaledNotReplaced) {
  const SidedDrive nominal = {0.15, 0.16, 0.5};
  const SidedDrive truth = {0.152, 0.157, 0.52};
  const SquareMeans means = {.cw = predict_square(truth, nominal, kSide_m, Turn::cw),
                             .ccw = predict_square(truth, nominal, kSide_m, Turn::ccw),
                             .leg_m = predict_leg(truth, nominal, kSide_m)};
  expect_near(solve_orientation(means, kSide_m, nominal), truth, 1e-12);
}

TEST(Square, CountedRevolutionsGiveTheSame) {
  for (const SidedDrive& truth : kTruths) {
    SquareMeans means = measured(truth);
    means.left_revolutions = means.right_revolutions = kSide_m / (kPi * 0.15);
    expect_near(solve_orientation(means, kSide_m, kNominalDrive), truth, 1e-12);
  }
}

TEST(Square, CountedRevolutionsCorrectALegThatWasNotTheNominalOne) {
  // The robot overshoots each leg by 3 %: longer chord, more revolutions, the same bend per metre.
  const SidedDrive truth = {0.1503, 0.1497, 0.51};
  const double driven = 1.03 * kSide_m;
  const Pose2 cw = predict_square(truth, kNominalDrive, driven, Turn::cw);
  const Pose2 ccw = predict_square(truth, kNominalDrive, driven, Turn::ccw);
  const double revolutions = driven / (kPi * 0.15);
  const SquareMeans means = {cw, ccw, predict_leg(truth, kNominalDrive, driven), revolutions, revolutions};
  expect_near(solve_orientation(means, kSide_m, kNominalDrive), truth, 1e-12);
}

TEST(Square, TheSourcesFormulaWithRevolutions) {
  // D_R = (R + b/2) β[deg] / (180 N_R), R = (ℓ/2)/sin(β/2).
  const SidedDrive truth = {0.1500, 0.1515, 0.53};
  const SquareMeans means = measured(truth);
  const double beta = (means.cw.heading + means.ccw.heading) / 8.0;
  const double radius = 0.5 * *means.leg_m / std::sin(0.5 * beta);
  const double revolutions = kSide_m / (kPi * 0.15);
  const SidedDrive found = solve_orientation(means, kSide_m, kNominalDrive);
  EXPECT_NEAR(found.right_diameter_m, (radius + 0.5 * found.track_m) * degrees(beta) / (180.0 * revolutions),
              1e-12);
  EXPECT_NEAR(found.left_diameter_m, (radius - 0.5 * found.track_m) * degrees(beta) / (180.0 * revolutions),
              1e-12);
}

TEST(Square, PredictionAgreesWithSmallSteps) {
  // The same drive as many tiny arcs of each wheel: an oracle that knows no closed form.
  const SidedDrive truth = {0.1550, 0.1480, 0.47};
  for (const Turn turn : {Turn::cw, Turn::ccw}) {
    const double sense = turn == Turn::ccw ? 1.0 : -1.0;
    double x = 0.0, y = 0.0, heading = 0.0;
    const auto roll = [&](double left_m, double right_m) {
      constexpr int kSteps = 20000;
      for (int i = 0; i < kSteps; ++i) {
        const double dl = left_m / kSteps * truth.left_diameter_m / 0.15;
        const double dr = right_m / kSteps * truth.right_diameter_m / 0.15;
        const double turned = (dr - dl) / truth.track_m;
        x += 0.5 * (dl + dr) * std::cos(heading + 0.5 * turned);
        y += 0.5 * (dl + dr) * std::sin(heading + 0.5 * turned);
        heading += turned;
      }
    };
    for (int i = 0; i < 4; ++i) {
      roll(kSide_m, kSide_m);
      roll(-sense * 0.25 * kPi * 0.5, sense * 0.25 * kPi * 0.5);
    }
    const Pose2 end = predict_square(truth, kNominalDrive, kSide_m, turn);
    EXPECT_NEAR(end.x, x, 1e-8);
    EXPECT_NEAR(end.y, y, 1e-8);
    EXPECT_NEAR(end.heading, heading - sense * 2.0 * kPi, 1e-9);
  }
}

TEST(Square, ErrorsThatNoRobotMakesAreRefused) {
  EXPECT_THROW(solve_classic({.cw = {-16.0, 0, 0}, .ccw = {-16.0, 0, 0}}, kSide_m, kNominalDrive),
               CannotAnswer);
  EXPECT_THROW(solve_orientation({.cw = {0, 0, 6.4}, .ccw = {0, 0, -6.4}}, kSide_m, kNominalDrive),
               CannotAnswer);
  EXPECT_THROW(solve_orientation({.cw = {0, 0, 40.0}, .ccw = {0, 0, 40.0}}, kSide_m, kNominalDrive),
               CannotAnswer);
}

TEST(Square, ARobotHasSidesWhenAllItsWheelsRollAhead) {
  Robot robot;
  robot.chassis = skid_steer({.diameter_m = 0.2}, 0.6, 0.4);
  robot.wheel_names = {"fl", "fr", "rl", "rr"};
  robot.chassis.wheel_storage[0].diameter_m = 0.21;
  const SidedDrive drive = sided_drive(robot);
  EXPECT_NEAR(drive.left_diameter_m, 0.205, 1e-15);
  EXPECT_NEAR(drive.track_m, 0.6, 1e-15);
  const Robot changed = with_drive(robot, {0.41, 0.1, 0.9});
  EXPECT_NEAR(changed.chassis.wheels()[0].diameter_m, 0.42, 1e-15);
  EXPECT_NEAR(changed.chassis.wheels()[2].diameter_m, 0.40, 1e-15);
  EXPECT_NEAR(changed.chassis.wheels()[3].diameter_m, 0.1, 1e-15);
  EXPECT_NEAR(changed.chassis.wheels()[3].y_m, -0.45, 1e-15);
}

TEST(Square, OtherRobotsAreSentToTheGeneralEstimator) {
  Robot robot;
  EXPECT_THROW(sided_drive(robot), CannotAnswer);
  robot.chassis = omni3({}, 0.2);
  EXPECT_THROW(sided_drive(robot), CannotAnswer);
  robot.chassis = mecanum({}, 0.4, 0.3);
  EXPECT_THROW(sided_drive(robot), CannotAnswer);
}

}  // namespace
}  // namespace trundle::calibration
