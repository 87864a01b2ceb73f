#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include "trundle/geometry/pose2.hpp"
#include "trundle/slam/merging/merge.hpp"

namespace trundle::slam {

inline constexpr double kLeastMapVariance =
    1e-12;                                   ///< [m²]: no landmark is known better than to a micrometre
inline constexpr int kMostMergeRounds = 20;  ///< of Gauss-Newton, which takes three or four

/// A landmark of one map that is one of another.
struct LandmarkMatch {
  std::size_t a = 0;
  std::size_t b = 0;
  friend bool operator==(const LandmarkMatch&, const LandmarkMatch&) = default;
};

/// Where the frame of map a lies in that of b, and which landmarks they share there.
struct SharedFrame {
  Pose2 b_from_a;
  std::vector<LandmarkMatch> matches = {};
  double log_likelihood =
      -std::numeric_limits<double>::infinity();  ///< against: no landmark of a is one of b
};

/// From pairs of landmarks as far apart in both maps, as far as a's metre_sigma allows beside that of b:
/// docs/theory/merge.md, eq. 30 to 32. (A few sightings among a map's landmarks are placed by such pairs too,
/// but weighed by densities of poses, as there is a motion to follow: docs/theory/global-localization.md.)
/// Throws CannotAnswer where none, or not one alone, explains what the two maps share.
[[nodiscard]] SharedFrame frame_between(const JointMap& a, const JointMap& b, const MergeOptions& options);

}  // namespace trundle::slam
