#pragma once

#include <algorithm>

#include "trundle/statistics/running_quantile.hpp"

namespace trundle::recording {

/// What a stream's steps usually last, and from what length on one is a gap: longer than five usual steps,
/// the median of those so far, and than a least length.
class UsualStep {
 public:
  explicit UsualStep(double shortest_gap_s) : shortest_gap_s_(shortest_gap_s) {}

  void add(double step_s) { median_s_.add(step_s); }
  [[nodiscard]] double longest_s() const { return std::max(shortest_gap_s_, 5.0 * median_s_.level()); }

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.median_s_);
  }

 private:
  double shortest_gap_s_;
  RunningQuantile median_s_{0.5};
};

}  // namespace trundle::recording
