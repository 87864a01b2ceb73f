#include "trundle/slam/association/existence.hpp"

#include <algorithm>
#include <cmath>

namespace trundle::slam {
namespace {

// Below it a landmark leaves the map: as surely not there as a confirmed one is.
constexpr double kRemoved = -Existence::kConfirmed;
// No landmark rises above: one that vanishes takes twice the evidence to go that it took to be confirmed.
constexpr double kMost = 2.0 * Existence::kConfirmed;
// Probability of a sighting where there is no landmark: that of a confirmed one being none.
constexpr double kFalseSighting = 0.05;
// Probability of detection, at most. Misses follow each other: one says −1.6 at most, so six, each from
// another place, remove what is surest. And no single sighting, +2.8 at most, confirms a landmark.
constexpr double kMostDetection = 0.8;
// In a sector, before it belongs to the field of view: the furthest of ten is with 95 % beyond 0.05^(1/10) =
// three quarters of how far it sees.
constexpr int kLeastSightings = 10;

}  // namespace

int Visibility::sector_of(double bearing_rad) {
  const double share = (wrap_angle(bearing_rad) + kPi) / (2.0 * kPi);
  return std::min(kSectors - 1, static_cast<int>(share * kSectors));
}

void Visibility::add_seen(double range_m, double bearing_rad) {
  const auto sector = static_cast<std::size_t>(sector_of(bearing_rad));
  furthest_m_[sector] = std::max(furthest_m_[sector], std::min(range_m, max_range_m_));
  ++sightings_[sector];
}

double Visibility::reach_m(double bearing_rad) const {
  const int middle = sector_of(bearing_rad);
  double reach_m = max_range_m_;
  for (int i = middle - 1; i <= middle + 1; ++i) {
    const auto sector = static_cast<std::size_t>((i + kSectors) % kSectors);
    reach_m = std::min(reach_m, sightings_[sector] < kLeastSightings ? 0.0 : furthest_m_[sector]);
  }
  return reach_m;
}

double Visibility::reach_m() const {
  return *std::ranges::max_element(furthest_m_);
}

std::size_t Visibility::ring_of(double range_m, double bearing_rad) const {
  const double reach_m = this->reach_m(bearing_rad);
  if (range_m >= reach_m) return kRings - 1;
  return static_cast<std::size_t>(range_m / reach_m * kRings);
}

void Visibility::count(double range_m, double bearing_rad, bool seen) {
  const std::size_t ring = ring_of(range_m, bearing_rad);
  expected_[ring] += 1.0;
  seen_[ring] += seen ? 1.0 : 0.0;
}

double Visibility::detection(double range_m, double bearing_rad) const {
  const std::size_t ring = ring_of(range_m, bearing_rad);
  return std::min(seen_[ring] / expected_[ring], kMostDetection);
}

// Eq. 23.
double Visibility::for_seen(double range_m, double bearing_rad) const {
  return std::max(0.0, std::log(detection(range_m, bearing_rad) / kFalseSighting));
}

// Of two landmarks that cannot be distinguished one alone is seen in 2p(1 − p) of the cases, of a single one
// in p.
double Visibility::for_missed(double range_m, double bearing_rad, bool neighbour_seen) const {
  const double ways = neighbour_seen ? 2.0 : 1.0;
  return std::min(0.0, std::log(ways * (1.0 - detection(range_m, bearing_rad)) / (1.0 - kFalseSighting)));
}

double Visibility::prior() const {
  return std::log(real_ / spurious_);
}

bool Existence::is_confirmed(const Visibility& visibility) const {
  return log_odds >= std::min(kMost, kConfirmed - std::min(0.0, visibility.prior()));
}

bool Existence::update(const ExpectedSighting& expected, Visibility& visibility) {
  if (!has_parallax(expected.from, expected.range_m)) return true;
  const bool is_covered = visibility.covers(expected.range_m, expected.bearing_rad);
  if (!is_covered && !expected.seen) return true;
  // What was never confirmed does not say how often the sensor misses what is there.
  if (is_covered && was_confirmed && log_odds > kLikely)
    visibility.count(expected.range_m, expected.bearing_rad, expected.seen);
  log_odds += expected.seen
                  ? visibility.for_seen(expected.range_m, expected.bearing_rad)
                  : visibility.for_missed(expected.range_m, expected.bearing_rad, expected.neighbour_seen);
  log_odds = std::min(kMost, log_odds);
  last_viewpoint = expected.from;
  const bool is_removed = log_odds < kRemoved;
  if (!was_likely && (is_removed || log_odds > kLikely)) visibility.resolve(!is_removed);
  was_likely = was_likely || log_odds > kLikely;
  was_confirmed = was_confirmed || is_confirmed(visibility);
  return !is_removed;
}

}  // namespace trundle::slam
