#include "trundle/slam/consistency_checks.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <numbers>
#include <optional>

#include "trundle/geometry/decompositions.hpp"
#include "trundle/statistics/median.hpp"

namespace trundle::slam {
namespace {

// So many more rejected sightings than matched ones in a stretch. With a share p of outliers a stretch
// reaches k with probability (p/(1 − p))^k: with a third, once in a million; with a tenth, never.
constexpr int kLost = 20;
// Share of sightings whose cost is bounded. With more, the cost says nothing of the noise of the others.
constexpr double kMostOutliers = 0.05;
// Beyond so many σ a cost per degree of freedom is no chance in any number of runs: 1e-9.
constexpr double kSigmasOfChance = 6.0;
// Of a cost and its degrees of freedom, of a NIS and what it is if consistent: every ± is too small by
// √1.5 = 1.2. Less is within what sigmas are known to.
constexpr double kGreatestRatio = 1.5;
// Median of χ² with two degrees of freedom; that of N numbers scatters by 2/√N, as their density there is ¼.
constexpr double kMedianOfTwo = 2.0 * std::numbers::ln2;

// Beyond so many sigmas of one reading a common error matters: less is within the sigmas.
constexpr double kLeastOffset = 0.5;
// The median of so many squares is known to 30 %.
constexpr std::size_t kFewestSteps = 20;
// Median of χ² with three degrees of freedom, and how many times of it the smoothed trajectory may be off the
// online one, squared: both are wrong by no more than twice their sigmas then.
constexpr double kMedianOfThree = 2.366;
constexpr double kGreatestContradiction = 4.0;  // twice, squared

Finding warning(FindingCode code, std::size_t count, const Payload& payload) {
  return {Severity::warning, code, "sightings", count, {}, payload};
}

/// A stretch of sightings, and how many of them do not fit.
struct Stretch {
  std::size_t first = 0, last = 0;  ///< steps
  int excess = 0;                   ///< of those that do not fit over those that do
  std::size_t unfit = 0, seen = 0;
};

/// The stretch in which sightings that do not fit outnumber those that do by most.
class WorstStretch {
 public:
  void add(std::size_t step, const ObservationReport& observation) {
    const bool is_rejected = observation.decision == Decision::rejected;
    if (!is_rejected && observation.decision != Decision::matched) return;
    // Of particles the NIS is that of the most probable one, and most of them decide.
    const bool is_unfit = is_rejected || observation.nis > kDefaultGate;
    if (here_.excess <= 0) here_ = {.first = step};
    here_.last = step;
    here_.excess += is_unfit ? 1 : -1;
    here_.unfit += is_unfit ? 1 : 0;
    ++here_.seen;
    if (here_.excess > worst_.excess) worst_ = here_;
  }
  [[nodiscard]] bool is_lost() const { return worst_.excess >= kLost; }

  [[nodiscard]] Finding finding(FindingCode code, const SlamInput& input) const {
    return warning(code, worst_.unfit,
                   payload::Stretch{.start_s = input.steps[worst_.first].time_s - input.start_s,
                                    .end_s = input.steps[worst_.last].time_s - input.start_s,
                                    .all = worst_.seen});
  }

