#pragma once

#include <optional>
#include <span>

#include "trundle/slam/models/observation.hpp"

namespace trundle::slam {

/// A landmark where the robot sees it, and where a map has it. Their errors are independent.
struct PointMatch {
  Vector2 in_body = Vector2::Zero();             ///< [m], in the frame of the body that saw it
  Matrix2 in_body_covariance = Matrix2::Zero();  ///< [m²], of the reading, and of the motion since
  Vector2 in_map = Vector2::Zero();              ///< [m]
  Matrix2 in_map_covariance = Matrix2::Zero();   ///< [m²]
};

/// What a match says of the body's pose p in the map, linearised there.
/// docs/theory/global-localization.md, eq. 47.
struct PointInnovation {
  Vector2 residual;  ///< seen less expected, in the body's frame [m]
  Matrix23 H;        ///< derivative of the expected place by (x, y, heading) in the map's axes
  Matrix2 noise;     ///< covariance of the residual where the pose is exact [m²]
};
[[nodiscard]] PointInnovation point_innovation(const Pose2& map_from_body, const PointMatch& match);

/// The pose that explains matches together.
struct PoseFit {
  Pose2 map_from_body;
  Matrix3 covariance = Matrix3::Zero();  ///< of (x, y, heading) in the map's axes
  /// What remains of the residuals squared in their covariance: χ² with two degrees of freedom for each
  /// match, less three.
  double misfit = 0.0;
  double log_noise = 0.0;  ///< Σ log |noise| over the matches: their density's scale
};

/// The most probable pose of a body that is nowhere known, by weighted least squares: Gauss–Newton from the
/// rigid alignment of all matches. Nothing where they do not determine a pose: fewer than two, or all in one
/// place. docs/theory/global-localization.md, eq. 47, 48.
[[nodiscard]] std::optional<PoseFit> fit_pose(std::span<const PointMatch> matches);

}  // namespace trundle::slam
