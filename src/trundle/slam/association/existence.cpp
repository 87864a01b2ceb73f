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
  return kMargin * *std::ranges::max_element(furthest_m_);
}

void Visibility::count(bool seen) {
  looks_ += 1.0;
  seen_ += seen ? 1.0 : 0.0;
}

double Visibility::detection() const {
  return std::min(seen_ / looks_, kSurestDetection);
}

// Eq. 23.
double Visibility::for_seen() const {
  return std::max(0.0, std::log(detection() / kBySpurious));
}

double Visibility::for_missed() const {
  return std::min(0.0, std::log((1.0 - detection()) / (1.0 - kBySpurious)));
}

bool Existence::look(const Vector2& from, bool seen, Visibility& visibility) {
  if (log_odds > kSure) visibility.count(seen);
  log_odds = std::min(kMost, log_odds + (seen ? visibility.for_seen() : visibility.for_missed()));
  looked_from = from;
  return log_odds >= kRemoved;
}

}  // namespace trundle
