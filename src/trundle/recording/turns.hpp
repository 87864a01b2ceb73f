#pragma once

#include <cmath>
#include <functional>
#include <optional>

#include "trundle/chassis/robot.hpp"
#include "trundle/recording/alignment/align.hpp"
#include "trundle/statistics/paired_sums.hpp"

namespace trundle::recording {

/// Root of the sum of squares [rad] with which turns can be compared.
inline constexpr double kLeastTurning_rad = 0.1;
/// The same, far more than a bias sums up to.
inline constexpr double kMuchTurning_rad = 1.0;
/// Over which turns are compared: a turn then is many counts, clocks that differ by some 10 ms hardly matter,
/// and few turn back within it.
inline constexpr double kPieceOfTurns_s = 0.5;
/// Correlation of turns that show the same motion.
inline constexpr double kTurnsAgree = 0.5;

/// How far the robot turns over pieces of half a second, by its wheels (x) and by something else (y) [rad]:
/// of turns as they come.
class TurnPairs {
 public:
  /// Of an interval in which both tell.
  void add(double by_wheels_rad, double by_other_rad, double duration_s) {
    by_wheels_rad_ += by_wheels_rad;
    by_other_rad_ += by_other_rad;
    duration_s_ += duration_s;
    if (duration_s_ < kPieceOfTurns_s) return;
    sums_.add(by_wheels_rad_, by_other_rad_);
    by_wheels_rad_ = by_other_rad_ = duration_s_ = 0.0;
  }
  /// Of the pieces that are complete.
  [[nodiscard]] const PairedSums& sums() const { return sums_; }

 private:
  PairedSums sums_;
  double by_wheels_rad_ = 0.0, by_other_rad_ = 0.0, duration_s_ = 0.0;
};

/// The same of all readings. `other_turn`: how far in an interval, asked of one after the other; NaN: it does
/// not tell.
PairedSums turn_pairs(const Robot& robot, const AlignedReadings& readings,
                      const std::function<double(const Increment&)>& other_turn);

/// How far the robot turned by what its gyro reads [rad].
[[nodiscard]] double rotation_of(double gyro_rad, double duration_s, const Gyro& gyro);

/// By its wheels and its gyro, which the robot must have.
PairedSums turns_of_gyro(const Robot& robot, const AlignedReadings& readings);

/// Turns that can be compared; nothing where the robot hardly turns, or only one of the two sees it.
[[nodiscard]] std::optional<PairedSums> if_enough(const PairedSums& pairs);
std::optional<PairedSums> comparable_turns(const Recording& recording, const Robot& robot,
                                           const AlignedReadings& readings);

/// Whether gyro and wheels clearly turn opposite ways, which one of them must have wrong: turns much larger
/// than a bias would sum up to.
bool turns_contradict(const Recording& recording, const Robot& robot, const AlignedReadings& readings);

}  // namespace trundle::recording
