#include "trundle/calibration/likelihood/chassis_likelihood.hpp"

#include "trundle/calibration/likelihood/parity_windows.hpp"
#include "trundle/geometry/decompositions.hpp"

namespace trundle::calibration {

void add_to(Information& information, const Contradiction& window, const ChassisLikelihoodOptions& options) {
  const Eigen::MatrixXd W = inverse_of((options.variance_factor * window.S).eval());
  if (add_within(information, window.J, W, window.y, options.gate) && options.with_noise)
    information.add_noise(information_of_noise(W, window.J_errors));
}

std::vector<Information> chassis_likelihood(const Run& run, const Robot& robot,
                                            std::span<const Parameter> parameters,
                                            const ChassisLikelihoodOptions& options) {
  std::vector<Information> result(static_cast<std::size_t>(options.blocks),
                                  Information::zero(static_cast<Eigen::Index>(parameters.size())));
  ParityWindows windows(run, robot.chassis, robot.chassis, parameters, kParityWindow_s, options.sums,
                        options.with_noise);
  const std::size_t increments = run.readings.increments.size();
  for (std::size_t i = 0; i < increments; ++i)
    if (const auto window = windows.take()) add_to(result[i * result.size() / increments], *window, options);
  return result;
}

}  // namespace trundle::calibration
