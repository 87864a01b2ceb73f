#pragma once

#include "trundle/slip/parity.hpp"

namespace trundle::slip {

/// −2 log likelihoods of how the wheels roll in an interval of a slip. docs/theory/slip-wheel.md, eq. 9 and
/// 9a.
struct MotionMisfit {
  PerFault goes_on{};     ///< this fault, and the robot moves on as before
  double changes = 0.0;   ///< the robot takes another speed, whatever the fault; once for a slip
  double whatever = 0.0;  ///< and in each interval that does: any motion fits as well as the true one
};

/// How each wheel has rolled lately: where the motion is steady, the change of a wheel against its own recent
/// travel says which of two wheels slips although the residual cannot. docs/theory/slip-wheel.md, eq. 9.
class RecentTravel {
 public:
  /// An interval in which nothing slipped.
  void add(const Contradiction& interval, double duration_s, std::size_t wheels);
  /// One in which something slips, or may: nothing is learned, and what is expected of the next is less sure.
  void pass() { ++passed_; }
  /// What was before is no guide: the command changed, or the robot took another speed. `slows`: the motors
  /// brake.
  void forget(bool slows = false) {
    intervals_ = passed_ = 0;
    slows_ = slows;
  }
  /// That the motors push in this interval, and do not brake: the wheels slow down by less than a robot that
  /// coasts. docs/theory/slip-wheel.md, eq. 17.
  double push_probability(const Contradiction& interval, double duration_s, std::size_t wheels) const;

  /// Enough intervals to compare with.
  bool known() const { return intervals_ >= kLeast; }

  /// A wheel's change [m] and its sigma.
  struct Change {
    double value = 0.0;
    double sigma = 1.0;
  };
  Change change(std::size_t wheel, const Contradiction& interval, double duration_s) const;
  double expected(std::size_t wheel, double duration_s) const { return rate_[wheel] * duration_s; }

  MotionMisfit misfit(const Faults& faults, const Contradiction& interval, double duration_s,
                      std::size_t wheels) const;

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.intervals_, self.passed_, self.rate_, self.variance_, self.slows_);
  }

 private:
  /// A wheel slips by its excess, or rolls sideways, and all else goes on as before: eq. 9.
  double misfit(const Fault& fault, const Contradiction& interval, double duration_s,
                std::size_t wheels) const;
  /// By how much the variance of a change grows with the intervals that were passed: smoothing with a gain K
  /// is the Kalman filter of a speed that wanders by K² of that variance in each.
  double growth() const { return 1.0 + passed_ * kGain * kGain; }
  /// The robot took another speed.
  bool jumps(const Contradiction& interval, double duration_s, std::size_t wheels) const;
  /// Mean change of the wheels' travel along their motion [m].
  Change mean_change(const Contradiction& interval, double duration_s, std::size_t wheels) const;

  static constexpr int kLeast = 3;
  static constexpr int kMemory = 8;
  static constexpr double kGain = 0.5;     ///< of the latest interval: speeds drift
  static constexpr double kJump = 4.0;     ///< sigmas
  static constexpr double kRipple = 0.05;  ///< of its travel, by which a wheel's speed may vary at any time

  int intervals_ = 0;
  int passed_ = 0;       ///< since the last that was added
  PerWheel rate_{};      ///< smoothed [m/s]
  PerWheel variance_{};  ///< of an interval's travel about what was expected of it [m²]
  bool slows_ = false;   ///< the motion changed to a slower one, and is not known yet
};

}  // namespace trundle::slip
