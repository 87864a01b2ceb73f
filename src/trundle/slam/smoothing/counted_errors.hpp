#pragma once

#include <vector>

#include "trundle/slam/smoothing/shown.hpp"
#include "trundle/slam/smoothing/solver/minimise.hpp"
#include "trundle/slam/smoothing/track.hpp"

namespace trundle::slam {

/// The systematic errors of a recording's odometry as a smoothing problem counts them: from `reference`, so
/// that long motions are those of about the right ones; those that are not known exactly are parameters of
/// the problem, from `first_column` on.
struct CountedErrors {
  Systematic sigma = {};
  Systematic reference = {};
  bool has_bias = false;  ///< the first of them is the gyro's bias, which walks: no parameter
  std::vector<int> free = {};
  Eigen::Index first_column = 0;

  [[nodiscard]] double bias() const { return has_bias ? reference[0] : 0.0; }
  [[nodiscard]] Eigen::Index columns() const { return static_cast<Eigen::Index>(free.size()); }
  /// What is known of the parameters beforehand: SmoothingProblem::parameter_information, parameter_mean.
  [[nodiscard]] Eigen::VectorXd information() const;
  [[nodiscard]] Eigen::VectorXd mean() const;
};

/// About `found`, what a filter took them for. Without sigmas in the prior: those of the input, shares with
/// kUsualShareSigma.
[[nodiscard]] CountedErrors counted_errors(const SlamInput& input, const SlamPrior& prior,
                                           const Systematic& found);

/// A recording, of a problem with so many parameters; nothing: its own alone.
[[nodiscard]] TrackInput track_input(const SlamInput& input, const ShownObservations& shown,
                                     const SlamPrior& prior, const CountedErrors& errors,
                                     std::optional<Eigen::Index> parameters = {});

/// The systematic errors at its last pose, into the estimate there.
void add_systematic(const SmoothingState& state, const Minimiser& linearised, const CountedErrors& errors,
                    int last_pose, PoseEstimate& last);

}  // namespace trundle::slam
