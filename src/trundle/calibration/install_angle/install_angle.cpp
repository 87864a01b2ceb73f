#include "trundle/calibration/install_angle/install_angle.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/statistics/distribution.hpp"

namespace trundle::calibration {
namespace {

constexpr double kFurthestScale = 2.0;           // X/S beyond this, or below its inverse, is another run
constexpr double kSuspiciousScale = 0.05;        // off 1
constexpr double kTail = 0.05;                   // of the intervals
constexpr double kLargestPodAngle = 1.0;         // [rad]: beyond it the pods hardly differ
constexpr double kLargestSigma = radians(10.0);  // the angle's prior sigma

void check(const LRun& run) {
  if (!(run.side_m > 0.0) || !std::isfinite(run.side_m))
    throw InputError("L-shaped run", fmt::format("the side is {} m", run.side_m), "a positive length");
  for (const double end : {run.end_x_m, run.end_y_m})
    if (!std::isfinite(end))
      throw InputError("L-shaped run", fmt::format("an end coordinate is {} m", end), "a finite number");
}

void check(const InstallAngleOptions& options) {
  for (const double sigma : {options.sigma_m, options.sigma_heading_rad})
    if (!(sigma >= 0.0) || !std::isfinite(sigma))
      throw InputError("L-shaped run", fmt::format("a sigma is {}", sigma), "a number not below zero");
}

/// docs/theory/dead-wheels.md, eq. 3; with equal legs it is α = 90° − 2 θ₁.
double alpha_of(const LRun& run) {
  const double direction = std::atan2(std::abs(run.end_y_m), std::abs(run.end_x_m));
  const double alpha =
      run.leg_ratio == 1.0
          ? 0.5 * kPi - 2.0 * direction
          : std::asin(std::clamp(run.leg_ratio * std::cos(direction), -1.0, 1.0)) - direction;
  return run.mirrored() ? -alpha : alpha;
}

void refuse_what_is_no_l(const LRun& run) {
  const double scale = std::abs(run.end_x_m) / run.side_m;
  const double alpha = alpha_of(run);
  if (scale < kFurthestScale && scale > 1.0 / kFurthestScale && std::abs(alpha) <= kLargestPodAngle) return;
  throw CannotAnswer(fmt::format(
      "the run ends at ({:.3f}, {:.3f}) m, which no L-shaped run of {:.3f} m does: drive the side along "
      "body x, then as far sideways without turning",
      run.end_x_m, run.end_y_m, run.side_m));
}

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double squares_about_mean(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double v : values) sum += (v - mean(values)) * (v - mean(values));
  return sum;
}

/// Of values that err independently.
double variance_of_mean(const std::vector<double>& variances) {
  const auto n = static_cast<double>(variances.size());
  return std::accumulate(variances.begin(), variances.end(), 0.0) / (n * n);
}

/// By the measuring sigmas: what errs anew in every run, and what all runs have in common.
struct Errors {
  double own_variance = 0.0;
  double common = 0.0;  ///< 1σ, signed
};

/// `by_heading`: the derivative by the start heading; `end_sigma`: 1σ from the end coordinates.
Errors errors_of(double by_heading, double end_sigma, const InstallAngleOptions& options) {
  const double heading = by_heading * options.sigma_heading_rad;
  if (options.start_heading == StartHeading::one_alignment) return {end_sigma * end_sigma, heading};
  return {end_sigma * end_sigma + heading * heading, 0.0};
}

/// docs/theory/dead-wheels.md, eq. 4
Errors angle_errors(const LRun& run, const InstallAngleOptions& options) {
  return errors_of(2.0, 2.0 * options.sigma_m / std::hypot(run.end_x_m, run.end_y_m), options);
}

Errors scale_errors(const LRun& run, const InstallAngleOptions& options) {
  return errors_of(run.end_y_m / run.side_m, options.sigma_m / run.side_m, options);
}

/// Angles of the runs of one sense, and their own variances.
struct Sense {
  std::vector<double> alpha;
  std::vector<double> variance;
};
using Senses = std::array<Sense, 2>;

/// What the runs of one sense scatter by, and whether that is more than measuring explains.
void find_scatter(const Senses& senses, InstallAngle& result) {
  double squares = 0.0, measured = 0.0, runs = 0.0;
  for (const Sense& sense : senses) {
    if (sense.alpha.empty()) continue;
    squares += squares_about_mean(sense.alpha);
    measured += std::accumulate(sense.variance.begin(), sense.variance.end(), 0.0);
    runs += static_cast<double>(sense.alpha.size());
    result.scatter_freedom += static_cast<int>(sense.alpha.size()) - 1;
  }
  result.measuring_rad = std::sqrt(measured / runs);
  if (result.scatter_freedom == 0) return;
  result.scatter_rad = std::sqrt(squares / result.scatter_freedom);
  result.sigma_from_scatter = *result.scatter_rad > result.measuring_rad;
}

/// 1σ of a run's own error by the scatter of so few, such that 1.96 of it is the interval of Student's t.
double sigma_by_scatter(const InstallAngle& result) {
  return *result.scatter_rad * student_t_limit(kTail, result.scatter_freedom) / normal_limit(kTail);
}

/// docs/theory/dead-wheels.md, eq. 4
void average(Senses& senses, double common_sigma, InstallAngle& result) {
  find_scatter(senses, result);
  if (result.sigma_from_scatter)
    for (Sense& sense : senses) std::ranges::fill(sense.variance, std::pow(sigma_by_scatter(result), 2));
  std::vector<double> means, variances;
  for (const Sense& sense : senses) {
    if (sense.alpha.empty()) continue;
    means.push_back(mean(sense.alpha));
    variances.push_back(variance_of_mean(sense.variance));
  }
  result.alpha_rad = mean(means);
  result.theta_rad = 0.5 * kPi - result.alpha_rad;
  result.sigma_rad = std::hypot(std::sqrt(variance_of_mean(variances)), common_sigma);
  if (means.size() == 2) result.between_senses_rad = 0.5 * (means[1] - means[0]);
  result.between_senses_sigma_rad = std::sqrt(variance_of_mean(variances));
}

void add_warnings(InstallAngle& result) {
  if (std::abs(result.scale - 1.0) > kSuspiciousScale)
    result.warnings.push_back(
        fmt::format("pod 2 rolls {:.3f} m for each metre it reads: its diameter in the robot file is wrong",
                    result.scale));
  if (result.scatter_rad && *result.scatter_rad > 3.0 * result.measuring_rad)
    result.warnings.push_back(
        fmt::format("repeated runs scatter by {:.2f}°, measuring explains {:.2f}°: set the start "
                    "heading with more care",
                    degrees(*result.scatter_rad), degrees(result.measuring_rad)));
  if (result.between_senses_rad &&
      std::abs(*result.between_senses_rad) > 3.0 * result.between_senses_sigma_rad)
    result.warnings.push_back(fmt::format(
        "runs to the two sides differ by {:.2f}°: pod 1 rolls {:+.1f} % further than pod 2 for what it "
        "reads; that cancels in the angle, not in the robot file",
        2.0 * degrees(std::abs(*result.between_senses_rad)), 100.0 * *result.between_senses_rad));
  if (!result.between_senses_rad)
    result.warnings.emplace_back(
        "all runs go to one side: 1 % between what the pods roll for a metre that they read looks like "
        "0.57°; with a "
        "run to the other side it cancels");
}

}  // namespace

