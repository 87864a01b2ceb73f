#include "trundle/odometry/effective_track.hpp"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "trundle/chassis/ground_turned.hpp"
#include "trundle/geometry/squared.hpp"
#include "trundle/io/error.hpp"
#include "trundle/recording/alignment/replay.hpp"

namespace trundle::odometry {

static_assert(std::is_trivially_copyable_v<EffectiveTrackState>);

namespace {

constexpr double kPriorTrack = 0.5;        // 1σ of the track before anything is known, as a share of nominal
constexpr double kPriorBias_rad_s = 0.02;  // 1σ of what is left of the gyro's bias
constexpr double kPriorWindows = 5.0;      // that the assumed scatter counts for
constexpr double kLeastTurn_rad = 0.5;     // before a track is told
constexpr double kLeastWindowTurn_rad = 0.02;  // of a lesser turn noise decides the sense
// [σ] A window counts no more than this: with the usual alarm and slack at least four must agree.
constexpr double kLargestInnovation = 4.0;

bool rolls_ahead(const Wheel& wheel) {
  return !has_rollers(wheel.kind) && wheel.y_m != 0.0 && !wheel.steering &&
         std::abs(std::sin(wheel.direction_rad)) < 1e-3 && std::cos(wheel.direction_rad) > 0.0;
}

}  // namespace

bool EffectiveTrack::applies_to(const Chassis& chassis) {
  const auto wheels = chassis.wheels();
  return chassis.gyro && std::ranges::all_of(wheels, rolls_ahead) &&
         std::ranges::any_of(wheels, [](const Wheel& w) { return w.y_m > 0.0; }) &&
         std::ranges::any_of(wheels, [](const Wheel& w) { return w.y_m < 0.0; });
}

EffectiveTrack::EffectiveTrack(const Chassis& chassis, const EffectiveTrackOptions& options)
    : chassis_(chassis), options_(options) {
  if (!applies_to(chassis))
    throw CannotAnswer("an effective track needs wheels on two sides that roll ahead, and a gyro");
  double left_y = 0.0, right_y = 0.0;
  for (const Wheel& wheel : chassis.wheels()) {
    (wheel.y_m > 0.0 ? left_ : right_) += 1;
    (wheel.y_m > 0.0 ? left_y : right_y) += wheel.y_m;
  }
  nominal_m_ = left_y / left_ - right_y / right_;
}

bool EffectiveTrack::step(const Increment& increment) {
  if (!increment.has_gyro) return false;
  const auto wheels = chassis_.wheels();
  for (std::size_t i = 0; i < wheels.size(); ++i) {
    const double travel = kPi * wheels[i].diameter_m * ground_turned(chassis_, i, increment);
    const bool left = wheels[i].y_m > 0.0;
    state_.difference_m += left ? -travel / left_ : travel / right_;
    state_.path_m += std::abs(travel) / squared(left ? left_ : right_);
  }
  const Gyro& gyro = *chassis_.gyro;
  state_.turn_rad += (increment.gyro_rad - gyro.bias_rad_s * increment.duration_s) * gyro.scale;
  state_.duration_s += increment.duration_s;
  return state_.duration_s >= options_.window_s - 1e-9 && finish_window();
}

/// Noise of d − b g over the window being filled: wheels, rounding of counts, gyro.
double EffectiveTrack::window_variance() const {
  const Wheel& wheel = chassis_.wheels().front();
  const double gyro = nominal_m_ * chassis_.gyro->noise_rad_s_sqrt_hz * chassis_.gyro->scale;
  return squared(typical_wheel_noise(chassis_)) * state_.path_m + squared(metres_per_tick(wheel)) / 3.0 +
         squared(gyro) * state_.duration_s + 1e-12;
}

EffectiveTrack::Solution EffectiveTrack::solve() const {
  const auto& [n00, n01, n11] = state_.normal;
  const double a = n00 + 1.0 / squared(kPriorTrack * nominal_m_);
  const double d = n11 + 1.0 / squared(kPriorBias_rad_s * nominal_m_);
  const double r0 = state_.right[0] + nominal_m_ / squared(kPriorTrack * nominal_m_);
  const double determinant = a * d - n01 * n01;
  const double i00 = d / determinant, i01 = -n01 / determinant, i11 = a / determinant;
  // N⁻¹ M N⁻¹ with M = Σ λ² w x xᵀ, and the prior once.
  const double m00 = state_.scatter[0] + 1.0 / squared(kPriorTrack * nominal_m_);
  const double m11 = state_.scatter[2] + 1.0 / squared(kPriorBias_rad_s * nominal_m_);
  const double variance = i00 * i00 * m00 + 2.0 * i00 * i01 * state_.scatter[1] + i01 * i01 * m11;
  return {i00 * r0 + i01 * state_.right[1], i01 * r0 + i11 * state_.right[1], variance};
}

double EffectiveTrack::scatter() const {
  return (state_.squares + kPriorWindows) / (state_.count + kPriorWindows);
}

bool EffectiveTrack::finish_window() {
  const Solution known = solve();
  const double variance = window_variance();
  const double innovation =
      state_.difference_m - known.track_m * state_.turn_rad - known.drift_m_s * state_.duration_s;
  const bool left =
      leaves(innovation, variance * scatter() + squared(state_.turn_rad) * known.variance * scatter());
  if (left) {
    const EffectiveTrackState window = state_;
    state_ = {};
    state_.difference_m = window.difference_m;
    state_.turn_rad = window.turn_rad;
    state_.duration_s = window.duration_s;
  } else {
    const double size = squared(innovation) / (variance + squared(state_.turn_rad) * known.variance);
    state_.squares += std::min(size, squared(kLargestInnovation) * scatter());
    state_.count += 1.0;
  }
  learn(1.0 / variance);
  state_.turned_rad += std::abs(state_.turn_rad);
  state_.difference_m = state_.turn_rad = state_.duration_s = state_.path_m = 0.0;
  return left;
}

/// A cumulative sum to both sides: a larger track makes d larger in the sense of the turn.
bool EffectiveTrack::leaves(double innovation, double variance) {
  if (std::abs(state_.turn_rad) < kLeastWindowTurn_rad || state_.turned_rad < kLeastTurn_rad) return false;
  const double normalised =
      std::clamp(std::copysign(innovation, innovation * state_.turn_rad) / std::sqrt(variance),
                 -kLargestInnovation, kLargestInnovation);
  state_.above = std::max(0.0, state_.above + normalised - options_.slack);
  state_.below = std::max(0.0, state_.below - normalised - options_.slack);
  return std::max(state_.above, state_.below) > options_.alarm;
}

void EffectiveTrack::learn(double weight) {
  const double keep = std::exp(-std::abs(state_.turn_rad) / options_.memory_rad);
  for (double& sum : state_.normal) sum *= keep;
  for (double& sum : state_.scatter) sum *= keep * keep;
  for (double& sum : state_.right) sum *= keep;
  state_.squares *= keep;
  state_.count *= keep;
  // The gyro's own noise would make its turns look larger, and the track smaller.
  const double gyro = chassis_.gyro->noise_rad_s_sqrt_hz * chassis_.gyro->scale;
  const double turn2 = squared(state_.turn_rad) - squared(gyro) * state_.duration_s;
  const std::array<double, 3> xx = {turn2, state_.turn_rad * state_.duration_s, squared(state_.duration_s)};
  for (std::size_t i = 0; i < 3; ++i) {
    state_.normal[i] += weight * xx[i];
    state_.scatter[i] += weight * (i == 0 ? squared(state_.turn_rad) : xx[i]);
  }
  state_.right[0] += weight * state_.turn_rad * state_.difference_m;
  state_.right[1] += weight * state_.duration_s * state_.difference_m;
}

std::optional<double> EffectiveTrack::track_m() const {
  if (state_.turned_rad < kLeastTurn_rad) return std::nullopt;
  return solve().track_m;
}

double EffectiveTrack::sigma_m() const {
  return std::sqrt(solve().variance * scatter());
}

namespace {

/// One entry after the other.
class TracksAlong {
 public:
  TracksAlong(const Chassis& chassis, const EffectiveTrackOptions& options, double start_s)
      : track_(chassis, options), start_s_(start_s) {}

