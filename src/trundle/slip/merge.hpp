#pragma once

#include <optional>

#include "trundle/chassis/contact.hpp"
#include "trundle/odometry/persist.hpp"

namespace trundle::slip {

/// The next increment in one with those before it.
inline void append(const Increment& next, Increment& sum) {
  sum.time_s = next.time_s;
  add_readings(sum, next);
  sum.has_gyro = sum.has_gyro && next.has_gyro;
  sum.steering_rad = next.steering_rad;
}

/// Adds increments up until they last long enough to be judged: the rounding errors of counts cancel within.
class IncrementMerger {
 public:
  IncrementMerger(const Chassis& chassis, double interval_s) : interval_s_(interval_s) {
    if (has_steered_encoders(chassis)) steered_ = Steered{chassis, {}};
  }

  /// The merged interval, when this increment completes it. It has a gyro only where all its parts have.
  std::optional<Increment> add(const Increment& increment) {
    const double turn_rate = increment.duration_s > 0.0 ? increment.gyro_rad / increment.duration_s : 0.0;
    if (parts_ == 0) {
      merged_ = increment;
      first_turn_rate_ = turn_rate;
    } else {
      append(increment, merged_);
    }
    if (steered_) {
      if (parts_ == 0) steered_->contacts = {};
      add_interval(steered_->chassis, increment, steered_->contacts);
    }
    ++parts_;
    turn_rate_change_ = turn_rate - first_turn_rate_;
    // Half an increment early rather than half an increment late.
    if (merged_.duration_s + 0.5 * merged_.duration_s / parts_ < interval_s_) return std::nullopt;
    parts_ = 0;
    return merged_;
  }

  /// How much the turn rate changed within the last interval, as the gyro reads it [rad/s].
  double turn_rate_change() const { return turn_rate_change_; }
  /// Of steered wheels, over the last interval; nothing where none with an encoder is.
  std::optional<ContactMotions> contacts() const {
    return steered_ ? std::optional(steered_->contacts) : std::nullopt;
  }

  /// Forgets what was added since the last interval was complete.
  void reset() { parts_ = 0; }

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.parts_, self.first_turn_rate_, self.turn_rate_change_);
    persist_increment(archive, self.merged_);
    if (self.steered_) archive(self.steered_->contacts);
  }

 private:
  struct Steered {
    Chassis chassis;
    ContactMotions contacts;
  };

  double interval_s_;
  int parts_ = 0;
  double first_turn_rate_ = 0.0;
  double turn_rate_change_ = 0.0;
  Increment merged_;
  std::optional<Steered> steered_;
};

}  // namespace trundle::slip
