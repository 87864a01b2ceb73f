#include "trundle/inspection/steering_direction.hpp"

#include <array>
#include <cmath>
#include <complex>

#include "trundle/calibration/preparation/reversed_wheel.hpp"
#include "trundle/chassis/rows.hpp"
#include "trundle/chassis/without_wheel.hpp"
#include "trundle/geometry/angle.hpp"
#include "trundle/inspection/reference_turns.hpp"
#include "trundle/recording/alignment/replay.hpp"
#include "trundle/recording/alignment/steering_angles.hpp"

namespace trundle::inspection {
namespace {

/// Where a wheel rolls against where it was said to. It rolls forth and back, so angles are doubled:
///   Σ |u| e^{2i (∠u − told)} over displacements u of its contact point.
class RollingBeside {
 public:
  void add(const Wheel& wheel, const Twist2& twist) {
    const std::complex<double> moved(twist.dx - twist.dtheta * wheel.y_m,
                                     twist.dy + twist.dtheta * wheel.x_m);
    const double way_m = std::abs(moved);
    way_m_ += way_m;
    sum_ += std::polar(way_m, 2.0 * (std::arg(moved) - rolling_direction(wheel)));
  }

  [[nodiscard]] double way_m() const { return way_m_; }
  [[nodiscard]] double agreement() const { return std::abs(sum_) / way_m_; }  ///< 1: always by one angle
  [[nodiscard]] double mean_rad() const { return 0.5 * std::arg(sum_); }      ///< in (−π/2, π/2]

 private:
  std::complex<double> sum_;
  double way_m_ = 0.0;
};

/// The zero with which the wheel points to where it rolls, as the robot file takes it; nothing where that is
/// turns of a geared steering away.
std::optional<double> zero_that_fits(const SteeringSensor& sensor, double beside_rad) {
  const double zero_rad = sensor.zero_rad - beside_rad / sensor.scale;
  if (is_direct(sensor)) return wrap_angle(zero_rad);
  return std::abs(zero_rad) <= 2.0 * kPi ? std::optional(zero_rad) : std::nullopt;
}

/// Whether the wheels that are not steered turn the robot as gyro or reference do.
bool turn_rightly(const Chassis& others, const Recording& recording, Robot robot) {
  robot.chassis = others;
  const auto turns = turns_beside(recording, robot, overview_of(recording, robot).turns);
  return turns && turns_agree(*turns, robot);
}

}  // namespace

std::optional<Finding> wrong_steering_direction(const Recording& recording, const Robot& robot) {
  constexpr double kLeastWay_m = 2.0;
  constexpr double kAlike = 0.8;              // angles that scatter by 19°
  constexpr double kFar_rad = radians(30.0);  // calibration finds a zero from nearer
  const std::optional<Chassis> others = without_steering(robot.chassis);
  if (!others || recording.wheels.steering.empty()) return std::nullopt;
  const Rows rows = rows_of(*others, false);
  if (observability(rows).rank < 3) return std::nullopt;

  std::array<RollingBeside, kMaxWheels> beside;
  Replay replay(recording, robot);
  while (const auto interval = replay.next()) {
    if (interval->bridged) continue;  // which angle it had meanwhile is not known
    const Twist2 twist = twist_of(*others, rows, interval->increment);
    const Chassis standing = at_steering(robot.chassis, interval->increment);
    for (std::size_t i = 0; i < standing.all_wheels().size(); ++i)
      if (standing.all_wheels()[i].steering) beside[i].add(standing.all_wheels()[i], twist);
  }
  for (std::size_t i = 0; i < robot.chassis.all_wheels().size(); ++i) {
    const RollingBeside& wheel = beside[i];
    if (wheel.way_m() < kLeastWay_m || wheel.agreement() < kAlike || std::abs(wheel.mean_rad()) < kFar_rad)
      continue;
    const auto zero_rad = zero_that_fits(*robot.chassis.all_wheels()[i].steering, wheel.mean_rad());
    if (!zero_rad || !turn_rightly(*others, recording, robot)) continue;
    return Finding{.code = FindingCode::steering_direction,
                   .place = recording.wheels.origin.file,
                   .subjects = {wheel_name(robot, i)},
                   .payload = payload::Range{degrees(wheel.mean_rad()), degrees(*zero_rad)}};
  }
  return std::nullopt;
}

}  // namespace trundle::inspection
