#pragma once

#include <span>

#include "trundle/slam/smoothing/calibration/landmark_fit.hpp"

namespace trundle::slam {

/// D: by how much each parameter that was found is off for each unit that the sensor's range scale, which
/// stays as given, is off; in their own units. docs/theory/motion-and-sensor.md, eq. 4a. Throws
/// CannotAnswer where sightings leave something undetermined.
[[nodiscard]] Eigen::VectorXd taken_along_by_range_scale(std::span<const AssociatedRecording> all,
                                                         const LandmarkFit& fit);

}  // namespace trundle::slam
