#include "trundle/calibration/solve/weights.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include "trundle/calibration/likelihood/relative_likelihood.hpp"
#include "trundle/calibration/likelihood/restricted_likelihood.hpp"
#include "trundle/calibration/noise/estimate_noise.hpp"
#include "trundle/calibration/solve/contradicting_share.hpp"

namespace trundle::calibration {
namespace {

constexpr std::array kLongerWindows_s = {4.0 * kParityWindow_s, 16.0 * kParityWindow_s};

/// By how many numbers residuals were fitted: of what the reference shows at some levels, and of what the
/// readings contradict each other by, which is scaled to what it is by whatever levels. Eq. 8d.
Deviance restriction_by(const Robot& robot, const Likelihood& likelihood) {
  Likelihood of_reference = likelihood;
  of_reference.takes_out_noise = false;
  std::vector<Information> of_redundancy;
  for (std::size_t i = 0; i < likelihood.runs().size(); ++i)
    of_redundancy.push_back(redundancy_information(of_reference, i, robot));
  of_reference.uses_redundancy = false;
  return [=](const NoiseLevels& levels) mutable {
    of_reference.noise = {levels, true};
    RunsInformation runs = information_of_runs(of_reference, robot);
    for (std::size_t i = 0; i < of_redundancy.size(); ++i) runs.information[i].add(of_redundancy[i]);
    return restriction(runs).log_determinant;
  };
}

}  // namespace

void set_noise(const Robot& robot, const NoiseEstimate& noise, Likelihood& likelihood) {
  likelihood.noise = noise;
  const auto found = contradicting_share(likelihood, robot, kParityWindow_s).value_or(ContradictingShare{});
  likelihood.contradicting_share = found.share;
  likelihood.redundancy_factor = found.factor;
}

void find_noise(const Robot& robot, Likelihood& likelihood) {
  set_noise(robot,
            estimate_noise(likelihood.runs(), robot, likelihood.problem.parameters, likelihood.noise,
                           [&] { return restriction_by(robot, likelihood); }),
            likelihood);
  // Errors that last for several windows (scrubbing, rollers) teach less than the number of windows suggests:
  // summed over longer windows they are larger than independent ones would be.
  for (const double window_s : kLongerWindows_s)
    if (const auto found = contradicting_share(likelihood, robot, window_s)) {
      likelihood.contradicting_share = std::max(likelihood.contradicting_share, found->share);
      likelihood.redundancy_factor = std::max(likelihood.redundancy_factor, found->factor);
    }
  for (std::size_t i = 0; i < likelihood.runs().size(); ++i) {
    const auto residuals =
        relative_residuals(likelihood.runs()[i], robot, likelihood.problem.parameters).residual;
    if (!residuals.empty()) likelihood.relative_covariance[i] = robust_covariance(residuals);
  }
}

}  // namespace trundle::calibration
