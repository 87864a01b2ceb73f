#pragma once

#include <algorithm>

#include "trundle/namespaces.hpp"

namespace trundle::slip {

/// Adds up evidence of one sign over intervals [Page 1954]: finds small slip that no single interval shows.
/// docs/theory/slip-detection.md, eq. 10.
struct Cusum {
  double sum = 0.0;

  /// `score` is N(0, 1) when nothing slips; `allowance` is what it must exceed to count.
  double step(double score, double allowance) { return sum = std::max(0.0, sum + score - allowance); }

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.sum);
  }
};

/// What a score must exceed to count: half the shift that is to be found soonest (one sigma).
inline constexpr double kCusumAllowance = 0.5;

/// The limit h at which a sum alarms once in `intervals` on average when nothing slips [Siegmund 1985].
double cusum_limit(double intervals, double allowance = kCusumAllowance);

}  // namespace trundle::slip
