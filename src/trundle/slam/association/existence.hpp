#pragma once

#include <array>

#include "trundle/slam/models/observation.hpp"

namespace trundle::slam {

/// Where a sensor has seen landmarks so far, and how often, at each range, it misses one that it ought to
/// see. Learned from the sightings themselves, so nobody has to know the field of view.
/// docs/theory/existence.md, eq. 23.
class Visibility {
 public:
  explicit Visibility(double max_range_m) : max_range_m_(max_range_m) {
    seen_.fill(1.0);
    expected_.fill(2.0);
  }

  /// A landmark of the map was seen there.
  void add_seen(double range_m, double bearing_rad);
  /// Inside what has been seen.
  [[nodiscard]] bool covers(double range_m, double bearing_rad) const {
    return range_m <= reach_m(bearing_rad);
  }
  /// The furthest sighting: no landmark further away is covered.
  [[nodiscard]] double reach_m() const;

  /// A landmark that surely exists and that the view covers was seen or missed.
  void count(double range_m, double bearing_rad, bool seen);
  /// What seeing and missing it there says for a landmark's existence, as log-odds.
  [[nodiscard]] double for_seen(double range_m, double bearing_rad) const;
  [[nodiscard]] double for_missed(double range_m, double bearing_rad, bool neighbour_seen = false) const;

  /// What was taken for a new landmark has turned out to be one, or to be none.
  void resolve(bool was_one) { (was_one ? real_ : spurious_) += 1.0; }
  /// Log-odds that a new landmark is one, as far as that has turned out.
  [[nodiscard]] double prior() const;

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.furthest_m_, self.sightings_, self.seen_, self.expected_, self.real_, self.spurious_);
  }

 private:
  /// Of 10°: one counts where its neighbours are filled, too, so what sees less than 30° never misses a
  /// landmark.
  static constexpr int kSectors = 36;
  /// Up to the edge of the view, in the last sixteenth of which landmarks are missed most.
  static constexpr int kRings = 16;
  static int sector_of(double bearing_rad);
  /// The furthest sighting around that direction; 0: there was hardly any.
  [[nodiscard]] double reach_m(double bearing_rad) const;
  [[nodiscard]] std::size_t ring_of(double range_m, double bearing_rad) const;
  [[nodiscard]] double detection(double range_m, double bearing_rad) const;

  double max_range_m_;
  std::array<double, kSectors> furthest_m_{};
  std::array<int, kSectors> sightings_{};
  std::array<double, kRings> seen_;      ///< by ring, and one before any [Laplace's rule of succession]
  std::array<double, kRings> expected_;  ///< likewise, and two
  double real_ = 1.0;                    ///< new landmarks, and one before any
  double spurious_ = 1.0;                ///< likewise
};

/// Whether a landmark exists, as log-odds.
struct Existence {
  static constexpr double kConfirmed = 3.0;  ///< from it on, with the prior, it is in the map: 95 %
  static constexpr double kLikely = 2.0;  ///< above it the next expected sighting most probably is one: 88 %

  double log_odds = 0.0;                     ///< by what was seen of it, without the prior
  Vector2 last_viewpoint = Vector2::Zero();  ///< where the robot was when it last counted
  bool was_likely = false;                   ///< at some time
  bool was_confirmed = false;                ///< likewise

  [[nodiscard]] bool has_parallax(const Vector2& from, double range_m) const {
    return trundle::slam::has_parallax((from - last_viewpoint).norm(), range_m);
  }
  /// That it ought to be seen from somewhere, and whether it was.
  struct ExpectedSighting {
    Vector2 from;
    double range_m;
    double bearing_rad;
    bool seen;
    bool neighbour_seen = false;  ///< what might have shown it was taken for another landmark
  };
  /// Counts one from a new viewpoint; where nothing was seen, only inside of the view. False: to be
  /// removed.
  bool update(const ExpectedSighting& expected, Visibility& visibility);
  /// As surely there as one that is removed is not: a landmark of the map. Any other is tentative.
  [[nodiscard]] bool is_confirmed(const Visibility& visibility) const;

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.log_odds, self.last_viewpoint, self.was_likely, self.was_confirmed);
  }
};

}  // namespace trundle::slam
