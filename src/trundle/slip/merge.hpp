#pragma once

#include <optional>

#include "trundle/chassis/chassis.hpp"

namespace trundle {

/// Adds increments up until they last long enough to be judged: the rounding errors of counts cancel within.
class IncrementMerger {
 public:
  explicit IncrementMerger(double interval_s) : interval_s_(interval_s) {}

  /// The merged interval, when this increment completes it. It has a gyro only where all its parts have.
  std::optional<Increment> add(const Increment& increment) {
    if (parts_ == 0) {
      merged_ = increment;
    } else {
      merged_.time_s = increment.time_s;
      merged_.duration_s += increment.duration_s;
      merged_.gyro_rad += increment.gyro_rad;
      merged_.has_gyro = merged_.has_gyro && increment.has_gyro;
      for (std::size_t i = 0; i < merged_.turned.size(); ++i) merged_.turned[i] += increment.turned[i];
    }
    ++parts_;
    // Half an increment early rather than half an increment late.
    if (merged_.duration_s + 0.5 * merged_.duration_s / parts_ < interval_s_ && parts_ < kMostParts)
      return std::nullopt;
    parts_ = 0;
    return merged_;
  }

  /// Forgets what was added since the last interval was complete.
  void reset() { parts_ = 0; }

  /// Increments that may be merged into one interval.
  static constexpr int kMostParts = 64;

 private:
  double interval_s_;
  int parts_ = 0;
  Increment merged_;
};

}  // namespace trundle
