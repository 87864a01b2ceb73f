#pragma once

#include <span>
#include <vector>

#include "trundle/slam/observation.hpp"

namespace trundle {

/// How well one observation fits one landmark of a map.
struct Fit {
  LandmarkId landmark = kUnknownLandmark;
  double nis = 0.0;              ///< squared innovation in its covariance
  double minus_two_log_p = 0.0;  ///< −2 log of the reading's density, (range, bearing) [m, rad]
};

struct AssociationOptions {
  double gate = 0.0;          ///< NIS of a match is at most this
  double max_range_m = 10.0;  ///< of the sensor: a new landmark may be anywhere up to it
  double doubt = 2.0;  ///< a sighting within doubt · gate of a landmark, but matched to none, is no new one
};

enum class Association { matched, fresh, doubtful };

struct Associated {
  Association kind = Association::doubtful;
  LandmarkId landmark = kUnknownLandmark;  ///< where matched
};

/// Which landmark each of the observations of one instant shows: the most probable explanation of all of them
/// together in which no landmark is seen twice. `fits` lists for each observation the landmarks that are not
/// hopeless. docs/slam.md, eq. 21.
std::vector<Associated> associate(const std::vector<std::vector<Fit>>& fits,
                                  const AssociationOptions& options);

}  // namespace trundle
