#include "trundle/slip/published.hpp"

#include <cmath>

namespace trundle::slip {
namespace {

constexpr double kStraight = 0.2;  // |dL − dR| / |dL + dR|: arcs of more than 2.5 tracks of radius

}  // namespace

bool suits_published_method(const Parity& parity) {
  if (parity.wheels() != 2 || !parity.uses_gyro() || parity.is_steered()) return false;
  const RowMatrix& H = parity.rows().H;
  const auto forward = [&](int i) { return std::abs(H(i, 0) - 1.0) < 1e-9 && std::abs(H(i, 1)) < 1e-9; };
  return forward(0) && forward(1) && H(0, 2) != H(1, 2);
}

double published_delta(const Contradiction& c, const Rows& rows) {
  return (c.travel[1] - c.travel[0]) / (rows.H(1, 2) - rows.H(0, 2)) - c.gyro_rad;
}

bool is_nearly_straight(double left_m, double right_m) {
  return std::abs(right_m - left_m) < kStraight * std::abs(right_m + left_m);
}

int spinning_wheel(bool above, const Contradiction& c, const Rows& rows) {
  const int right = rows.H(1, 2) > rows.H(0, 2) ? 1 : 0;
  const bool forward = c.travel[0] + c.travel[1] > 0.0;
  return above == forward ? right : 1 - right;
}

}  // namespace trundle::slip
