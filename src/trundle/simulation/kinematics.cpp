#include "trundle/simulation/kinematics.hpp"

#include <cassert>

#include <Eigen/LU>

#include "trundle/chassis/scrub.hpp"
#include "trundle/chassis/tyre_growth.hpp"
#include "trundle/geometry/decompositions.hpp"
#include "trundle/io/error.hpp"

namespace trundle::simulation {
namespace {

using RowBlock = Eigen::Matrix<double, Eigen::Dynamic, 3, 0, kMaxRows + 1, 3>;

int lateral_count(const Rows& rows) {
  return rows.count() - rows.measured;
}

/// Changes the translation alone so that the lateral rows read `lateral`; least squares where they
/// contradict.
Vector3 without_skidding(const Rows& rows, const Twist2& commanded, const RowVector& lateral) {
  Vector3 xi = commanded.vector();
  if (lateral_count(rows) == 0) return xi;
  const auto N = rows.H.bottomRows(lateral_count(rows));
  const RowVector missing = lateral - N * xi;
  const Matrix2 NtN = N.leftCols<2>().transpose() * N.leftCols<2>();
  const Vector2 Ntm = N.leftCols<2>().transpose() * missing;
  // Of rank 1 when all axles are parallel: move across them only.
  const double trace = NtN.trace();
  const double determinant = NtN.determinant();
  const bool parallel = determinant < 1e-12 * trace * trace;
  xi.head<2>() += parallel ? Vector2(Ntm / trace) : Vector2(NtN.inverse() * Ntm);
  return xi;
}

RowVector ratios_of_diameters(const Scenario& scenario, const Rows& rows) {
  RowVector ratio = RowVector::Ones(rows.measured);
  for (int i = 0; i < scenario.truth.chassis.wheel_count; ++i) {
    const auto w = static_cast<std::size_t>(i);
    ratio[i] =
        scenario.truth.chassis.wheels()[w].diameter_m / scenario.nominal.chassis.wheels()[w].diameter_m;
  }
  return ratio;
}

/// Without the steered wheels' lateral rows.
Rows rows_without_steering(const Chassis& chassis) {
  Chassis rest = chassis;
  for (Wheel& wheel : rest.all_wheels())
    if (wheel.steering) wheel.kind = WheelKind::omni;
  return rows_of(rest, false);
}

// Wheels whose rows are this near to dependent do not move the robot in the direction that is left.
constexpr double kIndependent = 1e-5;

/// The Moore–Penrose inverse of some of a robot's rows, turns scaled to its size.
Eigen::MatrixXd twist_solver(const RowBlock& H, double size_m) {
  const Vector3 scale(1.0, 1.0, size_m > 0.0 ? 1.0 / size_m : 1.0);
  const RowBlock scaled = H * scale.asDiagonal();
  const geometry::SymmetricEigen eigen = geometry::symmetric_eigen(scaled.transpose() * scaled);
  Eigen::MatrixXd solver = Eigen::MatrixXd::Zero(3, H.rows());
  for (int i = 0; i < 3; ++i) {
    if (eigen.values[i] <= kIndependent * kIndependent * eigen.values[2]) continue;
    const Vector3 direction = scale.cwiseProduct(Vector3(eigen.vectors.col(i)));
    solver += direction * (scaled * eigen.vectors.col(i)).transpose() / eigen.values[i];
  }
  return solver;
}

using Turns = std::array<double, kMaxWheels>;

/// What a map of the wheels' turns makes of their travel.
template <class Map>
RowVector of_turns(const Chassis& chassis, const RowVector& travel, const Map& map) {
  RowVector mapped = travel;
  Turns turned{};
  for (std::size_t i = 0; i < chassis.wheels().size(); ++i)
    turned[i] = travel[static_cast<int>(i)] / (kPi * chassis.wheels()[i].diameter_m);
  turned = map(turned);
  for (std::size_t i = 0; i < chassis.wheels().size(); ++i)
    mapped[static_cast<int>(i)] = turned[i] * kPi * chassis.wheels()[i].diameter_m;
  return mapped;
}

bool scrubs(const Chassis& chassis) {
  return chassis.scrub != 0.0 && can_scrub(chassis);
}

/// What wheels read that move the ground by that travel, and by what they move the ground. Of a robot that
/// neither scrubs nor grows, the travel itself; of one that does both, their product is left out.
RowVector read_of_ground(const Chassis& chassis, RowVector travel, double duration_s) {
  if (scrubs(chassis))
    travel = of_turns(chassis, travel, [&](const Turns& turned) { return with_scrub(chassis, turned); });
  if (chassis.tyre_growth_s2_m2 == 0.0) return travel;
  return of_turns(chassis, travel,
                  [&](const Turns& turned) { return with_growth(chassis, turned, duration_s); });
}

RowVector ground_of_read(const Chassis& chassis, RowVector travel, double duration_s) {
  if (chassis.tyre_growth_s2_m2 != 0.0)
    travel = of_turns(chassis, travel,
                      [&](const Turns& turned) { return without_growth(chassis, turned, duration_s); });
  if (!scrubs(chassis)) return travel;
  return of_turns(chassis, travel, [&](const Turns& turned) { return without_scrub(chassis, turned); });
}

bool sees_all_directions(const RowBlock& H) {
  return rank_of(H, 1e-9) == 3;
}

}  // namespace

Kinematics::Kinematics(const Scenario& scenario)
    : steering_(scenario.steering),
      nominal_(scenario.nominal.chassis),
      truth_(scenario.truth.chassis),
      is_steered_(is_steered(nominal_)),
      unsteered_rows_(rows_without_steering(steering_ == Steering::odometry ? nominal_ : truth_)),
      nominal_rows_(rows_of(scenario.nominal.chassis, false)),
      true_rows_(rows_of(scenario.truth.chassis, false)),
      diameter_ratio_(ratios_of_diameters(scenario, true_rows_)) {
  assert(scenario.nominal.chassis.wheel_count == scenario.truth.chassis.wheel_count);
  if (is_steered_)
    steer({});
  else if (steering_ == Steering::odometry)
    prepare_solver(scenario);
}

void Kinematics::steer(const SteeringReadings& readings) {
  const Increment standing{.steering_rad = readings};
  nominal_rows_ = rows_of(at_steering(nominal_, standing), false);
  true_rows_ = rows_of(at_steering(truth_, standing), false);
  const int moving = steering_ == Steering::odometry ? true_rows_.count() : lateral_count(true_rows_);
  twist_from_readings_ =
      twist_solver(true_rows_.H.bottomRows(moving), true_rows_.H.col(2).cwiseAbs().maxCoeff());
}

void Kinematics::prepare_solver(const Scenario& scenario) {
  RowBlock H = true_rows_.H;
  const auto& gyro = scenario.truth.chassis.gyro;
  if (!sees_all_directions(H) && gyro && scenario.nominal.chassis.gyro) {
    holds_heading_ = true;
    gyro_scale_ratio_ = gyro->scale / scenario.nominal.chassis.gyro->scale;
    H.conservativeResize(H.rows() + 1, 3);
    H.row(H.rows() - 1) << 0.0, 0.0, 1.0;
  }
  if (!sees_all_directions(H))
    throw CannotAnswer(
        "the wheels do not see every direction of motion, so the robot cannot steer by them: "
        "choose the truth as the one that drives the path, or add a gyro or wheels");
  const Matrix3 HtH = H.transpose() * H;
  twist_from_readings_ = HtH.inverse() * H.transpose();
}

Twist2 Kinematics::ideal_twist(const Twist2& commanded) const {
  return Twist2::from(
      without_skidding(unsteered_rows_, commanded, RowVector::Zero(lateral_count(unsteered_rows_))));
}

RowVector Kinematics::ideal_travel(const Twist2& commanded, double duration_s) const {
  const Rows& rows = steering_ == Steering::odometry ? nominal_rows_ : true_rows_;
  const Chassis& drives = steering_ == Steering::odometry ? nominal_ : truth_;
  const RowVector ground = rows.H.topRows(rows.measured) * ideal_twist(commanded).vector();
  const RowVector travel = read_of_ground(drives, ground, duration_s);
  if (steering_ == Steering::truth) return travel;
  if (truth_.wheel_count > 0)
    return diameter_ratio_.cwiseProduct(travel);  // the same revolutions of the true wheels
  const ForwardAndTurn read = read_as(nominal_.velocity, {travel[0], travel[1]}, duration_s);
  const ForwardAndTurn meant = corrected(truth_.velocity, read, duration_s);
  return Eigen::Vector2d(meant.forward_m, meant.turn_rad);
}

Motion Kinematics::move(const Twist2& commanded, const RowErrors& errors, double duration_s) const {
  const auto H = true_rows_.H.topRows(true_rows_.measured);
  if (steering_ == Steering::truth) {
    const Vector3 xi = is_steered_ ? solve({}, errors.lateral, commanded)
                                   : without_skidding(true_rows_, commanded, errors.lateral);
    return {Twist2::from(xi), read_of_ground(truth_, H * xi, duration_s) + errors.measured};
  }
  const RowVector asked = ideal_travel(commanded, duration_s);
  const Vector3 xi =
      solve(ground_of_read(truth_, asked - errors.measured, duration_s), errors.lateral, commanded);
  const Vector3 xi_without_errors =
      solve(ground_of_read(truth_, asked, duration_s), RowVector::Zero(errors.lateral.size()), commanded);
  return {Twist2::from(xi), asked + errors.measured - H * (xi_without_errors - xi)};
}

Vector3 Kinematics::solve(const RowVector& travel, const RowVector& lateral, const Twist2& commanded) const {
  Readings z(twist_from_readings_.cols());
  z.head(travel.size()) = travel;
  z.segment(travel.size(), lateral.size()) = lateral;
  if (holds_heading_) z[z.size() - 1] = gyro_scale_ratio_ * commanded.dtheta;
  if (!is_steered_) return twist_from_readings_ * z;
  // Where the rows see no longer all of the motion the rest is as commanded.
  const Vector3 xi = ideal_twist(commanded).vector();
  return xi + twist_from_readings_ * (z - true_rows_.H.bottomRows(z.size()) * xi);
}

}  // namespace trundle::simulation
