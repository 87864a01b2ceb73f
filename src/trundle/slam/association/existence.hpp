#pragma once

#include <algorithm>
#include <array>

#include "trundle/slam/observation.hpp"

namespace trundle {

/// Where a sensor has seen landmarks so far, and how often, at each range, it misses one that it ought to
/// see. Learned from the sightings themselves, so nobody has to know the field of view.
/// docs/theory/existence.md, eq. 23.
class Visibility {
 public:
  explicit Visibility(double max_range_m) : max_range_m_(max_range_m) {
    seen_.fill(1.0);
    looks_.fill(2.0);
  }

  /// A landmark of the map was seen there.
  void saw(double range_m, double bearing_rad);
  /// Inside what has been seen.
  bool covers(double range_m, double bearing_rad) const { return range_m <= reach_m(bearing_rad); }
  /// The furthest sighting: no landmark further away is covered.
  double reach_m() const;

  /// A landmark that surely exists and that the view covers was seen or missed.
  void count(double range_m, double bearing_rad, bool seen);
  /// What seeing and missing it there says for a landmark's existence, as log-odds.
  double for_seen(double range_m, double bearing_rad) const;
  double for_missed(double range_m, double bearing_rad, bool saw_a_neighbour = false) const;

  /// What was taken for a new landmark has turned out to be one, or to be none.
  void resolve(bool was_one) { (was_one ? real_ : spurious_) += 1.0; }
  /// Log-odds that a new landmark is one, as far as that has turned out.
  double prior() const;

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.furthest_m_, self.sightings_, self.seen_, self.looks_, self.real_, self.spurious_);
  }

 private:
  static constexpr int kSectors = 36;
  static constexpr int kRings = 16;  ///< up to the edge of the view, where landmarks are missed more often
  static int sector_of(double bearing_rad);
  /// The furthest sighting around that direction; 0: there was hardly any.
  double reach_m(double bearing_rad) const;
  std::size_t ring_of(double range_m, double bearing_rad) const;
  double detection(double range_m, double bearing_rad) const;

  double max_range_m_;
  std::array<double, kSectors> furthest_m_{};
  std::array<int, kSectors> sightings_{};
  std::array<double, kRings> seen_;
  std::array<double, kRings> looks_;
  double real_ = 1.0;
  double spurious_ = 1.0;
};

/// Whether a landmark exists.
struct Existence {
  static constexpr double kMost = 6.0;  ///< no landmark is surer than that: what vanishes is soon believed
  /// Above it, once confirmed, it tells how often the sensor misses one.
  static constexpr double kSure = 2.0;
  static constexpr double kRemoved = -3.0;  ///< below it, it leaves the map
  static constexpr double kTold = 3.0;      ///< from it on, with the prior, the map that is given out has it
  double log_odds = 0.0;                    ///< what was seen of it says so, without the prior
  Vector2 looked_from = Vector2::Zero();    ///< where the robot was when it last counted
  bool was_sure = false;                    ///< at some time
  bool was_confirmed = false;               ///< likewise

  bool is_another_look(const Vector2& from, double range_m) const {
    return trundle::is_another_look((from - looked_from).norm(), range_m);
  }
  /// A look at where it ought to be.
  struct Look {
    Vector2 from;
    double range_m;
    double bearing_rad;
    bool seen;
    bool saw_a_neighbour = false;  ///< what might have shown it was taken for another landmark
  };
  /// Counts a look that is another one, and in the view if it saw nothing. False: to be removed.
  bool look(const Look& look, Visibility& visibility);
  /// As surely there as one that is removed is not: a landmark of the map. Any other is tentative.
  bool is_confirmed(const Visibility& visibility) const {
    return log_odds >= std::min(kMost, kTold - std::min(0.0, visibility.prior()));
  }

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.log_odds, self.looked_from, self.was_sure, self.was_confirmed);
  }
};

}  // namespace trundle
