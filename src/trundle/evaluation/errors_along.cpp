#include "trundle/evaluation/errors_along.hpp"

#include <cmath>
#include <limits>

#include "trundle/evaluation/align.hpp"
#include "trundle/evaluation/pair_errors.hpp"
#include "trundle/io/error.hpp"
#include "trundle/statistics/distribution.hpp"

namespace trundle::evaluation {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// √(5.99 λ), λ the larger eigenvalue of the positions' covariance.
double bound95(const Matrix3& covariance) {
  const double mean = 0.5 * (covariance(0, 0) + covariance(1, 1));
  const double half = 0.5 * (covariance(0, 0) - covariance(1, 1));
  return std::sqrt(kChiSquared2At95 * (mean + std::hypot(half, covariance(0, 1))));
}

ErrorAt error_at(const PosePair& pair, double way_m, int dof) {
  ErrorAt error{.time_s = pair.time_s,
                .way_m = way_m,
                .position_m = position_error(pair),
                .bound95_m = kUnknown,
                .heading_rad = has_heading(pair) ? heading_error(pair) : kUnknown,
                .heading95_rad = kUnknown,
                .nees = kUnknown};
  if (!pair.covariance) return error;
  error.bound95_m = bound95(*pair.covariance);
  error.heading95_rad = kNormalAt95 * std::sqrt((*pair.covariance)(2, 2));
  error.nees = normalised_error(pair, dof).value_or(kUnknown);
  return error;
}

}  // namespace

ErrorsAlong errors_along(const Trajectory& estimate, const Trajectory& reference,
                         const EvaluateOptions& options) {
  const std::vector<PosePair> raw = common_poses(estimate, reference, options.longest_gap_s);
  demand_overlap(raw, estimate, reference, options.longest_gap_s);
  const std::vector<PosePair> pairs = judged(raw, alignment_of(raw, options.alignment), options);
  const std::size_t judged_from = options.alignment == Alignment::start ? first_moved(pairs, options) : 0;
  const std::vector<double> way = way_along(pairs, options.shortest_step_m);
  ErrorsAlong errors{{}, degrees_of_freedom(pairs)};
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    errors.at.push_back(error_at(pairs[i], way[i], errors.degrees_of_freedom));
    if (i < judged_from) errors.at.back().nees = kUnknown;
  }
  return errors;
}

}  // namespace trundle::evaluation
