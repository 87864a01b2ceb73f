#include "trundle/calibration/squares/square.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include <fmt/format.h>

#include "trundle/io/error.hpp"

namespace trundle::calibration {
namespace {

constexpr double kQuarterTurn = 0.5 * kPi;  // [rad]

double middle_y(const Chassis& chassis) {
  const auto [low, high] = std::ranges::minmax(chassis.wheels(), {}, &Wheel::y_m);
  return 0.5 * (low.y_m + high.y_m);
}

bool rolls_ahead(const Wheel& wheel) {
  return !has_rollers(wheel.kind) && std::abs(std::sin(wheel.direction_rad)) < 1e-6;
}

/// Mean diameter and mean y of the wheels on one side.
struct Side {
  double diameter_m = 0.0;
  double y_m = 0.0;
};

Side side_of(const Chassis& chassis, bool left) {
  const double middle = middle_y(chassis);
  Side side;
  int count = 0;
  for (const Wheel& wheel : chassis.wheels()) {
    if (left ? wheel.y_m <= middle : wheel.y_m >= middle) continue;
    side.diameter_m += wheel.diameter_m;
    side.y_m += wheel.y_m;
    ++count;
  }
  assert(count > 0);
  return {side.diameter_m / count, side.y_m / count};
}

void refuse_unsided(const Robot& robot) {
  const auto wheels = robot.chassis.wheels();
  const bool sided =
      !wheels.empty() && !is_steered(robot.chassis) && std::ranges::all_of(wheels, rolls_ahead) &&
      std::ranges::none_of(wheels, [y = middle_y(robot.chassis)](const Wheel& w) { return w.y_m == y; });
  if (!sided)
    throw CannotAnswer(
        "square runs are evaluated for robots that turn by left and right wheels (fixed or skid); '" +
        robot.name + "' has others: use trundle calibrate");
}

/// Travel of each side over the travel that the robot believes in.
struct Scales {
  double left = 1.0;
  double right = 1.0;

