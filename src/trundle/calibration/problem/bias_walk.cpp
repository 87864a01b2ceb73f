#include "trundle/calibration/problem/bias_walk.hpp"

#include <algorithm>
#include <cmath>

#include "trundle/geometry/angle.hpp"

namespace trundle::calibration {
namespace {

// Harmonics are taken up to twice the frequency at which the walk's spectrum, (w/2πf)², is the noise's, N²:
// beyond, it adds less than a quarter to it.
constexpr double kBeyondNoise = 2.0;
// Of a gyro said to be without noise: what they leave of the walk's mean square is 1 − 6/π² Σ 1/k² = 2 %.
constexpr double kMostHarmonics = 30.0;

}  // namespace

Eigen::RowVectorXd BiasWalk::at(double time_s) const {
  const double phase = kPi * (time_s - start_s) / duration_s;
  Eigen::RowVectorXd sigmas(harmonics);
  for (Eigen::Index i = 0; i < harmonics; ++i) {
    const auto k = static_cast<double>(i + 1);
    sigmas[i] = walk * std::sqrt(2.0 * duration_s) / (k * kPi) * std::cos(k * phase);
  }
  return sigmas;
}

BiasWalk bias_walk_of(const Gyro& gyro, double start_s, double end_s) {
  const double duration_s = end_s - start_s;
  const double walk = gyro.bias_walk_rad_s_sqrt_s, noise = gyro.noise_rad_s_sqrt_hz;
  if (!(walk > 0.0) || !(duration_s > 0.0)) return {};
  // The k-th has the frequency k/2T.
  const double above_noise = kBeyondNoise * walk * duration_s / (kPi * noise);
  return {start_s, duration_s, walk, static_cast<Eigen::Index>(std::min(above_noise, kMostHarmonics))};
}

}  // namespace trundle::calibration
