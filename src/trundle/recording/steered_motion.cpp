#include "trundle/recording/detail/steered_motion.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "trundle/chassis/rows.hpp"
#include "trundle/geometry/squared.hpp"
#include "trundle/recording/alignment/replay.hpp"
#include "trundle/recording/csv/detail/table.hpp"

namespace trundle::recording {
namespace {

// Of λ₁λ₂/(λ₁ + λ₂)², eigenvalues of LᵀL: with less wheels stand so that the body may turn about any point of
// a line.
constexpr double kOpen = 1e-4;

/// Of a symmetric matrix: det(A) A⁻¹, which a matrix of rank 2 has, too.
Matrix3 adjugate(const Matrix3& A) {
  Matrix3 result;
  result << A.row(1).cross(A.row(2)), A.row(2).cross(A.row(0)), A.row(0).cross(A.row(1));
  return result;
}

bool does_not_skid(const Wheel& wheel) {
  return wheel.kind == WheelKind::fixed;
}

SteeringAngles angles_of(const Recording& recording, const Robot& robot) {
  SteeringAngles angles(robot);
  WheelUnits units{};
  std::array<const WheelSeries*, kMaxWheels> columns{};
  for (std::size_t i = 0; i < robot.chassis.all_wheels().size(); ++i) {
    if (!robot.chassis.all_wheels()[i].steering) continue;
    columns[i] = &steering_of(recording, wheel_name(robot, i));
    units[i] = columns[i]->unit;
  }
  angles.set_units(units);
  const std::vector<double>& time_s = recording.wheels.time_s;
  for (std::size_t row = 0; row < time_s.size(); ++row) {
    std::array<double, kMaxWheels> readings{};
    for (std::size_t i = 0; i < columns.size(); ++i)
      readings[i] = columns[i] == nullptr ? kNotMeasured : columns[i]->value[row];
    angles.add(time_s[row] + robot.chassis.wheels_time_offset_s, readings);
  }
  return angles;
}

double usual_steering_step_s(const Recording& recording, const Robot& robot) {
  double slowest_s = 0.0;
  for (std::size_t i = 0; i < robot.chassis.all_wheels().size(); ++i) {
    if (!robot.chassis.all_wheels()[i].steering) continue;
    const std::vector<double>& angles = steering_of(recording, wheel_name(robot, i)).value;
    std::vector<double> read_s;
    for (std::size_t row = 0; row < angles.size(); ++row)
      if (!std::isnan(angles[row])) read_s.push_back(recording.wheels.time_s[row]);
    if (read_s.size() >= 2) slowest_s = std::max(slowest_s, median_step(read_s));
  }
  return slowest_s;
}

}  // namespace

SteeredMotion::SteeredMotion(const Recording& recording, const AlignedReadings& readings, const Robot& robot)
    : readings_(readings),
      chassis_(robot.chassis),
      angles_(angles_of(recording, robot)),
      steering_step_s_(usual_steering_step_s(recording, robot)),
      longest_step_s_(std::max(longest_step(recording.wheels.time_s), 5.0 * steering_step_s_)) {
  for (const Wheel& wheel : chassis_.all_wheels())
    size_m_ = std::max(size_m_, std::hypot(wheel.x_m, wheel.y_m));
  for (const Wheel& wheel : chassis_.all_wheels()) {
    if (wheel.steering || !does_not_skid(wheel)) continue;
    Vector3 row = lateral_row(wheel);
    row.z() /= size_m_;
    unsteered_ += row * row.transpose();
  }
}

SteeredMotion SteeredMotion::smoothed(double over_s) const {
  SteeredMotion motion = *this;
  motion.angles_.smooth(over_s);
  return motion;
}

/// The twist that no lateral row sees, of any length; nothing where it is more than one.
std::optional<Vector3> SteeredMotion::direction(const std::array<double, kMaxWheels>& steering_rad) const {
  Matrix3 squares = unsteered_;
  const auto wheels = chassis_.all_wheels();
  for (std::size_t i = 0; i < wheels.size(); ++i) {
    if (!wheels[i].steering || !does_not_skid(wheels[i])) continue;
    Wheel wheel = wheels[i];
    wheel.steering->reading_rad = steering_rad[i];
    Vector3 row = lateral_row(wheel);
    row.z() /= size_m_;
    squares += row * row.transpose();
  }
  // λ₁λ₂ v₀v₀ᵀ of the smallest eigenvalue's v₀, as nearly as that eigenvalue is small: two steps of the power
  // method, from the axis nearest to it.
  const Matrix3 inverse = adjugate(squares);
  if (!(inverse.trace() > kOpen * squared(squares.trace()))) return std::nullopt;
  Eigen::Index nearest = 0;
  inverse.diagonal().maxCoeff(&nearest);
  const Vector3 scaled = (inverse * inverse.col(nearest)).normalized();
  return Vector3(scaled.x(), scaled.y(), scaled.z() / size_m_);
}

SteeredMotion::Twists SteeredMotion::twists(double later_s) const {
  const std::size_t count = readings_.increments.size();
  Twists result{std::vector<Twist2>(count), std::vector<bool>(count)};
  for (std::size_t i = 0; i < count; ++i) {
    const Increment& increment = readings_.increments[i];
    result.lost[i] = readings_.bridged[i];
    if (!any_turns(increment)) continue;
    const SteeringAngles::Reading steering =
        angles_.at(increment.time_s - 0.5 * increment.duration_s - later_s, longest_step_s_);
    const std::optional<Vector3> along = direction(steering.rad);
    result.lost[i] = result.lost[i] || !along || !steering.known;
    if (!along) continue;
    double rolled = 0.0, squares = 0.0;  // z on Hξ of the rolling rows, by least squares
    for (std::size_t w = 0; w < chassis_.wheels().size(); ++w) {
      Wheel wheel = chassis_.wheels()[w];
      if (wheel.steering) wheel.steering->reading_rad = steering.rad[w];
      const double rolls = rolling_row(wheel).dot(*along);
      rolled += rolls * kPi * wheel.diameter_m * increment.turned[w];
      squares += rolls * rolls;
    }
    if (squares > 0.0) result.twist[i] = Twist2::from(*along * (rolled / squares));
  }
  return result;
}

}  // namespace trundle::recording
