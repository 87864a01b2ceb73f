#include "trundle/slam/consistency_checks.hpp"

#include <cmath>

namespace trundle::slam {
namespace {

// So many more rejected sightings than matched ones in a stretch. With a share p of outliers a stretch
// reaches k with probability (p/(1 − p))^k: with a third, once in a million; with a tenth, never.
constexpr int kLost = 20;
// The median of so many NIS is known to 30 %.
constexpr std::size_t kFewestSightings = 20;
// Of the NIS' median, which is 1.39 if consistent: sigmas are then too small by √(5/1.39) = 1.9.
constexpr double kGreatestMedian = 5.0;
// Share of sightings whose cost is bounded. With more, the cost says nothing of the noise of the others.
constexpr double kMostOutliers = 0.05;
// Beyond so many σ a cost per degree of freedom is no chance in any number of runs: 1e-9.
constexpr double kSigmasOfChance = 6.0;
// Of cost and degrees of freedom: every ± is too small by √1.5 = 1.2. Less is within what sigmas are known
// to.
constexpr double kGreatestCostRatio = 1.5;

Finding warning(FindingCode code, std::size_t count, const Payload& payload) {
  return {Severity::warning, code, "sightings", count, {}, payload};
}

/// The stretch in which sightings that do not fit outnumber those that do by most.
struct Stretch {
  std::size_t first = 0, last = 0;  ///< steps
  int excess = 0;
  std::size_t unfit = 0, seen = 0;
};

Stretch worst_stretch(const std::vector<StepReport>& reports) {
  Stretch worst, here;
  for (std::size_t k = 0; k < reports.size(); ++k)
    for (const ObservationReport& observation : reports[k].observations) {
      const bool is_rejected = observation.decision == Decision::rejected;
      if (!is_rejected && observation.decision != Decision::matched) continue;
      const bool is_unfit = is_rejected || observation.nis > kDefaultGate;  // all together may pass: eq. 6a
      if (here.excess <= 0) here = {.first = k};
      here.last = k;
      here.excess += is_unfit ? 1 : -1;
      here.unfit += is_unfit ? 1 : 0;
      ++here.seen;
      if (here.excess > worst.excess) worst = here;
    }
  return worst;
}

void check_filter(const SlamInput& input, const SlamResult& filtered, std::vector<Finding>& findings) {
  const Stretch worst = worst_stretch(filtered.reports);
  if (worst.excess >= kLost)
    return findings.push_back(
        warning(FindingCode::lost, worst.unfit,
                payload::Stretch{.start_s = input.steps[worst.first].time_s - input.start_s,
                                 .end_s = input.steps[worst.last].time_s - input.start_s,
                                 .all = worst.seen}));
  const SlamCounts& counts = filtered.counts;
  const std::size_t seen = counts.matched + counts.rejected;
  if (seen >= kFewestSightings && counts.median_nis > kGreatestMedian)
    findings.push_back(warning(FindingCode::noise, seen, payload::Amount{counts.median_nis}));
}

void check_smoother(const SmootherCounts& counts, std::vector<Finding>& findings) {
  if (!counts.converged)
    findings.push_back(warning(FindingCode::not_converged, counts.sightings,
                               payload::Amount{static_cast<double>(counts.iterations)}));
  const double freedom = counts.degrees_of_freedom;
  const double outliers = static_cast<double>(counts.outliers) / static_cast<double>(counts.sightings);
  if (freedom <= 0.0 || outliers > kMostOutliers) return;  // they cost, and do not make the rest worse
  const double ratio = counts.cost / freedom;
  if (ratio > kGreatestCostRatio && ratio > 1.0 + kSigmasOfChance * std::sqrt(2.0 / freedom))
    findings.push_back(warning(FindingCode::noise, counts.sightings, payload::Times{ratio}));
}

}  // namespace

std::vector<Finding> consistency_checks(const SlamInput& input, const SlamResult& filtered,
                                        const SmoothedSlam* smoothed) {
  std::vector<Finding> findings;
  check_filter(input, filtered, findings);
  if (smoothed != nullptr) check_smoother(smoothed->counts, findings);
  return findings;
}

}  // namespace trundle::slam
