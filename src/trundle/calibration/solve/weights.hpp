#pragma once

#include "trundle/calibration/likelihood/likelihood.hpp"

namespace trundle::calibration {

/// Sets the noise levels, and with them the scale of what no motion explains.
void set_noise(const Robot& robot, const NoiseEstimate& noise, Likelihood& likelihood);

/// Finds the noise of all terms of the likelihood from what a robot leaves over of the runs.
/// docs/theory/calibration-noise.md.
void find_noise(const Robot& robot, Likelihood& likelihood);

}  // namespace trundle::calibration
