#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "trundle/calibration/result.hpp"
#include "trundle/geometry/trajectory.hpp"
#include "trundle/slam/report.hpp"

// The last look at a result before it is told: no number is written that is none or that no robot has, and no
// variance that cannot be one. Each throws CannotAnswer and says what is wrong and when; `what` names the
// result.
namespace trundle::pipeline {

void require_sound(const Trajectory& trajectory, std::string_view what);
void require_sound(const StampedPose& pose, const Matrix3& covariance, std::string_view what);
void require_sound(const std::vector<MappedLandmark>& map, std::string_view what);
/// Parameters are numbers that such a robot can have, and so are their sigmas.
void require_sound(const CalibrationResult& calibration);

}  // namespace trundle::pipeline
