#pragma once

#include <span>
#include <string>
#include <vector>

#include "trundle/calibration/result.hpp"

namespace trundle::calibration {

/// Which parameters are elsewhere than the calibration that the robot file holds leaves them, by more than
/// both sigmas explain, in words. No residual shows slip that lasts through all runs, or that all wheels
/// share: only this does. Empty: none, or the robot was not calibrated before.
[[nodiscard]] std::vector<std::string> changed_since(const Robot& given,
                                                     std::span<const ParameterEstimate> parameters);

}  // namespace trundle::calibration
