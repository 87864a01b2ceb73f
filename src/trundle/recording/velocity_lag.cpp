#include "trundle/recording/velocity_lag.hpp"

#include <cmath>
#include <functional>
#include <span>
#include <vector>

#include "trundle/recording/alignment/align.hpp"
#include "trundle/recording/detail/clock_comparison.hpp"
#include "trundle/recording/detail/comparer.hpp"
#include "trundle/statistics/minimum.hpp"

namespace trundle::recording {
namespace {

// No robot lags by as much [s].
constexpr double kLongestLag_s = 1.0;
constexpr double kFinestLag_s = 1e-3;

/// Two clocks at one lag, set as well as can be.
struct SetClocks {
  Comparer compare;
  double offset_s;

  Comparison in(const std::vector<bool>& windows) {
    compare.use(windows);
    return compare.at(offset_s);
  }
};

/// Two clocks, where motion lags behind a velocity by so much.
using LaggingClocks = std::function<std::optional<ClockComparison>(double lag_s)>;

/// The lag with which, the clocks being set anew, least is left: as `offset_s`, and σ as of offsets. Nothing
/// where the sensors do not speak of the same motion, or the lag is as long as no robot's.
std::optional<TimeOffset> find_lag(const LaggingClocks& with_lag, double given_s) {
  if (given_s >= kLongestLag_s) return std::nullopt;
  std::optional<ClockComparison> given = with_lag(given_s);
  if (!given) return std::nullopt;
  const OffsetSearch search = given->search;
  Comparer as_given(std::move(given->clocks));
  const std::vector<bool> all = as_given.windows();
  const std::optional<double> offset_s = settled_offset(as_given, search);
  if (!offset_s || !speak_of_one_motion(as_given.at(*offset_s), search)) return std::nullopt;

  std::vector<bool> windows = as_given.windows();
  const auto set_with = [&](double lag_s) {  // of a lag most is a delay: the clocks make up for that
    Comparer compare(with_lag(lag_s).value().clocks);
    compare.use(windows);
    const double set_s =
        search_from(compare, *offset_s + lag_s - given_s, 4.0 * search.step_s, search.step_s);
    windows = compare.windows();  // those that all lags reach
    return SetClocks{std::move(compare), set_s};
  };
  const auto least = [&] {
    return minimum_within({0.0, kLongestLag_s, kFinestLag_s},
                          [&](double lag_s) { return set_with(lag_s).in(windows).misfit(); });
  };
  const double rough_s = least();
  windows = all;  // where the lag was wrong its starts and stops passed for slip
  SetClocks rough = set_with(rough_s);
  rough.compare.leave_out_slip(rough.offset_s);
  windows = rough.compare.windows();
  const double lag_s = least(), step_s = 0.5 * lag_s;
  if (lag_s > 0.95 * kLongestLag_s) return std::nullopt;
  SetClocks before = set_with(lag_s - step_s), here = set_with(lag_s), after = set_with(lag_s + step_s);
  if (!after.compare.has_enough()) return std::nullopt;  // it has those that all have
  const Comparison best = here.in(windows);
  const double sigma =
      std::hypot(sigma_of({before.in(windows), best, after.in(windows), step_s}), search.least_sigma_s);
  if (!std::isfinite(sigma)) return std::nullopt;
  return TimeOffset{lag_s, sigma, best.correlation()};
}

/// Whether a velocity was commanded, not measured: then most rows in motion are those before them. The noise
/// of a measured one is less behind a lag, which would fit better for that alone.
bool is_commanded(const VelocityStream& velocity) {
  const std::vector<double>&forward = velocity.forward_m_s, &turn = velocity.yaw_rate_rad_s;
  std::size_t moving = 0, held = 0;
  for (std::size_t i = 1; i < forward.size(); ++i) {
    if (forward[i] == 0.0 && turn[i] == 0.0) continue;
    ++moving;
    held += forward[i] == forward[i - 1] && turn[i] == turn[i - 1] ? 1 : 0;
  }
  return 2 * held > moving;
}

using Compare = std::function<std::optional<ClockComparison>(const AlignedReadings&, const Robot&)>;

std::optional<TimeOffset> lag_by(const Recording& recording, const Robot& robot, const Compare& compare) {
  if (robot.chassis.wheel_count > 0 || !is_commanded(recording.velocity)) return std::nullopt;
  const LaggingClocks with_lag = [&](double lag_s) {
    Robot lagging = robot;
    lagging.chassis.velocity.lag_s = lag_s;
    return compare(align(recording, lagging), lagging);
  };
  return find_lag(with_lag, robot.chassis.velocity.lag_s);
}

}  // namespace

std::optional<TimeOffset> velocity_lag_by_reference(const Recording& recording, const Robot& robot) {
  return lag_by(recording, robot, [&](const AlignedReadings& readings, const Robot& lagging) {
    const ReferenceLog log{recording.reference, readings};
    return reference_clocks(std::span(&log, 1), lagging, kReferenceClock);
  });
}

std::optional<TimeOffset> velocity_lag_by_sightings(const Recording& recording, const Robot& robot) {
  return lag_by(recording, robot, [&](const AlignedReadings& readings, const Robot& lagging) {
    return sighting_clocks(recording.sightings, readings, lagging, kSightingClock);
  });
}

}  // namespace trundle::recording
