#pragma once

#include "trundle/evaluation/evaluate.hpp"

namespace trundle::evaluation {

/// The error of one pose, and how large its covariance says that it may be. NaN: not measured, or unknown.
struct ErrorAt {
  double time_s = 0.0;
  double way_m = 0.0;  ///< along the reference
  double position_m = 0.0;
  double bound95_m = 0.0;      ///< semi-major axis of the ellipse that holds 95 % of position errors
  double heading_rad = 0.0;    ///< signed, estimate − reference
  double heading95_rad = 0.0;  ///< 95 % of heading errors are smaller
  double nees = 0.0;
};

/// Where along the way the errors that evaluate() sums up arise, with the same options and the same throws.
struct ErrorsAlong {
  std::vector<ErrorAt> at;
  int degrees_of_freedom = 3;  ///< of the NEES
};
ErrorsAlong errors_along(const Trajectory& estimate, const Trajectory& reference,
                         const EvaluateOptions& options = {});

}  // namespace trundle::evaluation
