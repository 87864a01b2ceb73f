#include "trundle/slam/localization/pose_hypotheses.hpp"

#include <algorithm>

namespace trundle::slam {

PoseHypotheses::PoseHypotheses(const KnownMap& map, const LandmarkSensor& sensor,
                               const MapSightOptions& options)
    : map_(&map), sensor_(sensor), options_(options) {}

void PoseHypotheses::step(const Motion& motion, std::span<const Observation> observations,
                          std::span<const double> novelty) {
  for (TrackedHypothesis& hypothesis : hypotheses_) {
    const double against = hypothesis.filter.step(motion, observations, novelty).new_evidence_against;
    hypothesis.log_odds -= against;
    hypothesis.alarm = std::max(0.0, hypothesis.alarm + against);
  }
  sort();
}

void PoseHypotheses::add(TrackedHypothesis hypothesis) {
  hypotheses_.push_back(std::move(hypothesis));
  sort();
}

void PoseHypotheses::read_bias(const BiasReading& reading) {
  for (TrackedHypothesis& hypothesis : hypotheses_) hypothesis.filter.read_bias(reading);
}

void PoseHypotheses::admit(std::span<const PoseHypothesis> hypotheses, double log_prior,
                           const PoseEstimate& odometry) {
  for (const PoseHypothesis& found : hypotheses)
    hypotheses_.push_back(
        {PoseEkf(*map_, sensor_, with_systematic(found.pose, odometry), options_, found.made_of),
         log_prior + found.log_odds, 0.0});
  sort();
}

TrackedHypothesis PoseHypotheses::take_first() {
  TrackedHypothesis first = std::move(hypotheses_.front());
  hypotheses_.erase(hypotheses_.begin());
  return first;
}

void PoseHypotheses::remove(double least_log_odds, double alarm) {
  std::erase_if(hypotheses_,
                [&](const TrackedHypothesis& r) { return r.log_odds < least_log_odds || r.alarm >= alarm; });
}

void PoseHypotheses::remove(const Pose2& place) {
  std::erase_if(hypotheses_, [&](const TrackedHypothesis& r) {
    return is_same_place(r.filter.estimate().pose, place, options_.same);
  });
}

/// The most probable first; of those in one place only the first stays.
void PoseHypotheses::sort() {
  std::ranges::stable_sort(hypotheses_, std::greater{}, &TrackedHypothesis::log_odds);
  std::vector<TrackedHypothesis> kept;
  for (TrackedHypothesis& hypothesis : hypotheses_) {
    const Pose2& place = hypothesis.filter.estimate().pose;
    if (kept.size() == kMostHypotheses) break;
    if (std::ranges::none_of(kept, [&](const TrackedHypothesis& r) {
          return is_same_place(r.filter.estimate().pose, place, options_.same);
        }))
      kept.push_back(std::move(hypothesis));
  }
  hypotheses_ = std::move(kept);
}

}  // namespace trundle::slam
