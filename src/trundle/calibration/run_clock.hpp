#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "trundle/calibration/information.hpp"
#include "trundle/calibration/run.hpp"
#include "trundle/chassis/parameter.hpp"

namespace trundle::calibration {

/// 1σ by which the clock of a reference may be elsewhere than the motion as a whole shows.
inline constexpr double kClockPrior_s = 0.5;

/// Whether the clock of the run's reference is a parameter of that run: the motion as a whole shows it off,
/// by more than stamps say, and where to start (Gauss–Newton alone finds the nearest of several minima).
/// Elsewhere it is known better than it could be estimated. Nor is it where it is sought for all runs at
/// once.
[[nodiscard]] bool has_own_clock(const Run& run, std::span<const Parameter> parameters);

/// The parameters, and the clock of a run's reference behind them.
[[nodiscard]] std::vector<Parameter> with_clock(std::span<const Parameter> parameters);

/// What a run says, the last of whose parameters is the clock of its reference, with that one eliminated: the
/// clock follows the others to where it fits best. The sum is the Schur complement of the sum.
/// `moved_s`: by which the prior is behind. docs/theory/calibration.md, eq. 6b.
[[nodiscard]] std::vector<Information> without_clock(const std::vector<Information>& blocks, double moved_s);

/// Where the clock fits best with the other parameters as they are [s], from where it is.
struct ClockStep {
  double step_s = 0.0;
  double sigma_s = kClockPrior_s;
};
[[nodiscard]] ClockStep clock_step(const Information& with_clock, double moved_s);

/// Moves the stamps of the run's reference. Epochs that it then no longer reaches are left out.
void move_clock(const ClockStep& step, const Robot& robot, Run& run);

/// The time offset of the run's reference that its stamps were moved to; nothing: they were not.
[[nodiscard]] std::optional<TimeOffset> clock_of(const Run& run);

/// Which offsets were found other than they were given, in words, behind those of the offset that runs share;
/// nothing: none.
[[nodiscard]] std::optional<std::string> words_of_clocks(std::span<const Run> runs,
                                                         const std::optional<std::string>& shared = {});

}  // namespace trundle::calibration
