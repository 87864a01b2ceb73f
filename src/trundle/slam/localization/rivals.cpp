#include "trundle/slam/localization/rivals.hpp"

#include <algorithm>

namespace trundle {
Rivals::Rivals(const KnownMap& map, const LandmarkSensor& sensor, const MapSightOptions& options)
    : map_(&map), sensor_(sensor), options_(options) {}

void Rivals::step(const Motion& motion, std::span<const Observation> observations,
                  std::span<const double> news) {
  for (Rival& rival : rivals_) {
    const double against = rival.filter.step(motion, observations, news).news_against;
    rival.log_odds -= against;
    rival.alarm = std::max(0.0, rival.alarm + against);
  }
  sort();
}

void Rivals::add(Rival rival) {
  rivals_.push_back(std::move(rival));
  sort();
}

void Rivals::read_bias(const BiasReading& reading) {
  for (Rival& rival : rivals_) rival.filter.read_bias(reading);
}

void Rivals::admit(std::span<const PoseHypothesis> hypotheses, double log_prior,
                   const PoseEstimate& odometry) {
  for (const PoseHypothesis& hypothesis : hypotheses)
    rivals_.push_back({PoseEkf(*map_, sensor_, with_systematic(hypothesis.pose, odometry), options_),
                       log_prior + hypothesis.log_odds, 0.0});
  sort();
}

Rival Rivals::take_first() {
  Rival first = std::move(rivals_.front());
  rivals_.erase(rivals_.begin());
  return first;
}

void Rivals::give_up(double least_log_odds, double alarm) {
  std::erase_if(rivals_, [&](const Rival& r) { return r.log_odds < least_log_odds || r.alarm >= alarm; });
}

void Rivals::give_up(const Pose2& place) {
  std::erase_if(rivals_, [&](const Rival& r) { return is_same_place(r.filter.estimate().pose, place); });
}

/// The most probable first; of those in one place only the first stays.
void Rivals::sort() {
  std::ranges::stable_sort(rivals_, std::greater{}, &Rival::log_odds);
  std::vector<Rival> kept;
  for (Rival& rival : rivals_) {
    const Pose2& place = rival.filter.estimate().pose;
    if (kept.size() == kMost) break;
    if (std::ranges::none_of(kept,
                             [&](const Rival& r) { return is_same_place(r.filter.estimate().pose, place); }))
      kept.push_back(std::move(rival));
  }
  rivals_ = std::move(kept);
}

}  // namespace trundle
