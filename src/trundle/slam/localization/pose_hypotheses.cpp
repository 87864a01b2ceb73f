#include "trundle/slam/localization/pose_hypotheses.hpp"

#include <algorithm>

namespace trundle {
PoseHypotheses::PoseHypotheses(const KnownMap& map, const LandmarkSensor& sensor,
                               const MapSightOptions& options)
    : map_(&map), sensor_(sensor), options_(options) {}

void PoseHypotheses::step(const Motion& motion, std::span<const Observation> observations,
                          std::span<const double> news) {
  for (TrackedHypothesis& rival : hypotheses_) {
    const double against = rival.filter.step(motion, observations, news).news_against;
    rival.log_odds -= against;
    rival.alarm = std::max(0.0, rival.alarm + against);
  }
  sort();
}

void PoseHypotheses::add(TrackedHypothesis rival) {
  hypotheses_.push_back(std::move(rival));
  sort();
}

void PoseHypotheses::read_bias(const BiasReading& reading) {
  for (TrackedHypothesis& rival : hypotheses_) rival.filter.read_bias(reading);
}

void PoseHypotheses::admit(std::span<const PoseHypothesis> hypotheses, double log_prior,
                           const PoseEstimate& odometry) {
  for (const PoseHypothesis& hypothesis : hypotheses)
    hypotheses_.push_back({PoseEkf(*map_, sensor_, with_systematic(hypothesis.pose, odometry), options_),
                           log_prior + hypothesis.log_odds, 0.0});
  sort();
}

TrackedHypothesis PoseHypotheses::take_first() {
  TrackedHypothesis first = std::move(hypotheses_.front());
  hypotheses_.erase(hypotheses_.begin());
  return first;
}

void PoseHypotheses::give_up(double least_log_odds, double alarm) {
  std::erase_if(hypotheses_,
                [&](const TrackedHypothesis& r) { return r.log_odds < least_log_odds || r.alarm >= alarm; });
}

void PoseHypotheses::give_up(const Pose2& place) {
  std::erase_if(hypotheses_,
                [&](const TrackedHypothesis& r) { return is_same_place(r.filter.estimate().pose, place); });
}

/// The most probable first; of those in one place only the first stays.
void PoseHypotheses::sort() {
  std::ranges::stable_sort(hypotheses_, std::greater{}, &TrackedHypothesis::log_odds);
  std::vector<TrackedHypothesis> kept;
  for (TrackedHypothesis& rival : hypotheses_) {
    const Pose2& place = rival.filter.estimate().pose;
    if (kept.size() == kMost) break;
    if (std::ranges::none_of(
            kept, [&](const TrackedHypothesis& r) { return is_same_place(r.filter.estimate().pose, place); }))
      kept.push_back(std::move(rival));
  }
  hypotheses_ = std::move(kept);
}

}  // namespace trundle
