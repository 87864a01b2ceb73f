#include "trundle/calibration/preparation/velocity_lag.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "trundle/geometry/squared.hpp"
#include "trundle/io/words.hpp"
#include "trundle/recording/csv/detail/table.hpp"

namespace trundle::calibration {
namespace {

// Sigmas: by chance in one of 44 recordings without a lag, and then it is small. One that is missed makes all
// turns too small.
constexpr double kTold = 2.0;

/// Whether it is another one than given by more than chance. Beside a delay a lag acts by its square: that is
/// what is normally distributed.
bool is_told(const TimeOffset& lag, double given_s) {
  return std::abs(squared(lag.offset_s) - squared(given_s)) > kTold * 2.0 * lag.offset_s * lag.sigma_s;
}

/// When within a row a command was given no row says: that blurs as a lag of at most a row does.
double longest_row_s(std::span<const Recording> recordings) {
  double longest_s = 0.0;
  for (const Recording& recording : recordings)
    longest_s = std::max(longest_s, recording::median_step(recording.velocity.time_s));
  return longest_s;
}

/// A clock that was set without a lag has made up for what of it is a delay. One that is 0 was not set.
void move_clock(double& time_offset_s, double step_s) {
  if (time_offset_s != 0.0) time_offset_s += step_s;
}

void move_clocks(double step_s, Robot& robot) {
  if (robot.chassis.gyro) move_clock(robot.chassis.gyro->time_offset_s, step_s);
  if (robot.landmark_sensor) move_clock(robot.landmark_sensor->time_offset_s, step_s);
  move_clock(robot.reference_time_offset_s, step_s);
}

}  // namespace

std::optional<std::string> set_velocity_lag(std::span<const Recording> recordings, LagOf lag_of,
                                            const char* shown_by, Robot& robot) {
  double& lag_s = robot.chassis.velocity.lag_s;
  std::vector<TimeOffset> told =
      offsets_of(recordings, [&](const Recording& recording) { return lag_of(recording, robot); });
  const std::size_t asked = told.size();
  std::erase_if(told, [&](const TimeOffset& lag) { return !is_told(lag, lag_s); });
  if (2 * told.size() <= asked) return std::nullopt;
  const TimeOffset found = *mean_of(told);
  if (std::abs(found.offset_s - lag_s) <= longest_row_s(recordings)) return std::nullopt;
  const double given_s = std::exchange(lag_s, found.offset_s);
  move_clocks(lag_s - given_s, robot);
  return fmt::format("velocity.lag_s {} s (was {}), from {} in {}", with_sigma(lag_s, found.sigma_s),
                     fixed(given_s, 4), shown_by, counted(told.size(), "recording"));
}

bool fixes_velocity(std::span<const std::string> fixed) {
  return std::ranges::find(fixed, "velocity") != fixed.end();
}

}  // namespace trundle::calibration
