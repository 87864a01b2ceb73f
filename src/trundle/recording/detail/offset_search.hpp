#pragma once

#include <functional>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "trundle/recording/time_offset.hpp"

namespace trundle::recording {

/// Two sensors of one motion, window by window, each in as many quantities ('channels': its turn, its way).
/// The windows are those of one of them, which is not interpolated.
struct TwoClocks {
  /// What the other one says of the windows when the clocks are so far apart: an entry for each channel and
  /// window. Windows that it misses are not used any more.
  using Other = std::function<std::vector<Eigen::VectorXd>(double offset_s, std::vector<bool>& used)>;

  std::vector<Eigen::VectorXd> fixed;  ///< an entry for each channel
  Eigen::VectorXd duration_s;          ///< of each window
  std::vector<bool> used;
  Other moved;
};

struct OffsetSearch {
  double given_s = 0.0;        ///< where it starts
  double largest_s = 0.0;      ///< searched on both sides of it
  double step_s = 0.0;         ///< fine enough to see the minimum
  double change_s = 0.0;       ///< by which the offset is moved to see what changes: a step of either sensor
  double least_sigma_s = 0.0;  ///< between samples rates are taken as constant: a change is known that well
  double largest_sigma_s = 0.0;
  double least_correlation = 0.0;  ///< in the channel in which the sensors agree best
};

struct ClockComparison {
  TwoClocks clocks;
  OffsetSearch search;
};

/// The offset at which fixed = a · moved + b · duration + residual leaves least, in all channels together,
/// each with its own a, b and noise; windows with a residual that no noise explains (slip) are left out. σ
/// has the scatter of the residuals, which may hang together over some windows [Newey & West 1987]. Nothing
/// where hardly a window is left, the sensors do not speak of the same motion, or σ is too large.
[[nodiscard]] std::optional<TimeOffset> find_offset(ClockComparison comparison);

/// The same two clocks, where motion lags behind a velocity by so much.
using LaggingClocks = std::function<std::optional<ClockComparison>(double lag_s)>;

/// The lag with which, the clocks being set anew, least is left: as `offset_s`, and σ as of offsets. Nothing
/// where the sensors do not speak of the same motion, or the lag is as long as no robot's.
[[nodiscard]] std::optional<TimeOffset> find_lag(const LaggingClocks& with_lag, double given_s);

}  // namespace trundle::recording
