#pragma once

#include <optional>
#include <vector>

#include "trundle/slam/localization/pose_fit.hpp"
#include "trundle/slam/localization/sighted_pairs.hpp"

namespace trundle::slam {

/// The frame whose x axis points from one place to another.
struct Baseline {
  Vector2 origin;
  Vector2 x_axis;

  /// The origin divides the baseline in this ratio.
  [[nodiscard]] static Baseline between(const Vector2& from, const Vector2& to, double share) {
    return {from + share * (to - from), (to - from).normalized()};
  }
  [[nodiscard]] Vector2 operator*(const Vector2& p) const {
    return origin + p.x() * x_axis + p.y() * Vector2(-x_axis.y(), x_axis.x());
  }
  [[nodiscard]] Vector2 coordinates_of(const Vector2& p) const {
    const Vector2 apart = p - origin;
    return {x_axis.dot(apart), x_axis.x() * apart.y() - x_axis.y() * apart.x()};
  }
};

/// What two landmarks say of the other points, if they are what a pair of points shows:
/// docs/theory/global-localization.md, eq. 49a.
struct PairPrediction {
  struct Expected {
    std::size_t point;
    Vector2 at;       ///< on the baseline's frame
    double radius_m;  ///< no landmark further away passes the gate
  };
  std::vector<Expected> others;  ///< those that are expected best first
  double share;                  ///< of the baseline: where the frame has its origin
  double log_most;               ///< of the pair's weight, log Z, were there one pose alone
};

/// Nothing where two landmarks as far apart determine no pose.
[[nodiscard]] std::optional<PairPrediction> prediction_of(const SightedPair& pair, const LocalMap& seen,
                                                          const KnownMap& map,
                                                          const MapSightOptions& options);

/// How far from where a point should be [m] a landmark may lie that passes the gate (of NIS).
[[nodiscard]] double gate_radius(const PoseEstimate& pose, const PointInnovation& innovation, double gate);

}  // namespace trundle::slam
