#pragma once

#include <array>

#include "trundle/slam/observation.hpp"

namespace trundle {

/// Where a sensor has seen landmarks so far, and how often it misses one that it ought to see. Learned from
/// the sightings themselves, so nobody has to know the field of view. docs/slam.md, eq. 23.
class Visibility {
 public:
  explicit Visibility(double max_range_m) : max_range_m_(max_range_m) {}

  /// A landmark of the map was seen there.
  void saw(double range_m, double bearing_rad);
  /// Inside what has been seen, with a margin.
  bool covers(double range_m, double bearing_rad) const;
  /// No landmark further away is covered.
  double reach_m() const;

  /// A landmark that surely exists and that the view covers was seen or missed.
  void count(bool seen);
  /// What seeing and missing it says for a landmark's existence, as log-odds.
  double for_seen() const;
  double for_missed() const;

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.furthest_m_, self.sightings_, self.seen_, self.looks_);
  }

 private:
  static constexpr int kSectors = 36;
  static int sector_of(double bearing_rad);
  double detection() const;

  double max_range_m_;
  std::array<double, kSectors> furthest_m_{};
  std::array<int, kSectors> sightings_{};
  double seen_ = 1.0;
  double looks_ = 2.0;
};

/// Whether a landmark exists.
struct Existence {
  static constexpr double kMost = 6.0;  ///< no landmark is surer than that: what vanishes is soon believed
  static constexpr double kSure = 2.0;  ///< above it, it tells how often the sensor misses one
  static constexpr double kRemoved = -3.0;  ///< below it, it leaves the map
  double log_odds = 0.0;
  Vector2 looked_from = Vector2::Zero();  ///< where the robot was when it last counted

  /// True where the sight of a landmark is another one than last time: the robot has moved by a tenth of the
  /// distance. What stands still in front of a landmark hides it only once.
  bool is_another_look(const Vector2& from, double range_m) const {
    return (from - looked_from).norm() >= 0.1 * range_m;
  }
  /// Counts a look. False: to be removed.
  bool look(const Vector2& from, bool seen, Visibility& visibility);

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.log_odds, self.looked_from);
  }
};

}  // namespace trundle
