#pragma once

#include "trundle/simd/scalar.hpp"
#include "trundle/slam/fastslam/particle_landmark.hpp"

namespace trundle::slam {

// What the kernels do to many particles, for one of them: docs/theory/fastslam.md, eq. 12 and 13.

/// log p(reading) without −log 2π. Eq. 12.
[[nodiscard]] inline double log_likelihood_of(const Sight& s) {
  return -0.5 * (s.distance2 + scalar::log(s.determinant / (s.range * s.range)));
}

/// Eq. 13: P⁺ = P S⁻¹ R, which no rounding makes unsymmetric or indefinite.
inline void improve(LandmarkEstimate& m, const Sight& s) {
  const double along = s.p_along + s.r_along;
  const double across = s.p_across + s.r_across;
  const double inverse = 1.0 / s.determinant;
  const double minor = s.p_along * s.p_across - s.p_mixed * s.p_mixed;
  const double first = (across * s.along - s.p_mixed * s.across) * inverse;  // S⁻¹ ν
  const double second = (along * s.across - s.p_mixed * s.along) * inverse;
  const double move_along = s.p_along * first + s.p_mixed * second;
  const double move_across = s.p_mixed * first + s.p_across * second;
  const double aa = (minor + s.p_along * s.r_across) * s.r_along * inverse;
  const double ac = s.p_mixed * s.r_along * s.r_across * inverse;
  const double cc = (minor + s.p_across * s.r_along) * s.r_across * inverse;
  m.x += s.ux * move_along - s.uy * move_across;
  m.y += s.uy * move_along + s.ux * move_across;
  m.xx = aa * s.ux * s.ux - 2.0 * ac * s.ux * s.uy + cc * s.uy * s.uy;
  m.xy = (aa - cc) * s.ux * s.uy + ac * (s.ux * s.ux - s.uy * s.uy);
  m.yy = aa * s.uy * s.uy + 2.0 * ac * s.ux * s.uy + cc * s.ux * s.ux;
}

}  // namespace trundle::slam
