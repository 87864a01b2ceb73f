#pragma once

#include <span>

#include "trundle/calibration/likelihood/contradiction.hpp"
#include "trundle/calibration/likelihood/information.hpp"
#include "trundle/calibration/likelihood/window_sums.hpp"
#include "trundle/calibration/problem/run.hpp"
#include "trundle/chassis/parameter.hpp"

namespace trundle::calibration {

struct ChassisLikelihoodOptions {
  int blocks = 1;                ///< into which the run is cut, one Information for each
  double variance_factor = 1.0;  ///< by which the readings' variances are scaled
  double gate = 1e300;           ///< windows whose squared Mahalanobis residual is larger are left out
  bool with_noise = false;       ///< also Information::of_noise
  /// window_sums() of the run over kParityWindow_s, where they are known already.
  const WindowSums* sums = nullptr;
};

/// One window of it.
void add_to(Information& information, const Contradiction& window, const ChassisLikelihoodOptions& options);

/// What the sensors on board say about each other: the part of their readings that no motion of the chassis
/// explains, summed over windows. Needs no reference; empty where rows and unknowns are
/// equal in number. `robot`: with_noise_of_readings(). docs/theory/calibration.md.
std::vector<Information> chassis_likelihood(const Run& run, const Robot& robot,
                                            std::span<const Parameter> parameters,
                                            const ChassisLikelihoodOptions& options);

}  // namespace trundle::calibration
