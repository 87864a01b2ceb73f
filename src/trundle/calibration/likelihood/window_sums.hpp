#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "trundle/calibration/problem/run.hpp"
#include "trundle/recording/alignment/increments.hpp"

namespace trundle::calibration {

/// Over which the likelihood sums what no motion explains of readings.
inline constexpr double kParityWindow_s = 1.0;

/// Readings summed over windows of time and over parts of each: all of a run that chassis_likelihood() looks
/// at where no wheel is steered. The robot's parameters are not in them, so one pass over the readings serves
/// all values of the parameters. A window ends before a gap, and is left out if it is less than half as long
/// as wanted.
struct WindowSums {
  Increments windows;
  Increments parts;                    ///< of all windows, one after another
  std::vector<std::size_t> parts_end;  ///< of each window: the number of parts up to its last one
  std::vector<std::size_t> first;      ///< of each window: the index of the run's increment that begins it
  std::vector<std::size_t> last;       ///< and of the one that ends it
  std::size_t increments = 0;          ///< of the run
};

/// Whether a window of so many seconds is as long as wanted, and whether one that ends before is kept.
[[nodiscard]] bool is_full(double duration_s, double window_s);
[[nodiscard]] bool is_kept(double duration_s, double window_s);

/// Whether no reading of an increment is missing or bridged: windows are made of such.
[[nodiscard]] bool is_whole(const Run& run, std::size_t increment, const Chassis& chassis);

/// Nothing where wheels are steered, or where motion explains whatever is read.
[[nodiscard]] std::optional<WindowSums> window_sums(const Run& run, const Chassis& chassis, double window_s);

}  // namespace trundle::calibration
