#include "trundle/odometry/stuck.hpp"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "trundle/chassis/without_wheel.hpp"

namespace trundle::odometry {

static_assert(std::is_trivially_copyable_v<StuckState>);

namespace {

std::optional<MotionModel> model_of(const Chassis& chassis, bool with_gyro) {
  if (chassis.wheel_count == 0 || (with_gyro && !chassis.gyro)) return std::nullopt;
  if (observability(rows_of(chassis, with_gyro)).rank < 3) return std::nullopt;
  return MotionModel(chassis, std::span(&kGyroBias, chassis.gyro ? 1 : 0), with_gyro);
}

/// The others' counts are rounded where this begins and where it ends, not in between.
double rounding_along(const Triple& h, const TwistStep& step, const Chassis& others) {
  double variance = 0.0;
  for (std::size_t i = 0; i < others.wheels().size(); ++i) {
    const WheelVectors& by = step.by_travel;
    const double share = dot(h, {by.x[i], by.y[i], by.h[i]});
    variance += 2.0 * share * share * rounding_variance(others.wheels()[i]);
  }
  return variance;
}

/// |readings| as travel, the speed they show: an interval by itself.
Rolled magnitudes(const std::array<double, kMaxWheels>& turned) {
  Rolled rolled;
  std::ranges::transform(turned, rolled.begin(), [](double u) { return std::abs(u); });
  return rolled;
}

Triple rolling_row_at(Wheel wheel, double steering_rad) {
  if (wheel.steering) wheel.steering->reading_rad = steering_rad;
  const Vector3 row = rolling_row(wheel);
  return {row.x(), row.y(), row.z()};
}

/// hᵀ Q h
double variance_along(const Triple& h, const Symmetric3& Q) {
  return h[0] * (h[0] * Q[0] + 2.0 * (h[1] * Q[1] + h[2] * Q[2])) + h[1] * (h[1] * Q[3] + 2.0 * h[2] * Q[4]) +
         h[2] * h[2] * Q[5];
}

}  // namespace

StuckWheels::StuckWheels(const Chassis& chassis, const RestOptions& options)
    : sigmas_(options.stuck_sigmas), lag_s_(options.lag_s), has_gyro_(chassis.gyro.has_value()) {
  gyro_ = chassis.gyro.value_or(Gyro{});
  for (std::size_t i = 0; i < chassis.wheels().size(); ++i) {
    const Wheel& wheel = chassis.wheels()[i];
    wheels_.push_back(wheel);
    unseen_m_.push_back(std::max(options.jitter_ticks * metres_per_tick(wheel), options.jitter_m));
    const Chassis rest = without_wheel(chassis, i);
    others_.push_back({rest, model_of(rest, true), model_of(rest, false)});
  }
}

void StuckWheels::watch(StuckState& state, const Increment& increment, const GyroBias& bias,
                        std::size_t octave) const {
  const bool all_still = !any_turns(increment);
  for (std::size_t i = 0; i < wheels_.size(); ++i) {
    StillWheel& still = state.still[i];
    const std::uint64_t bit = std::uint64_t{1} << i;
    if (increment.turned[i] != 0.0) {
      still = {};
      state.stuck &= ~bit;
      continue;
    }
    if (still.still_s >= lag_s_) expect(still, i, increment, all_still, octave);
    still.still_s += increment.duration_s;
    const double variance = still.variance + still.by_bias * still.by_bias * bias.variance;
    if (std::abs(still.travel_m) > unseen_m_[i] + sigmas_ * std::sqrt(variance)) state.stuck |= bit;
  }
}

void StuckWheels::expect(StillWheel& still, std::size_t wheel, const Increment& increment, bool all_still,
                         std::size_t octave) const {
  const Triple h = rolling_row_at(wheels_[wheel], increment.steering_rad[wheel]);
  const bool gyro = has_gyro_ && increment.has_gyro;
  const auto& others = gyro ? others_[wheel].with_gyro : others_[wheel].without_gyro;
  if (others) {
    TwistStep step;
    const Increment rest = without_wheel(increment, wheel);
    others->twist_with_covariance(rest, magnitudes(rest.turned), octave, step);
    if (still.variance == 0.0) still.variance = rounding_along(h, step, others_[wheel].chassis);
    still.travel_m += dot(h, step.twist);
    still.variance += variance_along(h, step.covariance);
    if (gyro) still.by_bias += dot(h, step.derivative[0]);
  } else if (all_still && gyro) {
    const double lever = h[2] * gyro_.scale;
    still.travel_m += lever * (increment.gyro_rad - gyro_.bias_rad_s * increment.duration_s);
    still.variance +=
        lever * lever * gyro_.noise_rad_s_sqrt_hz * gyro_.noise_rad_s_sqrt_hz * increment.duration_s;
    still.by_bias -= lever * increment.duration_s;
  }
}

}  // namespace trundle::odometry
