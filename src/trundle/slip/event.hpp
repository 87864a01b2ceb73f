#pragma once

#include "trundle/namespaces.hpp"

namespace trundle::slip {

enum class SlipKind {
  spin,     ///< the wheel runs ahead of the ground
  skid,     ///< it falls behind, or is locked
  stuck,    ///< wheels turn, nothing else moves
  unknown,  ///< which it is depends on the wheel, and that is ambiguous
};

inline constexpr int kAmbiguous = -1;

/// A slip from its first interval to its last.
struct SlipEvent {
  double start_s = 0.0;
  double end_s = 0.0;
  int wheel = kAmbiguous;
  SlipKind kind = SlipKind::unknown;
  /// Wheel travel − ground travel, in the wheel's own direction; of the likeliest wheel.
  double excess_m = 0.0;
  double excess_sigma_m = 0.0;  ///< 1σ, if it was that wheel
  double confidence = 0.0;      ///< posterior probability of that wheel
};

}  // namespace trundle::slip