  double mean() const { return 0.5 * (left + right); }
  double difference() const { return right - left; }
};

Scales scales(const SidedDrive& truth, const SidedDrive& assumed) {
  return {truth.left_diameter_m / assumed.left_diameter_m, truth.right_diameter_m / assumed.right_diameter_m};
}

/// A leg bends by β = L (s_R − s_L)/b over the arc L E_s. docs/theory/umbmark.md, eq. 1.
Twist2 leg(const Scales& s, double track_m, double side_m) {
  return {side_m * s.mean(), 0.0, side_m * s.difference() / track_m};
}

/// A quarter turn: both wheels roll b_n π/4 in the robot's own belief. docs/theory/umbmark.md, eq. 2.
Twist2 quarter_turn(const Scales& s, double track_m, double assumed_track_m, double sense) {
  const double rolled = sense * 0.5 * kQuarterTurn * assumed_track_m;
  return {0.5 * rolled * s.difference(), 0.0, 2.0 * rolled * s.mean() / track_m};
}

struct Bend {
  double alpha = 0.0;  ///< under-rotation of a quarter turn [rad]
  double beta = 0.0;   ///< bend of a leg [rad]
};

/// b / E_s. docs/theory/umbmark.md, eq. 5 and 9.
double track_per_scale(const Bend& bend, double nominal_track_m) {
  if (bend.alpha >= kQuarterTurn)
    throw CannotAnswer(
        fmt::format("the runs do not turn: quarter turns fall short by {:.1f} degrees", degrees(bend.alpha)));
  return nominal_track_m * kQuarterTurn / (kQuarterTurn - bend.alpha);
}

/// Both scales from their mean and κ b/2, where κ is the curvature of a leg. docs/theory/umbmark.md, eq. 6,
/// 7, 10, 11.
Scales split(double mean, double half_track_curvature) {
  if (std::abs(half_track_curvature) >= 1.0)
    throw CannotAnswer("the legs bend more sharply than a robot with both wheels rolling forwards can");
  return {mean * (1.0 - half_track_curvature), mean * (1.0 + half_track_curvature)};
}

SidedDrive scaled(const SidedDrive& nominal, const Scales& s, double track_m) {
  return {nominal.left_diameter_m * s.left, nominal.right_diameter_m * s.right, track_m};
}

/// Legs as counted: D_R = (R + b/2) β[deg]/(180 N_R), D_L = (R − b/2) β[deg]/(180 N_L), with b = E_s ·
/// (b/E_s) and E_s the mean of D_L/D_n and D_R/D_n solved for. docs/theory/umbmark.md, eq. 12.
SidedDrive from_revolutions(const SquareMeans& means, const SidedDrive& nominal, double arc_m, double beta,
                            double track_over_scale) {
  const double left_m = kPi * nominal.left_diameter_m * *means.left_revolutions;
  const double right_m = kPi * nominal.right_diameter_m * *means.right_revolutions;
  const double sum = 0.5 * arc_m * (1.0 / right_m + 1.0 / left_m);
  const double coupling = 0.25 * track_over_scale * beta * (1.0 / right_m - 1.0 / left_m);
  const double track = track_over_scale * sum / (1.0 - coupling);
  return scaled(nominal, {(arc_m - 0.5 * beta * track) / left_m, (arc_m + 0.5 * beta * track) / right_m},
                track);
}

Pose2 mean_error(const SquareSheet& sheet, Turn turn) {
  Vector3 sum = Vector3::Zero();
  double count = 0.0;
  for (const SquareRun& run : sheet.runs) {
    if (run.turn != turn) continue;
    sum += Vector3(run.error.x, run.error.y, run.error.heading);
    count += 1.0;
  }
  if (count == 0.0)
    throw CannotAnswer(
        fmt::format("{} has no {} runs: one sense alone cannot separate the track from unequal wheels; drive "
                    "the square both ways",
                    sheet.name, name_of(turn)));
  sum /= count;
  return {sum.x(), sum.y(), sum.z()};
}

std::optional<double> mean_where_given(const SquareSheet& sheet, std::optional<double> SquareRun::*member) {
  double sum = 0.0;
  double count = 0.0;
  for (const SquareRun& run : sheet.runs) {
    if (!(run.*member)) continue;
    sum += *(run.*member);
    count += 1.0;
  }
  return count == 0.0 ? std::nullopt : std::optional(sum / count);
}

}  // namespace

SidedDrive sided_drive(const Robot& robot) {
  refuse_unsided(robot);
  const Side left = side_of(robot.chassis, true);
  const Side right = side_of(robot.chassis, false);
  return {left.diameter_m, right.diameter_m, left.y_m - right.y_m};
}

Robot with_drive(const Robot& robot, const SidedDrive& drive) {
  const SidedDrive old = sided_drive(robot);
  const double middle = middle_y(robot.chassis);
  Robot changed = robot;
  for (Wheel& wheel : changed.chassis.wheels()) {
    wheel.diameter_m *= wheel.y_m > middle ? drive.left_diameter_m / old.left_diameter_m
                                           : drive.right_diameter_m / old.right_diameter_m;
    wheel.y_m = middle + (wheel.y_m - middle) * drive.track_m / old.track_m;
  }
  return changed;
}

Pose2 predict_square(const SidedDrive& truth, const SidedDrive& assumed, double side_m, Turn turn) {
  const Scales s = scales(truth, assumed);
  const double sense = turn == Turn::ccw ? 1.0 : -1.0;
  const Pose2 step =
      exp(leg(s, truth.track_m, side_m)) * exp(quarter_turn(s, truth.track_m, assumed.track_m, sense));
  Pose2 end;
  for (int i = 0; i < 4; ++i) end = end * step;
  end.heading -= sense * 4.0 * kQuarterTurn;
  return end;
}

double predict_leg(const SidedDrive& truth, const SidedDrive& assumed, double side_m) {
  const Twist2 bent = leg(scales(truth, assumed), truth.track_m, side_m);
  return bent.dx * sinc(0.5 * bent.dtheta);
}

SquareMeans means_of(const SquareSheet& sheet) {
  return {.cw = mean_error(sheet, Turn::cw),
          .ccw = mean_error(sheet, Turn::ccw),
          .leg_m = mean_where_given(sheet, &SquareRun::leg_m),
          .left_revolutions = mean_where_given(sheet, &SquareRun::left_revolutions),
          .right_revolutions = mean_where_given(sheet, &SquareRun::right_revolutions)};
}

SidedDrive solve_classic(const SquareMeans& means, double side_m, const SidedDrive& nominal) {
  const Bend bend = {(means.cw.x + means.ccw.x) / (-4.0 * side_m),
                     (means.cw.x - means.ccw.x) / (-4.0 * side_m)};
  const double track = track_per_scale(bend, nominal.track_m);
  const double curvature = 2.0 * std::sin(0.5 * bend.beta) / side_m;
  return scaled(nominal, split(1.0, 0.5 * curvature * track), track);
}

SidedDrive solve_orientation(const SquareMeans& means, double side_m, const SidedDrive& nominal) {
  const Bend bend = {(means.cw.heading - means.ccw.heading) / 8.0,
                     (means.cw.heading + means.ccw.heading) / 8.0};
  const double chord_per_arc = sinc(0.5 * bend.beta);
  const double arc = means.leg_m ? *means.leg_m / chord_per_arc : side_m;
  const double track_over_scale = track_per_scale(bend, nominal.track_m);
  if (means.leg_m && means.left_revolutions && means.right_revolutions)
    return from_revolutions(means, nominal, arc, bend.beta, track_over_scale);
  const double scale = arc / side_m;
  const double track = track_over_scale * scale;
  return scaled(nominal, split(scale, 0.5 * track * bend.beta / arc), track);
}

}  // namespace trundle::calibration