  void add(const Increment& increment) {
    if (track_.step(increment)) {
      finish();
      start_s_ = increment.time_s;
    }
    if (const auto track_m = track_.track_m())
      last_ = {
          .start_s = start_s_, .end_s = increment.time_s, .track_m = *track_m, .sigma_m = track_.sigma_m()};
  }
  std::vector<TrackOnGround> take() {
    finish();
    return std::move(found_);
  }

 private:
  void finish() {
    if (last_.end_s > start_s_) found_.push_back(last_);
  }

  EffectiveTrack track_;
  double start_s_;
  TrackOnGround last_;
  std::vector<TrackOnGround> found_;
};

}  // namespace

std::vector<TrackOnGround> effective_tracks(const AlignedReadings& readings, const Chassis& chassis,
                                            const EffectiveTrackOptions& options) {
  TracksAlong tracks(chassis, options, readings.start_s);
  for (const Increment& increment : readings.increments) tracks.add(increment);
  return tracks.take();
}

std::vector<TrackOnGround> effective_tracks(const Recording& recording, const Robot& robot) {
  Replay replay(recording, robot);
  std::optional<AlignedInterval> interval = replay.next();
  TracksAlong tracks(robot.chassis, {}, replay.start_s());
  for (; interval; interval = replay.next()) tracks.add(interval->increment);
  return tracks.take();
}

}  // namespace trundle::odometry
