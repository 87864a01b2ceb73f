// Sensitivities and variances that are computed of noisy readings err with them: a calibration that takes
// them for exact finds a track that is too wide by the share of noise in the turns. The drives share no code
// with the library: landmark_oracle.hpp.
#include <cmath>
#include <cstdio>
#include <map>
#include <utility>

#include <gtest/gtest.h>

#include "trundle/slam/smoothing/landmark_calibration.hpp"
#include "trundle/slam/steps.hpp"
#include "trundle/statistics/distribution.hpp"
#include "trundle/statistics/random.hpp"

#include "calibration/stated_errors.hpp"
#include "scale.hpp"
#include "slam/landmark_oracle.hpp"

namespace trundle::slam {
namespace {

using namespace test::among_landmarks;

constexpr double kTail = 1e-3;  // on either side, of each limit
// Of a normal number: 1σ that it leaves as rarely on both sides together.
constexpr double kNormalLimit = 3.29;

struct NoisyCase {
  const char* name;
  Wander drive;
};

class NoisyReadings : public testing::TestWithParam<NoisyCase> {};

/// The mean of n errors over their sigmas is normal with 1/√n, the sum of all NEES is χ². Taken for exact,
/// the track was off by 3 sigmas in the mean with the wheels at 20 Hz, and NEES 4 times what is expected.
TEST_P(NoisyReadings, LeaveNoErrorInCommon) {
  const Wander& drive = GetParam().drive;
  const Robot nominal = nominal_of(drive), truth = truth_of(drive);
  const int trials = test::trials(10, 2);
  double nees = 0.0, expected = 0.0;
  std::map<std::string, double> sigmas;
  for (int trial = 0; trial < trials; ++trial) {
    const Recording recording = Wanderer(drive, 500 + static_cast<std::uint64_t>(trial)).recorded();
    const CalibrationResult result = calibrate_from_landmarks({&recording, 1}, {}, nominal);
    ASSERT_EQ(result.status, CalibrationStatus::all_estimated);
    for (const ParameterEstimate& e : result.parameters)
      sigmas[e.name] += (e.value - value_of(e.parameter, truth)) / e.sigma_within;
    const test::StatedErrors stated = test::stated_errors(result, truth);
    nees += stated.nees();
    expected += stated.expected_nees();
  }
  std::printf("%s: NEES %.2f of what is expected;", GetParam().name, nees / expected);
  for (const auto& [name, sum] : sigmas) {
    std::printf(" %s %+.2f", name.c_str(), sum / trials);
    EXPECT_LT(std::abs(sum / trials), kNormalLimit / std::sqrt(trials)) << name;
  }
  std::printf(" sigmas\n");
  EXPECT_LT(nees, chi_squared_limit(kTail, expected));
  EXPECT_GT(nees, chi_squared_limit(1.0 - kTail, expected));
}

INSTANTIATE_TEST_SUITE_P(
    Drives, NoisyReadings,
    testing::Values(NoisyCase{"wheels at 20 Hz", {.duration_s = 80.0, .wheel_noise = 0.02, .rests = true}},
                    NoisyCase{"wheels at 50 Hz, few sightings",
                              {.rate_hz = 50.0,
                               .sighting_rate_hz = 2.0,
                               .duration_s = 120.0,
                               .landmarks = 10,
                               .wheel_noise = 0.02}},
                    NoisyCase{"wheels at 20 Hz, good ones", {.duration_s = 60.0, .wheel_noise = 0.005}},
                    NoisyCase{"a noisy gyro",
                              {.rate_hz = 50.0,
                               .sighting_rate_hz = 2.0,
                               .duration_s = 120.0,
                               .landmarks = 10,
                               .wheel_noise = 0.02,
                               .gyro_noise = 0.02}}),
    [](const auto& one) { return "case" + std::to_string(one.index); });

/// Of the turn, by differences: the variance changes with the track by C twice, and with what a wheel reads
/// by its third moment, T of which the turn alone is sought.
TEST(ReadingErrors, AreDerivativesOfTheMotionsVariance) {
  const Wander drive{.duration_s = 20.0, .wheel_noise = 0.02};
  const Recording recording = Wanderer(drive, 1).recorded();
  const SlamInputOptions options{.parameters = {{ParameterKind::track, -1}}};
  const auto turn_variances = [&](double track_m) {
    Robot robot = nominal_of(drive);
    set_value({ParameterKind::track, -1}, track_m, robot);
    std::vector<double> variances;
    for (const SlamStep& step : slam_input(recording, robot, options).steps)
      variances.push_back(step.motion.covariance(2, 2));
    return variances;
  };
  const double step_m = 1e-4, track_m = 0.3;  // too small for its square to count, m
  const std::vector<double> more = turn_variances(track_m + step_m), less = turn_variances(track_m - step_m);
  const SlamInput input = slam_input(recording, nominal_of(drive), options);
  double slope = 0.0, expected = 0.0;  // variances are counted in grains of travel, a step early or late
  for (std::size_t k = 0; k < input.steps.size(); ++k) {
    slope += (more[k] - less[k]) / (2.0 * step_m);
    expected += 2.0 * input.reading_errors[k].sensitivity(2, 2);
  }
  EXPECT_NEAR(slope, expected, 0.05 * std::abs(slope));
  // V ∂V/∂z (1/track)³ of both wheels: k⁴ times the difference of what they rolled.
  double third = 0.0, turned_rad = 0.0;
  for (std::size_t k = 0; k < input.steps.size(); ++k) {
    third += input.reading_errors[k].covariance(2, 8);
    turned_rad += input.steps[k].motion.mean.heading;
  }
  EXPECT_NEAR(third, std::pow(drive.wheel_noise, 4) * turned_rad / (track_m * track_m),
              0.01 * std::abs(third));
}

/// The same travel with other noise: each wheel's by √(its way).
Recording misread(Recording recording, double per_sqrt_m, Random& random) {
  for (WheelSeries& wheel : recording.wheels.series) {
    double error_m = 0.0, before = wheel.value.front();
    for (double& turned_rad : wheel.value) {
      const double way_m = 0.05 * std::abs(turned_rad - std::exchange(before, turned_rad));
      error_m += random.normal(per_sqrt_m * std::sqrt(way_m));
      turned_rad += error_m / 0.05;
    }
  }
  return recording;
}

/// Of the turn by the track: one drive read many times.
TEST(ReadingErrors, ScatterAsTheySay) {
  constexpr double kNoise = 0.02;
  const int draws = test::trials(400, 40);
  const Recording exact = Wanderer({.duration_s = 20.0, .wheel_noise = 0.0}, 7).recorded();
  const Robot robot = nominal_of({.wheel_noise = kNoise});
  Random random(8, 1);
  std::vector<double> sum, squares;
  double stated = 0.0;
  for (int draw = 0; draw < draws; ++draw) {
    const SlamInput input = slam_input(misread(exact, kNoise, random), robot,
                                       {.parameters = {{ParameterKind::track, -1}}, .with_scatter = true});
    sum.resize(input.steps.size());
    squares.resize(input.steps.size());
    for (std::size_t k = 0; k < input.steps.size(); ++k) {
      const double turn_by_track = input.by_parameters[k](2, 0);
      sum[k] += turn_by_track / draws;
      squares[k] += turn_by_track * turn_by_track / draws;
      stated += input.reading_errors[k].scatter(2, 2) / draws;
    }
  }
  double scatter = 0.0;
  for (std::size_t k = 0; k < sum.size(); ++k) scatter += squares[k] - sum[k] * sum[k];
  EXPECT_NEAR(scatter / stated, 1.0, 0.05);
}

}  // namespace
}  // namespace trundle::slam
