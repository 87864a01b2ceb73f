#pragma once

#include <numbers>
#include <span>
#include <vector>

#include "trundle/slam/association/existence.hpp"

namespace trundle::slam {

/// How well one observation matches one landmark of a map.
struct Fit {
  LandmarkId landmark = kUnknownLandmark;
  double nis = 0.0;              ///< squared innovation in its covariance
  double minus_two_log_p = 0.0;  ///< −2 log of the reading's density, (range, bearing) [m, rad]
};

/// Association of the sightings of one instant that have no id. docs/theory/association.md.
struct AssociationOptions {
  double gate = 9.2103403719761836;  ///< NIS of a match is at most this: 99 % of the consistent ones, χ²₂
  double max_range_m = 10.0;         ///< of the sensor: a new landmark may be anywhere up to it
  double new_share = 1.0;            ///< so many of the sightings are expected to show a new one
  /// What is outside the gate of a landmark but within this times it is ambiguous, not new: 99.99 % of the
  /// consistent ones are within twice the gate.
  double near = 2.0;
};

/// What an observation shows: a landmark of the map; a new one; or near one, yet outside of its gate.
enum class Association { matched, new_landmark, ambiguous };

/// Of one observation.
struct Associated {
  Association kind = Association::ambiguous;
  LandmarkId landmark = kUnknownLandmark;  ///< where matched
};

/// −2 log of the density of a reading that shows a new landmark, anywhere in the sensor's range.
[[nodiscard]] double cost_of_new(const AssociationOptions& options);

/// Two landmarks of a map that are one are as far apart as their places err: 5 σ of each.
inline constexpr double kDuplicateSigmas = 5.0 * std::numbers::sqrt2;
/// −2 log of the density of a place [m²] that may be anywhere in the sensor's range: above it two landmarks
/// are two, docs/theory/re-association.md, eq. 15.
[[nodiscard]] double cost_of_any_place(double max_range_m);

/// −2 log of a normal density of (range, bearing) where it is highest; S: its covariance.
[[nodiscard]] double cost_at_peak(const Matrix2& S);

/// Which landmark each of the observations of one instant shows: the most probable explanation of all of them
/// together in which no landmark is seen twice. `fits` lists for each observation the landmarks that are not
/// hopeless. docs/theory/association.md, eq. 21.
[[nodiscard]] std::vector<Associated> associate(const std::vector<std::vector<Fit>>& fits,
                                                const AssociationOptions& options);

}  // namespace trundle::slam
