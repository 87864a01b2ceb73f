#include "trundle/slam/smoothing/counted_errors.hpp"

#include <algorithm>

#include "trundle/slam/models/systematic_errors.hpp"
#include "trundle/slam/nth.hpp"
#include "trundle/slam/smoothing/smoother.hpp"

namespace trundle::slam {

Eigen::VectorXd CountedErrors::information() const {
  return sigma(free).cwiseAbs2().cwiseInverse();
}

Eigen::VectorXd CountedErrors::mean() const {
  return -reference(free);
}

CountedErrors counted_errors(const SlamInput& input, const SlamPrior& prior, const Systematic& found) {
  CountedErrors errors{.sigma = prior.systematic_sigma, .has_bias = input.systematic.has_bias};
  if (errors.sigma.size() == 0) errors.sigma = input.systematic.sigma(kUsualShareSigma);
  errors.reference = Systematic::Zero(errors.sigma.size());
  const Eigen::Index known = std::min(found.size(), errors.sigma.size());
  if (found.allFinite()) errors.reference.head(known) = found.head(known);
  errors.free = free_of(errors.sigma, errors.has_bias);
  return errors;
}

TrackInput track_input(const SlamInput& input, const ShownObservations& shown, const SlamPrior& prior,
                       const CountedErrors& errors, std::optional<Eigen::Index> parameters) {
  TrackInput track{.observations = shown, .start = {.pose = prior.start}};
  track.start_covariance = prior.start_covariance;
  if (errors.has_bias) track.start.bias = -errors.bias();
  if (errors.has_bias) track.start.bias_variance = errors.sigma[0] * errors.sigma[0];
  for (const SlamStep& step : input.steps) {
    const Motion motion = about(errors.reference, step.motion);
    const BySystematic by_all = motion.by_first(errors.sigma.size());
    FreeMotion free{motion.mean, motion.covariance,
                    Eigen::Matrix3Xd::Zero(3, parameters.value_or(errors.columns()))};
    free.by_parameters.middleCols(errors.first_column, errors.columns()) = by_all(Eigen::all, errors.free);
    track.time_s.push_back(step.time_s);
    if (errors.has_bias) {
      free.by_bias = by_all.col(0);
      free.walk = motion.walk;
      free.with_walk = motion.with_walk;
      track.bias_readings.push_back(step.bias_reading);
      if (step.bias_reading) track.bias_readings.back()->rad_s -= errors.bias();
    }
    track.motions.push_back(std::move(free));
  }
  return track;
}

void add_systematic(const SmoothingState& state, const Minimiser& linearised, const CountedErrors& errors,
                    int last_pose, PoseEstimate& last) {
  const Eigen::Index n = errors.sigma.size();
  last.systematic = errors.reference;
  last.systematic_covariance = SystematicCovariance::Zero(n, n);
  const Eigen::MatrixXd covariance = linearised.parameter_covariance();
  for (std::size_t i = 0; i < errors.free.size(); ++i) {
    const Eigen::Index row = errors.first_column + static_cast<Eigen::Index>(i);
    last.systematic[errors.free[i]] += state.parameters[row];
    for (std::size_t j = 0; j < errors.free.size(); ++j)
      last.systematic_covariance(errors.free[i], errors.free[j]) =
          covariance(row, errors.first_column + static_cast<Eigen::Index>(j));
  }
  if (!errors.has_bias) return;
  last.systematic[0] += state.bias_at(last_pose);
  last.systematic_covariance(0, 0) = linearised.pose_covariance(last_pose)(3, 3);
  for (std::size_t i = 0; i < errors.free.size(); ++i)
    last.systematic_covariance(0, errors.free[i]) = last.systematic_covariance(errors.free[i], 0) =
        linearised.pose_parameter_covariance(last_pose)(3,
                                                        errors.first_column + static_cast<Eigen::Index>(i));
}

}  // namespace trundle::slam
