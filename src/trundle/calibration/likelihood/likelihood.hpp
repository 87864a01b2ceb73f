#pragma once

#include <limits>
#include <optional>
#include <vector>

#include "trundle/calibration/likelihood/information.hpp"
#include "trundle/calibration/likelihood/relative_table.hpp"
#include "trundle/calibration/likelihood/run_likelihood.hpp"
#include "trundle/calibration/likelihood/run_parameters.hpp"
#include "trundle/calibration/likelihood/window_sums.hpp"
#include "trundle/calibration/problem/noise_levels.hpp"
#include "trundle/calibration/problem/problem.hpp"
#include "trundle/calibration/problem/run_clock.hpp"

namespace trundle::calibration {

/// The likelihood of a problem's runs: the sum of what reference streams (run_likelihood.hpp), measurements
/// of whole runs, relative motions and redundant readings say. What weighs its residuals is fixed while
/// parameters are sought, and found in turn with them (weights.hpp). docs/theory/calibration.md.
struct Likelihood {
  CalibrationProblem problem;
  NoiseEstimate noise;
  /// Of the variance of the wheels' noise, and of the gyro's beyond its own, what readings contradict each
  /// other by: by the rest all wheels err alike, or the reference does.
  double contradicting_share = 1.0;
  /// By which what no motion explains scatters more than all of that makes it, as a variance: at least 1.
  double redundancy_factor = 1.0;
  std::vector<Matrix3> relative_covariance;  ///< of the residuals of each run's relative motions
  std::vector<double> run_weight;
  double gate = std::numeric_limits<double>::infinity();  ///< residuals of a larger squared Mahalanobis
                                                          ///< distance are left out
  /// What noise in sensitivities makes of information is taken out: it is where nobody knows yet what the
  /// runs show. In what they do show it is little, and costs a search half its time more.
  bool takes_out_noise = false;
  /// What the readings contradict each other by is part of it.
  bool uses_redundancy = true;
  /// The noise is that of the runs. Until it is, which would pass for it, the clock of a run's reference is
  /// not sought.
  bool knows_noise = false;
  /// 1σ of the gyro's bias of each run about the one that all share [rad/s]; 0: there is only that.
  double gyro_bias_spread_rad_s = 0.0;
  /// Each run's relative motions as one table, where that holds the whole problem.
  std::vector<std::optional<RelativeTable>> relative_table;
  /// Each run's redundant readings, summed for chassis_likelihood(); empty if the gyro's time offset is free.
  std::vector<std::optional<WindowSums>> window_sums;
  /// The runs with the gyro's stamps where the estimate has them; empty unless its time offset is free.
  std::vector<Run> clocked;

  std::span<const Run> runs() const { return clocked.empty() ? problem.runs : std::span(clocked); }
  /// Nothing where they are not known beforehand.
  const WindowSums* sums_of(std::size_t run) const;
  bool seeks_clock(const Run& run) const { return knows_noise && has_own_clock(run, problem.parameters); }
  /// Whether the walk of the gyro's bias is estimated where it shows: the bias is, and a reference follows
  /// it.
  bool seeks_walk(const Run& run) const;
  /// Whether the heading at the run's start is: the reference shows positions alone, which bend the filter's
  /// path as they turn a heading that is hardly known.
  bool seeks_start_heading(const Run& run) const;
  /// What is estimated of a run alone: the gyro's bias before the reference's clock, the bias's walk, and the
  /// heading at its start.
  std::vector<OwnParameter> own_of(const Run& run) const;
  /// Parts into which each run is cut, so that all together are enough to see how they scatter.
  int blocks_of_a_run() const;
};

/// With the noise of the robot file, and all runs trusted alike.
[[nodiscard]] Likelihood likelihood_of(const CalibrationProblem& problem);

/// Moves the gyro's stamps to where the robot has them, if its time offset is free, and what is each run's
/// own to where it fits best.
void set_own_parameters(const Robot& robot, Likelihood& likelihood);

/// The robot with the noise that the likelihood weighs its readings by.
[[nodiscard]] Robot noisy_robot(const Robot& robot, const Likelihood& likelihood);

/// With such a share of it: what its readings contradict each other by.
[[nodiscard]] Robot contradicting_robot(const Robot& robot, const Likelihood& likelihood, double share);

/// What one run says about the parameters.
struct RunInformation {
  std::vector<Information> blocks;  ///< independent of each other
  std::vector<OutlyingEpoch> outliers;

  Information total(Eigen::Index parameters) const;
};
/// With the run's own parameters behind those that all share.
[[nodiscard]] RunInformation information_with_own(const Likelihood& likelihood, std::size_t run,
                                                  const Robot& robot);
/// Of the shared parameters alone.
[[nodiscard]] RunInformation run_information(const Likelihood& likelihood, std::size_t run,
                                             const Robot& robot);

/// What the readings of one run contradict each other by says of them, and of the run's own behind them.
[[nodiscard]] Information redundancy_information(const Likelihood& likelihood, std::size_t run,
                                                 const Robot& robot);

/// What all runs say, each with its weight.
[[nodiscard]] Information total_information(const Likelihood& likelihood, const Robot& robot);

}  // namespace trundle::calibration
