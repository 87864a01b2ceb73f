#pragma once

#include <optional>
#include <span>
#include <string>

#include "trundle/calibration/problem/run.hpp"
#include "trundle/chassis/parameter.hpp"

namespace trundle::calibration {

/// 1σ by which the clock of a reference may be elsewhere than the motion as a whole shows.
inline constexpr double kClockPrior_s = 0.5;

/// Whether the clock of the run's reference is a parameter of that run (run_parameters.hpp): the motion as a
/// whole shows it off, by more than stamps say, and where to start (Gauss–Newton alone finds the nearest of
/// several minima). Elsewhere it is known better than it could be estimated. Nor is it where it is sought for
/// all runs at once.
[[nodiscard]] bool has_own_clock(const Run& run, std::span<const Parameter> parameters);

/// Where the clock fits best, from where it is.
struct ClockStep {
  double step_s = 0.0;
  double sigma_s = kClockPrior_s;
};

/// Moves the stamps of the run's reference. Epochs that it then no longer reaches are left out.
void move_clock(const ClockStep& step, const Robot& robot, Run& run);

/// Keeps the epochs that the reference shows wherever within one sigma its clock is: where one offset of all
/// references is a parameter, a run must not lose its beginning on the way.
void let_clocks_move(const Robot& robot, std::span<Run> runs);

/// The time offset of the run's reference that its stamps were moved to; nothing: they were not.
[[nodiscard]] std::optional<TimeOffset> clock_of(const Run& run);

/// Which offsets were found other than they were given, in words, behind those of the offset that runs share;
/// nothing: none.
[[nodiscard]] std::optional<std::string> words_of_clocks(std::span<const Run> runs,
                                                         const std::optional<std::string>& shared = {});

}  // namespace trundle::calibration
