#pragma once

#include <optional>
#include <span>

#include "trundle/geometry/pose2.hpp"

namespace trundle::report {

/// An ellipse in the plane.
struct Ellipse {
  Vector2 centre = Vector2::Zero();  ///< [m]
  double semi_major_m = 0.0;
  double semi_minor_m = 0.0;
  double angle_rad = 0.0;  ///< of the major axis, in (−π/2, π/2]
};

/// The ellipse in which a Gaussian point lies with 95 % probability: (x − mean)ᵀ Σ⁻¹ (x − mean) ≤ χ²₀.₉₅(2).
Ellipse error_ellipse95(const Vector2& mean, const Matrix2& covariance);

/// The fewest points that get an ellipse: below, it would be larger than any picture of them.
inline constexpr int kFewestForEllipse = 5;

/// Points, where their centre is, and where further ones of their kind are to be expected.
struct Scatter {
  int count = 0;
  Vector2 centroid = Vector2::Zero();  ///< [m]; zero without points
  /// A further point falls inside with 95 % probability, if the points are Gaussian. Nothing below
  /// kFewestForEllipse points.
  std::optional<Ellipse> ellipse95;
};

/// The prediction ellipse: mean, sample covariance S and (x − mean)ᵀ S⁻¹ (x − mean) ≤ c² with
/// c² = 2 (n − 1)(n + 1) / (n (n − 2)) · F₀.₉₅(2, n − 2): Hotelling's, not χ², for n is small.
Scatter scatter_of(std::span<const Vector2> points);

}  // namespace trundle::report
