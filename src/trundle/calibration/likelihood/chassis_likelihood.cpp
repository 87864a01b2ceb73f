#include "trundle/calibration/likelihood/chassis_likelihood.hpp"

#include "trundle/calibration/likelihood/parity_windows.hpp"
#include "trundle/geometry/decompositions.hpp"

namespace trundle::calibration {

void add_to(Information& information, const Contradiction& window, const ChassisLikelihoodOptions& options) {
  add_within(information, window.J, inverse_of((options.variance_factor * window.S).eval()), window.y,
             options.gate);
}

std::vector<Information> chassis_likelihood(const Run& run, const Robot& robot,
                                            std::span<const Parameter> parameters,
                                            const ChassisLikelihoodOptions& options) {
  std::vector<Information> result(static_cast<std::size_t>(options.blocks),
                                  Information::zero(static_cast<Eigen::Index>(parameters.size())));
  ParityWindows windows(run, robot.chassis, parameters, options.window_s, options.sums);
  const std::size_t increments = run.readings.increments.size();
  for (std::size_t i = 0; i < increments; ++i)
    if (const auto window = windows.take()) add_to(result[i * result.size() / increments], *window, options);
  return result;
}

}  // namespace trundle::calibration
