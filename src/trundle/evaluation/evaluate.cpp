#include "trundle/evaluation/evaluate.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include <fmt/format.h>

#include "trundle/evaluation/align.hpp"
#include "trundle/evaluation/pair_errors.hpp"
#include "trundle/geometry/squared.hpp"
#include "trundle/io/error.hpp"
#include "trundle/io/interruption.hpp"
#include "trundle/statistics/distribution.hpp"

namespace trundle::evaluation {
namespace {

double median_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  if (values.size() % 2 == 1) return *middle;
  return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

ErrorStatistics statistics_of(const std::vector<double>& errors) {
  ErrorStatistics statistics;
  const auto n = static_cast<double>(errors.size());
  for (const double error : errors) {
    statistics.rms += squared(error) / n;
    statistics.mean += error / n;
    statistics.max = std::max(statistics.max, error);
  }
  statistics.rms = std::sqrt(statistics.rms);
  statistics.median = median_of(errors);
  return statistics;
}

std::optional<double> heading_rms(const std::vector<PosePair>& pairs) {
  double sum = 0.0;
  std::size_t count = 0;
  for (const PosePair& pair : pairs) {
    if (!has_heading(pair)) continue;
    sum += squared(heading_error(pair));
    ++count;
  }
  if (count == 0) return std::nullopt;
  return std::sqrt(sum / static_cast<double>(count));
}

/// The error of the estimated motion from one pair to another, in the frame of the end.
Pose2 motion_error(const PosePair& from, const PosePair& to) {
  const Pose2 truth = from.reference.inverse() * to.reference;
  return truth.inverse() * (from.estimate.inverse() * to.estimate);
}

RelativePoseError relative_error(const std::vector<PosePair>& pairs, const std::vector<double>& way,
                                 double distance_m) {
  RelativePoseError result{.distance_m = distance_m};
  double translation2 = 0.0;
  double heading2 = 0.0;
  double percent = 0.0;
  std::size_t j = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    check_interruption();
    while (j < pairs.size() && way[j] - way[i] < distance_m) ++j;
    if (j == pairs.size()) break;
    const Pose2 error = motion_error(pairs[i], pairs[j]);
    translation2 += error.translation().squaredNorm();
    heading2 += squared(wrap_angle(error.heading));
    percent += 100.0 * error.translation().norm() / (way[j] - way[i]);
    ++result.pairs;
  }
  if (result.pairs == 0) return result;
  const auto n = static_cast<double>(result.pairs);
  result.translation_rms_m = std::sqrt(translation2 / n);
  result.heading_rms_rad = std::sqrt(heading2 / n);
  result.translation_mean_percent = percent / n;
  return result;
}

std::vector<RelativePoseError> relative_errors(std::vector<PosePair> pairs, const EvaluateOptions& options) {
  std::erase_if(pairs, [](const PosePair& pair) { return !has_heading(pair); });
  if (pairs.empty()) return {};
  const std::vector<double> way = way_along(pairs, options.shortest_step_m);
  std::vector<RelativePoseError> errors;
  for (const double distance : options.distances_m) errors.push_back(relative_error(pairs, way, distance));
  return errors;
}

std::optional<Nees> nees_of(const std::vector<PosePair>& pairs, const EvaluateOptions& options) {
  if (!pairs.front().covariance) return std::nullopt;
  Nees nees;
  if (options.alignment == Alignment::start) nees.before_motion = first_moved(pairs, options);
  nees.degrees_of_freedom = degrees_of_freedom(pairs);
  nees.bound_95 = nees.degrees_of_freedom == 3 ? kChiSquared3At95 : kChiSquared2At95;
  for (const PosePair& pair : std::span(pairs).subspan(nees.before_motion)) {
    check_interruption();
    const auto error = normalised_error(pair, nees.degrees_of_freedom);
    if (!error) {
      ++nees.without_covariance;
      continue;
    }
    ++nees.poses;
    nees.mean += *error;
    nees.share_inside_95 += *error <= nees.bound_95 ? 1.0 : 0.0;
  }
  if (nees.poses == 0) return std::nullopt;
  nees.mean /= static_cast<double>(nees.poses);
  nees.share_inside_95 /= static_cast<double>(nees.poses);
  return nees;
}

void describe_end(const std::vector<PosePair>& pairs, Evaluation& result) {
  const PosePair& last = pairs.back();
  result.first_s = pairs.front().time_s;
  result.last_s = last.time_s;
  result.final_position_m = position_error(last);
  if (result.path_m > 0.0) result.final_percent = 100.0 * result.final_position_m / result.path_m;
  if (has_heading(last)) result.final_heading_rad = heading_error(last);
}

}  // namespace

Evaluation evaluate(const Trajectory& estimate, const Trajectory& reference, const EvaluateOptions& options) {
  const auto raw = common_poses(estimate, reference, options.longest_gap_s);
  demand_overlap(raw, estimate, reference, options.longest_gap_s);
  Evaluation result;
  result.alignment = options.alignment;
  result.reference_from_estimate = alignment_of(raw, options.alignment);
  const auto pairs = judged(raw, result.reference_from_estimate, options);
  result.reference_noise = options.reference_noise;
  result.estimate_poses = estimate.poses.size();
  result.reference_poses = reference.poses.size();
  result.compared = pairs.size();
  std::vector<double> errors;
  errors.reserve(pairs.size());
  for (const PosePair& pair : pairs) errors.push_back(position_error(pair));
  result.position_m = statistics_of(errors);
  result.heading_rms_rad = heading_rms(pairs);
  result.path_m = way_along(pairs, options.shortest_step_m).back();
  describe_end(pairs, result);
  result.relative = relative_errors(pairs, options);
  result.nees = nees_of(pairs, options);
  return result;
}

}  // namespace trundle::evaluation
