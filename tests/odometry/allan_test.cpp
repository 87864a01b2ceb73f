#include "trundle/odometry/allan.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "trundle/odometry/gyro_noise.hpp"
#include "trundle/statistics/random.hpp"

#include "scale.hpp"

namespace trundle::odometry {
namespace {

/// A gyro at rest: white noise of this density and a bias that walks.
std::vector<double> at_rest(std::size_t samples, double rate_hz, double N, double K, std::uint64_t seed) {
  Random noise(seed, 1);
  Random walk(seed, 2);
  std::vector<double> rates;
  double bias = 0.02;
  for (std::size_t i = 0; i < samples; ++i) {
    bias += walk.normal(K / std::sqrt(rate_hz));
    rates.push_back(bias + noise.normal(N * std::sqrt(rate_hz)));
  }
  return rates;
}

TEST(Allan, ByTheDefinition) {
  // Means over windows of m samples, differences of neighbouring windows, at every place.
  const std::vector<double> samples = at_rest(200, 10.0, 1e-3, 1e-3, 1);
  for (const AllanPoint& point : allan_deviation(std::vector<std::vector<double>>{samples}, 0.1)) {
    const auto m = static_cast<std::size_t>(std::lround(point.tau_s / 0.1));
    double sum = 0.0;
    double count = 0.0;
    for (std::size_t first = 0; first + 2 * m <= samples.size(); ++first) {
      double difference = 0.0;
      for (std::size_t i = 0; i < m; ++i) difference += samples[first + m + i] - samples[first + i];
      sum += std::pow(difference / static_cast<double>(m), 2);
      count += 1.0;
    }
    EXPECT_NEAR(point.deviation, std::sqrt(sum / (2.0 * count)), 1e-12);
  }
}

TEST(Allan, OfWhiteNoiseAndOfAWalkAsTheModelSays) {
  const int runs = test::trials(40, 20);
  for (const auto& [N, K] : {std::pair{1e-3, 0.0}, {0.0, 1e-3}}) {
    std::vector<double> ratio;
    std::vector<double> degrees;
    for (int run = 0; run < runs; ++run) {
      const auto points = allan_deviation(
          std::vector<std::vector<double>>{at_rest(4096, 10.0, N, K, static_cast<std::uint64_t>(run))}, 0.1);
      ratio.resize(points.size());
      degrees.resize(points.size());
      for (std::size_t i = 0; i < points.size(); ++i) {
        const double tau = points[i].tau_s;
        // The walk inside the samples themselves: (2 m² + 1)/(2 m²) of the continuous one.
        const double m = tau / 0.1;
        const double model = N * N / tau + K * K * tau / 3.0 * (1.0 + 0.5 / (m * m));
        ratio[i] += points[i].deviation * points[i].deviation / model / runs;
        degrees[i] = points[i].degrees_of_freedom;
      }
    }
    for (std::size_t i = 0; i < ratio.size(); ++i)
      EXPECT_NEAR(ratio[i], 1.0, 4.0 * std::sqrt(2.0 / degrees[i] / runs)) << i << " N " << N;
  }
}

TEST(Allan, RecoversTheNoiseOfAnHourAtRest) {
  const int runs = test::trials(100, 20);
  const double N = 3e-4;
  const double K = 3e-5;
  int N_inside = 0;
  int K_inside = 0;
  double worst_N = 0.0;
  double worst_K = 0.0;
  for (int run = 0; run < runs; ++run) {
    const auto fit = fit_noise(allan_deviation(
        std::vector<std::vector<double>>{at_rest(36000, 10.0, N, K, static_cast<std::uint64_t>(run))}, 0.1));
    ASSERT_TRUE(fit && fit->walk) << run;
    N_inside += std::abs(fit->density - N) < 2.0 * fit->density_sigma ? 1 : 0;
    K_inside += std::abs(*fit->walk - K) < 2.0 * fit->walk_sigma ? 1 : 0;
    worst_N = std::max(worst_N, std::abs(fit->density / N - 1.0));
    worst_K = std::max(worst_K, std::abs(*fit->walk / K - 1.0));
  }
  RecordProperty("inside", std::to_string(N_inside) + " " + std::to_string(K_inside));
  RecordProperty("worst", std::to_string(worst_N) + " " + std::to_string(worst_K));
  EXPECT_GT(N_inside, 0.85 * runs);
  EXPECT_GT(K_inside, 0.85 * runs);
  EXPECT_LT(worst_N, 0.03);
  EXPECT_LT(worst_K, 0.5);
}

TEST(Allan, AShortRecordCannotTellTheWalk) {
  const int runs = test::trials(100, 20);
  int told = 0;
  int above = 0;
  for (int run = 0; run < runs; ++run) {
    const auto fit = fit_noise(allan_deviation(
        std::vector<std::vector<double>>{at_rest(1000, 100.0, 3e-4, 1e-5, static_cast<std::uint64_t>(run))},
        0.01));
    ASSERT_TRUE(fit);
    told += fit->walk ? 1 : 0;
    above += fit->walk_limit < 1e-5 ? 1 : 0;
    EXPECT_NEAR(fit->density, 3e-4, 0.15 * 3e-4);
  }
  EXPECT_LE(told, 0.1 * runs);
  EXPECT_LE(above, 0.1 * runs);
}

/// Noise that is correlated over some samples, as a low-pass leaves it, rises at first as a walk does.
TEST(Allan, AHumpOfCorrelatedNoiseIsNoWalk) {
  constexpr double kRate_hz = 100.0;
  Random random(3, 1);
  std::vector<double> samples;
  double low_pass = 0.0;
  for (int i = 0; i < 1300; ++i) {
    low_pass += 0.15 * (random.normal(0.02) - low_pass);
    samples.push_back(low_pass);
  }
  const auto points = allan_deviation(std::vector<std::vector<double>>{samples}, 1.0 / kRate_hz);
  EXPECT_GT(points[2].deviation, points[0].deviation);  // the hump
  const auto fit = fit_noise(points);
  ASSERT_TRUE(fit);
  EXPECT_FALSE(fit->walk) << *fit->walk;
  EXPECT_GE(fit->density, points.back().deviation * std::sqrt(points.back().tau_s));
  EXPECT_LT(fit->walk_limit, 3.0 * points.back().deviation / std::sqrt(points.back().tau_s) * 3.0);
}

TEST(Allan, PoolsStretches) {
  const std::vector<double> a = at_rest(3000, 10.0, 1e-3, 1e-4, 1);
  const std::vector<double> b = at_rest(1000, 10.0, 1e-3, 1e-4, 2);
  const auto pooled = allan_deviation(std::vector{a, b}, 0.1);
  const auto one = allan_deviation(std::vector<std::vector<double>>{a}, 0.1);
  const auto other = allan_deviation(std::vector<std::vector<double>>{b}, 0.1);
  const double squares = 2999.0 * std::pow(one[0].deviation, 2) + 999.0 * std::pow(other[0].deviation, 2);
  EXPECT_NEAR(pooled[0].deviation, std::sqrt(squares / 3998.0), 1e-12);
  EXPECT_FALSE(fit_noise({}));
}

TEST(Allan, AGyroAloneIsTakenAsStandingStill) {
  Recording recording;
  recording.gyro.yaw_rate_rad_s = at_rest(20000, 100.0, 3e-4, 1e-3, 3);
  for (std::size_t i = 0; i < 20000; ++i) recording.gyro.time_s.push_back(0.01 * static_cast<double>(i));
  recording.gyro.yaw_rate_rad_s[7000] = kNotMeasured;
  const auto noise = gyro_noise(recording);
  ASSERT_TRUE(noise && noise->bias_walk_rad_s_sqrt_s);
  EXPECT_NEAR(noise->rest_s, 200.0, 0.1);
  EXPECT_NEAR(noise->noise_rad_s_sqrt_hz, 3e-4, 0.1 * 3e-4);
  EXPECT_NEAR(*noise->bias_walk_rad_s_sqrt_s, 1e-3, 0.5e-3);
  EXPECT_FALSE(noise->walk_between_rests);
}

}  // namespace
}  // namespace trundle::odometry
