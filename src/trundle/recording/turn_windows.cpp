#include "trundle/recording/detail/turn_windows.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "trundle/recording/alignment/gyro_turns.hpp"

namespace trundle::recording {
namespace {

using Vector = Eigen::VectorXd;

// Half a window is at least so many steps of the slower sensor: twice the golden ratio, so that no two
// windows begin at the same place between two samples. Then what is read off between them is no less noisy at
// one offset than at another.
constexpr double kStepsOfHalfAWindow = 3.2360679774997897;

/// None of a stream that is mostly gap, with fewer stamps than halves of windows: one wrong stamp makes
/// years.
Windows windows_of(const TurnIntegral& sensor, double half_s) {
  const double halves = std::floor((sensor.last_s() - sensor.first_s()) / half_s);
  if (halves > static_cast<double>(sensor.stamps())) return {sensor.first_s(), half_s, 0};
  return {sensor.first_s(), half_s, static_cast<std::size_t>(std::max(halves - 1.0, 0.0))};
}

}  // namespace

double half_of_a_window(double least_s, double slower_step_s) {
  return std::max(least_s, kStepsOfHalfAWindow * slower_step_s);
}

Vector turns_in(const Windows& windows, const TurnIntegral& sensor, double offset_s,
                std::vector<bool>& used) {
  Vector turns = Vector::Zero(static_cast<Eigen::Index>(windows.count));
  std::size_t near = 0;
  TurnIntegral::Reading start = sensor.at(windows.time_s(0) - offset_s, near);
  TurnIntegral::Reading middle = sensor.at(windows.time_s(1) - offset_s, near);
  for (std::size_t w = 0; w < windows.count; ++w) {
    const TurnIntegral::Reading end = sensor.at(windows.time_s(w + 2) - offset_s, near);
    if (start.known && middle.known && end.known && start.lost_before == end.lost_after)
      turns[static_cast<Eigen::Index>(w)] = (end.area - 2.0 * middle.area + start.area) / windows.half_s;
    else
      used[w] = false;
    start = middle;
    middle = end;
  }
  return turns;
}

OwnTurns own_turns(const TurnIntegral& sensor, double half_s) {
  OwnTurns own{windows_of(sensor, half_s), {}, {}};
  own.known.assign(own.windows.count, true);
  own.turns = turns_in(own.windows, sensor, 0.0, own.known);
  return own;
}

double roughness(const OwnTurns& own) {
  double jumps = 0.0, changes = 0.0;
  for (Eigen::Index w = 1; w + 1 < own.turns.size(); ++w) {
    const auto i = static_cast<std::size_t>(w);
    if (!own.known[i - 1] || !own.known[i] || !own.known[i + 1]) continue;
    jumps += std::pow(own.turns[w + 1] - 2.0 * own.turns[w] + own.turns[w - 1], 2);
    changes += std::pow(own.turns[w + 1] - own.turns[w], 2);
  }
  return changes > 0.0 ? jumps / changes : 0.0;
}

TurnIntegral integral_of_gyro(const GyroStream& gyro, const Gyro& sensor) {
  const GyroSamples samples(gyro, sensor);
  Turns turns;
  turns.turn_rad.reserve(gyro.time_s.size());
  for (std::size_t i = 0; i < gyro.time_s.size(); ++i) {
    if (samples.is_lost[i]) turns.lost.push_back(i);
    turns.turn_rad.push_back(i == 0 ? 0.0 : gyro.yaw_rate_rad_s[i] * (gyro.time_s[i] - gyro.time_s[i - 1]));
  }
  return {Stamps::of(gyro.time_s), std::move(turns)};
}

}  // namespace trundle::recording
