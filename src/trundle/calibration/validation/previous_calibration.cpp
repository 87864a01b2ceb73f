#include "trundle/calibration/validation/previous_calibration.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "trundle/io/words.hpp"

namespace trundle::calibration {
namespace {

constexpr double kChanged = 3.0;  // sigmas of the difference: by chance in one of 370

/// Without what is held, which two calibrations of one robot file share.
double sigma_of(const auto& parameter) {
  return std::hypot(parameter.sigma_within, parameter.sigma_between.value_or(0.0));
}

}  // namespace

std::vector<std::string> changed_since(const Robot& given, std::span<const ParameterEstimate> parameters) {
  std::vector<std::string> words;
  if (!given.calibration) return words;
  for (const ParameterEstimate& now : parameters) {
    const auto before =
        std::ranges::find(given.calibration->parameters, now.name, &CalibratedParameter::name);
    if (before == given.calibration->parameters.end() || !before->observable || !now.observable) continue;
    const double sigmas = std::abs(now.value - before->value) / std::hypot(sigma_of(now), sigma_of(*before));
    if (!(sigmas > kChanged)) continue;
    words.push_back(fmt::format(
        "{} {} is {:.1f} σ off the calibration in the robot file, {}: tyres, load or floor have changed, or "
        "wheels slipped all through these runs, which passes for their diameters and the track",
        now.name, with_sigma(now.value, sigma_of(now)), sigmas,
        with_sigma(before->value, sigma_of(*before))));
  }
  return words;
}

}  // namespace trundle::calibration
