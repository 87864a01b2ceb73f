#pragma once

#include "trundle/namespaces.hpp"

namespace trundle::slip {

enum class SlipKind {
  spin,      ///< the wheel runs ahead of the ground
  skid,      ///< it falls behind, or is locked
  stuck,     ///< wheels turn, nothing else moves
  sideways,  ///< a steered wheel does not roll where it is read to point: it skids that way, or is misread
  unknown,   ///< which it is depends on the wheel, and that is ambiguous; or on the angle of a steered one
};

inline constexpr int kAmbiguous = -1;
/// A slip is clear where noise alone makes less than this share of those that are as clear. Of twenty
/// recordings without slip, one has a clear one.
inline constexpr double kClearSlip = 0.05;
[[nodiscard]] constexpr bool is_clear(double by_chance) {
  return by_chance < kClearSlip;
}

/// A slip from its first interval to its last.
struct SlipEvent {
  double start_s = 0.0;
  double end_s = 0.0;
  int wheel = kAmbiguous;
  SlipKind kind = SlipKind::unknown;
  /// Wheel travel − ground travel, in the wheel's own direction; of the likeliest wheel. `sideways`: how
  /// far to the left of where the ground went the wheel is read to have rolled.
  double excess_m = 0.0;
  double excess_sigma_m = 0.0;  ///< 1σ, if it was that wheel
  double confidence = 0.0;      ///< posterior probability of that wheel
};

}  // namespace trundle::slip