 private:
  Stretch worst_, here_;
};

void check_filter(const SlamInput& input, const SlamResult& filtered, std::vector<Finding>& findings) {
  WorstStretch of_all;
  std::map<LandmarkId, WorstStretch> by_landmark;  // those with names
  for (std::size_t k = 0; k < filtered.reports.size(); ++k)
    for (std::size_t i = 0; i < filtered.reports[k].observations.size(); ++i) {
      of_all.add(k, filtered.reports[k].observations[i]);
      if (const LandmarkId name = input.steps[k].observations[i].landmark; name != kUnknownLandmark)
        by_landmark[name].add(k, filtered.reports[k].observations[i]);
    }
  if (of_all.is_lost()) return findings.push_back(of_all.finding(FindingCode::lost, input));
  for (const auto& [landmark, stretch] : by_landmark) {
    if (!stretch.is_lost()) continue;
    findings.push_back(stretch.finding(FindingCode::misplaced_landmark, input));
    const auto number = static_cast<std::size_t>(landmark);
    findings.back().subjects = {number < input.landmarks.size() ? input.landmarks[number]
                                                                : std::to_string(number)};
  }
}

bool is_lost(const std::vector<Finding>& findings) {
  return !findings.empty() && findings.front().code == FindingCode::lost;
}

/// Squared differences of the two trajectories in the sum of their covariances. That of a difference between
/// an estimate and one from more data is less, the first's less the second's [Hausman 1978]: so it is no
/// chance when they differ by more than this.
std::optional<double> median_contradiction(const Trajectory& online, const Trajectory& smoothed) {
  std::vector<double> squared;
  for (std::size_t k = 0; k < smoothed.poses.size() && k < online.covariances.size(); ++k) {
    const Vector3 off(smoothed.poses[k].pose.x - online.poses[k].pose.x,
                      smoothed.poses[k].pose.y - online.poses[k].pose.y,
                      wrap_angle(smoothed.poses[k].pose.heading - online.poses[k].pose.heading));
    if (const auto misfit = gaussian_misfit(off, online.covariances[k] + smoothed.covariances[k]))
      squared.push_back(misfit->squared_mahalanobis);
  }
  if (squared.size() < kFewestSteps) return std::nullopt;
  return median(std::move(squared));
}

void check_offset(FindingCode code, const SensorScore& score, double dispersion, double unit,
                  std::size_t count, std::vector<Finding>& findings) {
  const double scatters = std::sqrt(dispersion);  // by so many times the sensor's sigmas
  const double sigma = score.sigma * scatters;
  const double of_reading = score.of_reading / scatters;
  if (of_reading > kLeastOffset && std::abs(score.value) > kSigmasOfChance * sigma)
    findings.push_back(warning(code, count, payload::Offset{score.value / unit, sigma / unit, of_reading}));
}

/// Against the filter that it started from.
void check_contradiction(const SlamResult& filtered, const SmoothedSlam& smoothed,
                         std::vector<Finding>& findings) {
  if (const auto squared = median_contradiction(filtered.online, smoothed.trajectory);
      squared && *squared > kGreatestContradiction * kMedianOfThree)
    findings.push_back(warning(FindingCode::smoother_contradicts, smoothed.counts.sightings,
                               payload::Times{*squared / kMedianOfThree}));
}

bool has_many_outliers(const SmootherCounts& counts) {
  return static_cast<double>(counts.outliers) > kMostOutliers * static_cast<double>(counts.sightings);
}

void check_smoother(const SmootherCounts& counts, std::vector<Finding>& findings) {
  if (!counts.converged)
    findings.push_back(warning(FindingCode::not_converged, counts.sightings,
                               payload::Amount{static_cast<double>(counts.iterations)}));
  const double freedom = counts.degrees_of_freedom;
  if (freedom <= 0.0 || has_many_outliers(counts)) return;  // they cost, and do not make the rest worse
  const double ratio = counts.cost / freedom;
  if (ratio > kGreatestRatio && ratio > 1.0 + kSigmasOfChance * std::sqrt(2.0 / freedom))
    findings.push_back(warning(FindingCode::noise, counts.sightings, payload::Times{ratio}));
}

void append(std::vector<Finding> further, std::vector<Finding>& findings) {
  std::ranges::move(further, std::back_inserter(findings));
}

std::vector<Finding> common_errors_in(const SmootherFit& fit) {
  const SmootherCounts& counts = fit.counts;
  return common_errors(fit.sensor, counts.cost / std::max(1, counts.degrees_of_freedom), counts.sightings);
}

std::vector<Finding> checks_of_innovations(const SlamResult& filtered) {
  const SlamCounts& counts = filtered.counts;
  return innovation_checks(counts.median_nis, counts.matched + counts.rejected);
}

/// Of a filter alone: by how all that it saw fits together in the end where it is a smoother, else by its
/// innovations.
void check_online(const SlamResult& filtered, std::vector<Finding>& findings) {
  if (filtered.fit) {
    check_smoother(filtered.fit->counts, findings);
    append(common_errors_in(*filtered.fit), findings);
  }
  if (!filtered.fit || has_many_outliers(filtered.fit->counts))
    append(checks_of_innovations(filtered), findings);
}

/// Of the smoother after it.
void check_smoothed(const SlamResult& filtered, const SmoothedSlam& smoothed,
                    std::vector<Finding>& findings) {
  const std::vector<Finding> of_smoother = consistency_checks(smoothed.counts);
  // Where all that was seen fits together the filter alone was wrong: good to know, and the result
  // is consistent. A landmark's place is that of all its sightings now.
  const bool has_recovered = is_lost(findings) && of_smoother.empty() && !has_many_outliers(smoothed.counts);
  for (Finding& finding : findings)
    if (has_recovered || finding.code == FindingCode::misplaced_landmark) finding.severity = Severity::note;
  append(of_smoother, findings);
  if (has_many_outliers(smoothed.counts)) append(checks_of_innovations(filtered), findings);
  if (!has_recovered) check_contradiction(filtered, smoothed, findings);
  append(common_errors_in({smoothed.counts, smoothed.sensor}), findings);
  std::ranges::stable_sort(findings, {}, [](const Finding& f) { return f.severity == Severity::note; });
}

}  // namespace

std::vector<Finding> consistency_checks(const SlamInput& input, const SlamResult& filtered,
                                        const SmoothedSlam* smoothed) {
  std::vector<Finding> findings;
  check_filter(input, filtered, findings);
  if (smoothed != nullptr)
    check_smoothed(filtered, *smoothed, findings);
  else if (!is_lost(findings))
    check_online(filtered, findings);
  return findings;
}

std::vector<Finding> innovation_checks(std::optional<double> median_nis, std::size_t sightings) {
  if (!median_nis) return {};
  const double ratio = *median_nis / kMedianOfTwo;
  const double sigma = 2.0 / (kMedianOfTwo * std::sqrt(static_cast<double>(sightings)));
  if (ratio <= kGreatestRatio || ratio <= 1.0 + kSigmasOfChance * sigma) return {};
  return {warning(FindingCode::noise, sightings, payload::Amount{*median_nis})};
}

std::vector<Finding> consistency_checks(const SmootherCounts& counts) {
  std::vector<Finding> findings;
  check_smoother(counts, findings);
  return findings;
}

std::vector<Finding> common_errors(const SensorScores& scores, double dispersion, std::size_t sightings) {
  std::vector<Finding> findings;
  check_offset(FindingCode::range_offset, scores.range, dispersion, 1.0, sightings, findings);
  check_offset(FindingCode::bearing_offset, scores.bearing, dispersion, radians(1.0), sightings, findings);
  check_offset(FindingCode::depths, scores.depth, dispersion, 1.0, sightings, findings);
  return findings;
}

}  // namespace trundle::slam
