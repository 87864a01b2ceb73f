#pragma once

#include <functional>
#include <span>

#include "trundle/calibration/noise/level_search.hpp"
#include "trundle/calibration/problem/noise_levels.hpp"
#include "trundle/calibration/problem/run.hpp"

namespace trundle::calibration {

/// The variance components. Where headings are the wheels' and the reference shows them, the wheels' noise by
/// how differences of headings grow (growth.hpp, eq. 8); else, with all others, by what makes the innovations
/// likeliest (eq. 8c). Runs of few epochs: by the likelihood of displacements (learn_noise.hpp, eq. 9 and
/// 10). docs/theory/calibration-noise.md. `robot` should already be calibrated roughly, by the parameters
/// `fitted`. What was found `before`, of nearly the same robot, is where it is looked for. `restriction`
/// makes what −2 log of the likelihood of levels grows by when the parameters are integrated over (eq. 8d).
[[nodiscard]] NoiseEstimate estimate_noise(std::span<const Run> runs, const Robot& robot,
                                           std::span<const Parameter> fitted, const NoiseEstimate& before,
                                           const std::function<Deviance()>& restriction);

}  // namespace trundle::calibration
