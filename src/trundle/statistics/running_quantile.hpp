#pragma once

#include <algorithm>
#include <cstdint>

#include "trundle/namespaces.hpp"

namespace trundle::statistics {

/// The level that a given share of positive values exceeds, followed value by value in one number: each value
/// above it raises it, each value below it lowers it, in the ratio that balances at that share [Robbins &
/// Monro 1951]. It follows what changes within some twenty values above it.
class RunningQuantile {
 public:
  explicit RunningQuantile(double share_above) : share_above_(share_above) {}

  void add(double value) {
    ++count_;
    if (count_ == 1) {
      level_ = value;
      return;
    }
    const double gain = std::max(kLeastGain, 1.0 / static_cast<double>(count_));
    level_ *= 1.0 + gain * ((value > level_ ? 1.0 : 0.0) - share_above_);
  }

  [[nodiscard]] std::uint64_t count() const { return count_; }
  /// 0 before the first value.
  [[nodiscard]] double level() const { return level_; }

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.count_, self.level_);
  }

 private:
  static constexpr double kLeastGain = 0.05;  // of its level, for a value above it

  double share_above_;
  std::uint64_t count_ = 0;
  double level_ = 0.0;
};

}  // namespace trundle::statistics
