#pragma once

#include <span>
#include <string>
#include <vector>

#include "trundle/calibration/solve/estimator.hpp"

namespace trundle::calibration {

/// How a robot's parameters differ from session to session: tyre pressure, temperature, floor, load. Each
/// session is calibrated on its own; the scatter of those results is more than one session's own noise
/// suggests.
struct SessionSpread {
  int sessions = 0;    ///< all that were given
  int calibrated = 0;  ///< those that can determine every estimated parameter by themselves
  Eigen::MatrixXd
      covariance;  ///< of a session's parameters about their mean; empty with fewer than two sessions
  /// With four or more sessions: each left out in turn and predicted from the others by
  /// mean ± t √(s_b² (1 + 1/k) + σ_w²), parameter by parameter.
  int trials = 0;
  int hits = 0;

  /// Covariance of a further session's parameters about the mean of these, so wide that 1 σ holds in 68 %: of
  /// few sessions the spread itself is not well known (Student's t).
  [[nodiscard]] Eigen::MatrixXd of_a_further_session() const;
};

[[nodiscard]] SessionSpread session_spread(const CalibrationProblem& problem, const EstimableSpace& space);

/// The same of what each session's own runs gave; none, where there is one session only.
SessionSpread spread_of(std::span<const Estimate> sessions, std::span<const Parameter> parameters,
                        const EstimableSpace& space);

}  // namespace trundle::calibration
