#pragma once

#include <cmath>

#include "trundle/geometry/pose2.hpp"
#include "trundle/odometry/motion_model.hpp"
#include "trundle/simd/scalar.hpp"

namespace trundle::odometry {

// One arc at any angle: the kernels' arithmetic where it holds, the library's elsewhere.

using Chord = scalar::Chord<double>;

inline scalar::SinCos<double> sin_cos_of(double angle) {
  if (std::abs(angle) <= kLargestAngle) return scalar::sin_cos(angle);
  return {std::sin(angle), std::cos(angle)};
}

inline double half_sinc_of(double half_turn) {
  return std::abs(half_turn) <= kLargestHalfTurn ? scalar::sinc_of_small(half_turn) : sinc(half_turn);
}

inline double half_sinc_derivative_of(double half_turn) {
  return std::abs(half_turn) <= kLargestHalfTurn ? scalar::sinc_slope_of_small(half_turn)
                                                 : sinc_derivative(half_turn);
}

/// pose · exp(twist), eq. 3.
inline Pose2 moved(const Pose2& pose, const std::array<double, 3>& twist) {
  const double half = 0.5 * twist[2];
  const Chord chord =
      scalar::chord_of(twist[0], twist[1], sin_cos_of(pose.heading + half), half_sinc_of(half));
  return {pose.x + chord.x, pose.y + chord.y, pose.heading + twist[2]};
}

/// The same with its derivatives in world axes, eq. 4: by the old pose (F) and by the twist (G).
class ArcStep {
 public:
  ArcStep(double heading, const Triple& twist) {
    const double half = 0.5 * twist[2];
    const scalar::SinCos<double> middle = sin_cos_of(heading + half);
    const double sinc = half_sinc_of(half);
    chord_ = scalar::chord_of(twist[0], twist[1], middle, sinc);
    along_ = sinc * middle.cos;
    across_ = sinc * middle.sin;
    const Chord bent = scalar::chord_of(twist[0], twist[1], middle, half_sinc_derivative_of(half));
    by_turn_ = {0.5 * (bent.x - chord_.y), 0.5 * (bent.y + chord_.x)};
  }

  /// Displacement.
  const Chord& chord() const { return chord_; }
  /// F v and G v of one vector, or of several at once: Real = double or lanes of it.
  template <class Real>
  struct Vectors {
    Real x, y, h;
  };
  template <class Real>
  TRUNDLE_INLINE Vectors<Real> carry(const Vectors<Real>& v) const {
    return {v.x - chord_.y * v.h, v.y + chord_.x * v.h, v.h};
  }
  template <class Real>
  TRUNDLE_INLINE Vectors<Real> map(const Vectors<Real>& v) const {
    return {along_ * v.x - across_ * v.y + by_turn_.x * v.h, across_ * v.x + along_ * v.y + by_turn_.y * v.h,
            v.h};
  }
  Triple carry(const Triple& v) const { return triple(carry(Vectors<double>{v[0], v[1], v[2]})); }
  Triple map(const Triple& v) const { return triple(map(Vectors<double>{v[0], v[1], v[2]})); }
  /// F P Fᵀ + G Q Gᵀ
  Symmetric3 carry(const Symmetric3& P, const Symmetric3& Q) const {
    const auto& [xx, xy, xh, yy, yh, hh] = P;
    const double new_xh = xh - chord_.y * hh;
    const double new_yh = yh + chord_.x * hh;
    const Triple gx = {along_, -across_, by_turn_.x};  // rows of G
    const Triple gy = {across_, along_, by_turn_.y};
    const Triple gxQ = times(gx, Q);
    const Triple gyQ = times(gy, Q);
    return {xx - chord_.y * (xh + new_xh) + dot(gxQ, gx),
            xy + chord_.x * new_xh - chord_.y * yh + dot(gxQ, gy),
            new_xh + gxQ[2],
            yy + chord_.x * (yh + new_yh) + dot(gyQ, gy),
            new_yh + gyQ[2],
            hh + Q[5]};
  }

 private:
  static Triple triple(const Vectors<double>& v) { return {v.x, v.y, v.h}; }
  static Triple times(const Triple& v, const Symmetric3& Q) {
    return {dot(v, {Q[0], Q[1], Q[2]}), dot(v, {Q[1], Q[3], Q[4]}), dot(v, {Q[2], Q[4], Q[5]})};
  }

  Chord chord_;
  double along_;
  double across_;
  Chord by_turn_;  ///< ∂chord/∂θ
};

}  // namespace trundle::odometry
