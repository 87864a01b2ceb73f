#include "trundle/simulation/steering.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "trundle/simulation/streams.hpp"

namespace trundle::simulation {
namespace {

// A place of the robot that is slower than this rests: rounding alone moves it.
constexpr double kResting_m_s = 1e-9;
// A wheel may turn either way to one that stands across it, to within the rounding of angles.
constexpr double kAcross_rad = 1e-9;

/// Where the wheel rolls when its place moves like that; nothing where it rests.
std::optional<double> course_of(const Wheel& wheel, const Twist2& velocity) {
  const double vx = velocity.dx - velocity.dtheta * wheel.y_m;
  const double vy = velocity.dy + velocity.dtheta * wheel.x_m;
  if (std::hypot(vx, vy) < kResting_m_s) return std::nullopt;
  return std::atan2(vy, vx);
}

/// The direction nearest to the one before in which the wheel rolls along that course, forwards or backwards;
/// of two that are as near the one nearer to where its steering is at zero.
double nearest_direction(double course_rad, double before_rad, const Wheel& wheel) {
  double turn = std::remainder(course_rad - before_rad, kPi);
  const auto from_zero = [&](double by) { return std::abs(before_rad + by - wheel.direction_rad); };
  if (std::abs(turn) > 0.5 * kPi - kAcross_rad && from_zero(-turn) < from_zero(turn)) turn = -turn;
  return before_rad + turn;
}

/// While the wheel rests between two known directions: evenly in time.
void turn_at_rest(std::span<const double> times_s, double from_rad, double to_rad,
                  std::span<double> direction) {
  if (times_s.empty()) return;
  const double rest_s = times_s.back() - times_s.front();
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    const double share = rest_s > 0.0 ? (times_s[i] - times_s.front()) / rest_s : 0.0;
    direction[i] = from_rad + share * (to_rad - from_rad);
  }
}

/// Of one wheel at all those times. At the start it stands as its first motion asks, at the end as its last.
std::vector<double> directions_of(const Wheel& wheel, const std::vector<Twist2>& velocity,
                                  const std::vector<double>& times_s) {
  std::vector<double> direction(times_s.size(), wheel.direction_rad);
  std::optional<std::size_t> known;  // the last one
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    const std::optional<double> course = course_of(wheel, velocity[i]);
    if (!course) continue;
    const double before = known ? direction[*known] : wheel.direction_rad;
    direction[i] = nearest_direction(*course, before, wheel);
    const std::size_t first = known ? *known + 1 : 0;
    turn_at_rest(std::span(times_s).subspan(first, i - first), known ? before : direction[i], direction[i],
                 std::span(direction).subspan(first, i - first));
    known = i;
  }
  if (known)
    std::fill(direction.begin() + static_cast<std::ptrdiff_t>(*known), direction.end(), direction[*known]);
  return direction;
}

double reading_at(const SteeringSensor& steering, double direction_rad, double zero_direction_rad) {
  return steering.zero_rad + (direction_rad - zero_direction_rad) / steering.scale;
}

/// At any time, later from call to call: straight lines between the moments and the middles between them, in
/// which the rows of the motion stand as they do there.
class SteeringFollower {
 public:
  SteeringFollower(const Drive& drive, std::size_t wheel) : moments_(drive.moments), wheel_(wheel) {}

  double at(double time_s) {
    while (next_ + 1 < moments_.size() && moments_[next_].time_s < time_s) ++next_;
    const Moment& after = moments_[next_];
    const Moment& before = moments_[next_ == 0 ? 0 : next_ - 1];
    const double half_s = 0.5 * (after.time_s - before.time_s);
    const double halves = half_s > 0.0 ? std::clamp((time_s - before.time_s) / half_s, 0.0, 2.0) : 0.0;
    const double from = before.steering_rad[wheel_], middle = after.steering_within_rad[wheel_];
    if (halves <= 1.0) return from + halves * (middle - from);
    return middle + (halves - 1.0) * (after.steering_rad[wheel_] - middle);
  }

 private:
  const std::vector<Moment>& moments_;
  std::size_t wheel_;
  std::size_t next_ = 0;
};

}  // namespace

SteeringPlan plan_steering(const Scenario& scenario, const Kinematics& kinematics, const Command& command,
                           std::span<const double> times_s) {
  const std::size_t count = times_s.size();
  SteeringPlan plan{std::vector<SteeringReadings>(count), std::vector<SteeringReadings>(count - 1)};
  std::vector<double> times;  // and the middles between them
  std::vector<Twist2> velocity;
  for (std::size_t i = 0; i < 2 * count - 1; ++i) {
    times.push_back(i % 2 == 0 ? times_s[i / 2] : 0.5 * (times_s[i / 2] + times_s[i / 2 + 1]));
    velocity.push_back(kinematics.ideal_twist(command.velocity(times.back())));
  }
  const Chassis& driving =
      (scenario.steering == Steering::odometry ? scenario.nominal : scenario.truth).chassis;
  for (std::size_t w = 0; w < driving.all_wheels().size(); ++w) {
    const Wheel& wheel = driving.all_wheels()[w];
    if (!wheel.steering) continue;
    const std::vector<double> direction = directions_of(wheel, velocity, times);
    for (std::size_t i = 0; i < direction.size(); ++i)
      (i % 2 == 0 ? plan.at : plan.within)[i / 2][w] =
          reading_at(*wheel.steering, direction[i], wheel.direction_rad);
  }
  return plan;
}

std::vector<WheelSeries> read_steering(const Scenario& scenario, const Drive& drive) {
  Random random = random_for(scenario.seed, RandomStream::steering);
  const bool counts = scenario.steered.unit == WheelUnit::ticks;
  const double rate_hz = scenario.encoders.rate_hz;
  std::vector<WheelSeries> columns;
  for (std::size_t w = 0; w < scenario.truth.chassis.all_wheels().size(); ++w) {
    const auto& steering = scenario.truth.chassis.all_wheels()[w].steering;
    if (!steering) continue;
    WheelSeries column{wheel_name(scenario.nominal, w), scenario.steered.unit, {}};
    SteeringFollower follower(drive, w);
    for (int k = 0; k / rate_hz <= drive.moments.back().time_s + kSameTime_s; ++k) {
      const double read_rad =
          follower.at(k / rate_hz + steering->time_offset_s) + random.normal(steering->sigma_rad);
      column.value.push_back(counts ? std::round(read_rad / (2.0 * kPi) * steering->ticks_per_revolution)
                                    : read_rad);
    }
    columns.push_back(std::move(column));
  }
  return columns;
}

}  // namespace trundle::simulation
