#include "trundle/slam/association/existence.hpp"

#include <algorithm>
#include <cmath>

namespace trundle {
namespace {

constexpr int kEnough = 10;               // sightings in a sector before it belongs to the view
constexpr double kMargin = 0.8;           // of the furthest range seen there
constexpr double kBySpurious = 0.05;      // share of looks at nothing that yield a sighting all the same
constexpr double kSurestDetection = 0.8;  // misses follow each other: none may say too much

}  // namespace

int Visibility::sector_of(double bearing_rad) {
  const double share = (wrap_angle(bearing_rad) + kPi) / (2.0 * kPi);
  return std::min(kSectors - 1, static_cast<int>(share * kSectors));
}

void Visibility::saw(double range_m, double bearing_rad) {
  const auto sector = static_cast<std::size_t>(sector_of(bearing_rad));
  furthest_m_[sector] = std::max(furthest_m_[sector], std::min(range_m, max_range_m_));
  ++sightings_[sector];
}

bool Visibility::covers(double range_m, double bearing_rad) const {
  const int middle = sector_of(bearing_rad);
  for (int i = middle - 1; i <= middle + 1; ++i) {
    const auto sector = static_cast<std::size_t>((i + kSectors) % kSectors);
    if (sightings_[sector] < kEnough || range_m > kMargin * furthest_m_[sector]) return false;
  }
  return true;
}

double Visibility::reach_m() const {
  return *std::ranges::max_element(furthest_m_);
}

std::size_t Visibility::ring_of(double range_m) const {
  const double share = std::clamp(range_m / max_range_m_, 0.0, 1.0);
  return static_cast<std::size_t>(std::min(kRings - 1, static_cast<int>(share * kRings)));
}

void Visibility::count(double range_m, bool seen) {
  const std::size_t ring = ring_of(range_m);
  looks_[ring] += 1.0;
  seen_[ring] += seen ? 1.0 : 0.0;
}

double Visibility::detection(double range_m) const {
  const std::size_t ring = ring_of(range_m);
  return std::min(seen_[ring] / looks_[ring], kSurestDetection);
}

// Eq. 23.
double Visibility::for_seen(double range_m) const {
  return std::max(0.0, std::log(detection(range_m) / kBySpurious));
}

double Visibility::for_missed(double range_m) const {
  return std::min(0.0, std::log((1.0 - detection(range_m)) / (1.0 - kBySpurious)));
}

double Visibility::prior() const {
  return std::log(real_ / spurious_);
}

bool Existence::look(const Look& look, Visibility& visibility) {
  if (!is_another_look(look.from, look.range_m)) return true;
  const bool is_covered = visibility.covers(look.range_m, look.bearing_rad);
  if (!is_covered && !look.seen) return true;
  if (is_covered && log_odds > kSure) visibility.count(look.range_m, look.seen);
  log_odds += look.seen ? visibility.for_seen(look.range_m) : visibility.for_missed(look.range_m);
  log_odds = std::min(kMost, log_odds);
  looked_from = look.from;
  const bool is_removed = log_odds < kRemoved;
  if (!was_sure && (is_removed || log_odds > kSure)) visibility.resolve(!is_removed);
  was_sure = was_sure || log_odds > kSure;
  return !is_removed;
}

}  // namespace trundle