InstallAngle install_angle(std::span<const LRun> runs, const InstallAngleOptions& options) {
  if (runs.empty()) throw InputError("L-shaped run", "there is none", "one run or more");
  check(options);
  InstallAngle result;
  Senses senses;
  std::vector<double> angle_common, scales, scale_variances, scale_common;
  for (const LRun& run : runs) {
    check(run);
    refuse_what_is_no_l(run);
    const Errors angle = angle_errors(run, options);
    const Errors scale = scale_errors(run, options);
    Sense& sense = senses[run.mirrored() ? 1 : 0];
    sense.alpha.push_back(alpha_of(run));
    sense.variance.push_back(angle.own_variance);
    angle_common.push_back(angle.common);
    result.run_alpha_rad.push_back(sense.alpha.back());
    scales.push_back(std::abs(run.end_x_m) / run.side_m);
    scale_variances.push_back(scale.own_variance);
    scale_common.push_back(scale.common);
  }
  average(senses, mean(angle_common), result);
  result.scale = mean(scales);
  result.scale_sigma = std::hypot(std::sqrt(variance_of_mean(scale_variances)), mean(scale_common));
  if (result.sigma_rad > kLargestSigma)
    throw CannotAnswer(
        fmt::format("the angle is known only to ± {:.0f}°: drive a longer side, or measure better",
                    degrees(result.sigma_rad)));
  add_warnings(result);
  return result;
}

}  // namespace trundle::calibration
