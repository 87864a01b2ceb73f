#include "trundle/slam/association/existence.hpp"

#include <algorithm>
#include <cmath>

namespace trundle::slam {

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
    reach_m = std::min(reach_m, sightings_[sector] < options_.least_sightings ? 0.0 : furthest_m_[sector]);
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
  return std::min(seen_[ring] / expected_[ring], options_.most_detection);
}

// Eq. 23.
double Visibility::for_seen(double range_m, double bearing_rad) const {
  return std::max(0.0, std::log(detection(range_m, bearing_rad) / options_.false_sighting));
}

// Of two landmarks that cannot be distinguished one alone is seen in 2p(1 − p) of the cases, of a single one
// in p.
double Visibility::for_missed(double range_m, double bearing_rad, bool neighbour_seen) const {
  const double ways = neighbour_seen ? 2.0 : 1.0;
  return std::min(0.0,
                  std::log(ways * (1.0 - detection(range_m, bearing_rad)) / (1.0 - options_.false_sighting)));
}

double Visibility::prior() const {
  return std::log(real_ / spurious_);
}

bool Existence::update(const ExpectedSighting& expected, Visibility& visibility) {
  if (!has_parallax(expected.from, expected.range_m)) return true;
  const ExistenceOptions& options = visibility.options();
  const bool is_covered = visibility.covers(expected.range_m, expected.bearing_rad);
  if (!is_covered && !expected.seen) return true;
  // What was never confirmed does not say how often the sensor misses what is there.
  if (is_covered && was_confirmed && log_odds > options.likely)
    visibility.count(expected.range_m, expected.bearing_rad, expected.seen);
  log_odds += expected.seen
                  ? visibility.for_seen(expected.range_m, expected.bearing_rad)
                  : visibility.for_missed(expected.range_m, expected.bearing_rad, expected.neighbour_seen);
  log_odds = std::min(options.most(), log_odds);
  last_viewpoint = expected.from;
  const bool is_removed = log_odds < options.removed();
  if (!was_likely && (is_removed || log_odds > options.likely)) visibility.resolve(!is_removed);
  was_likely = was_likely || log_odds > options.likely;
  was_confirmed = was_confirmed || is_confirmed(visibility);
  return !is_removed;
}

}  // namespace trundle::slam
