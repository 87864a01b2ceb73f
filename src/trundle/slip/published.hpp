#pragma once

#include "trundle/slip/parity.hpp"

namespace trundle::slip {

// Source 2's rule for two wheels and a gyro: docs/theory/slip-published.md, eq. 1 and 5.

/// Two wheels that roll forward on either side, with a gyro.
bool suits_published_method(const Parity& parity);
/// δ = (dR − dL)/B − g [rad].
double published_delta(const Contradiction& c, const Rows& rows);
/// |dR − dL| < 0.2 |dR + dL|.
bool is_nearly_straight(double left_m, double right_m);
/// The wheel that spins where δ is outside its band: forwards the right one above it and the left one below,
/// backwards the other way round.
int spinning_wheel(bool above, const Contradiction& c, const Rows& rows);

}  // namespace trundle::slip
