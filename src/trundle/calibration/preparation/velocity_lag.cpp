#include "trundle/calibration/preparation/velocity_lag.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "trundle/io/words.hpp"

namespace trundle::calibration {

std::optional<std::string> set_velocity_lag(std::span<const Recording> recordings, LagOf lag_of,
                                            const char* shown_by, Robot& robot) {
  std::vector<TimeOffset> lags;
  for (const Recording& recording : recordings)
    if (const auto lag = lag_of(recording, robot)) lags.push_back(*lag);
  const auto mean = mean_of(lags);
  double& lag_s = robot.chassis.velocity.lag_s;
  if (!mean || !is_off(*mean, lag_s)) return std::nullopt;
  const double given_s = std::exchange(lag_s, mean->offset_s);
  return fmt::format("velocity.lag_s {} s (was {}), from {} in {}", with_sigma(lag_s, mean->sigma_s),
                     fixed(given_s, 4), shown_by, counted(lags.size(), "recording"));
}

bool fixes_velocity(std::span<const std::string> fixed) {
  return std::ranges::find(fixed, "velocity") != fixed.end();
}

}  // namespace trundle::calibration
