// What noise makes of sensitivities is no information: a robot that could drive sideways and did not shows
// nothing of what it would do there, however noisy its wheels are.
#include <cmath>
#include <vector>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "trundle/calibration/calibrate.hpp"
#include "trundle/calibration/likelihood/chassis_likelihood.hpp"
#include "trundle/calibration/likelihood/information.hpp"
#include "trundle/chassis/usual_parameters.hpp"
#include "trundle/simulation/path.hpp"
#include "trundle/statistics/random.hpp"

#include "calibration/simulated_runs.hpp"
#include "scale.hpp"

namespace trundle::calibration {
namespace {

/// Three omni wheels, the one across four times as bad as the first, and a gyro.
Robot noisy_omni3() {
  Robot robot = test::nominal_omni3();
  robot.chassis.gyro = Gyro{};
  const double noise[] = {0.008, 0.03, 0.012};
  for (std::size_t w = 0; w < 3; ++w) robot.chassis.wheels()[w].noise_per_sqrt_m = noise[w];
  return robot;
}

Robot with_other_wheels(Robot robot, statistics::Random& random) {
  for (int w = 0; w < 3; ++w)
    set_value({ParameterKind::diameter, w}, 0.1 * (1.0 + random.normal(0.005)), robot);
  return robot;
}

/// Ahead and in curves, with the reference of a motion capture.
std::vector<Recording> drives_ahead(const Robot& truth, statistics::Random& random, std::uint64_t seed) {
  std::vector<Recording> recordings;
  for (int i = 0; i < 2; ++i) {
    const Path path = random_tour({.length_m = 40.0, .box_x_m = 6.0, .box_y_m = 6.0}, {}, random);
    Scenario scenario =
        test::scenario_of(noisy_omni3(), truth, path, 2 * seed + static_cast<std::uint64_t>(i));
    scenario.encoders.rate_hz = 20.0;
    recordings.push_back(simulate(scenario).recording);
    recordings.back().name = "run " + std::to_string(i + 1);
    recordings.back().session = "one";
  }
  return recordings;
}

TEST(UnseenDirection, IsNotFoundInNoise) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const int seeds = test::trials(12, 2);
  for (int seed = 1; seed <= seeds; ++seed) {
    statistics::Random random(static_cast<std::uint64_t>(seed), 41);
    const Robot truth = with_other_wheels(noisy_omni3(), random);
    const std::vector<Recording> runs = drives_ahead(truth, random, static_cast<std::uint64_t>(seed));
    const CalibrationResult result = calibrate(runs, {}, noisy_omni3());
    for (const ParameterEstimate& e : result.parameters) {
      if (!e.observable) continue;
      EXPECT_LT(std::abs(e.value - value_of(e.parameter, truth)), 4.0 * e.sigma_total)
          << "seed " << seed << ": " << e.name << " " << e.value << " ± " << e.sigma_total;
    }
  }
}

// Of a robot that drives ahead alone: all that wheels and gyro seem to say of what is across is of noise.
TEST(UnseenDirection, HasAllItsInformationFromNoise) {
  const Robot truth = noisy_omni3();
  statistics::Random random(3, 41);
  const std::vector<Parameter> parameters = {{ParameterKind::direction, 0}, {ParameterKind::direction, 2}};
  Information sum = Information::zero(2);
  for (std::uint64_t seed = 0; seed < 8; ++seed) {
    const Recording recording = drives_ahead(truth, random, seed).front();
    for (const Information& block :
         chassis_likelihood(prepare_run(recording, truth), truth, parameters, {.with_noise = true}))
      sum.add(block);
  }
  // Both wheels turned the other way each: rolling ahead they do the same, and only driving across shows it.
  const Eigen::Vector2d across = Eigen::Vector2d(1.0, -1.0).normalized();
  const double seems = across.dot(sum.matrix * across), noise = across.dot(sum.of_noise * across);
  EXPECT_NEAR(noise / seems, 1.0, 4.0 * std::sqrt(2.0 / sum.count)) << seems << " of which " << noise;
}

TEST(ShareKnown, TakesOutWhatNoiseMakes) {
  const Eigen::Matrix2d A = Eigen::Vector2d(4.0, 3.0).asDiagonal();
  const Eigen::Matrix2d B = Eigen::Vector2d(1.0, 3.5).asDiagonal();  // of the second more, by chance
  const Eigen::MatrixXd K = share_known(A, B);
  EXPECT_TRUE(K.isApprox(Eigen::Matrix2d(Eigen::Vector2d(0.75, 0.0).asDiagonal()), 1e-12)) << K;
}

TEST(ShareKnown, IsTheSameInAnyUnits) {
  const Eigen::Matrix3d root{{2.0, 0.3, 0.1}, {0.0, 1.0, -0.4}, {0.0, 0.0, 0.5}};
  const Eigen::Matrix3d A = root * root.transpose(),
                        B = 0.3 * A + 0.1 * root.col(0) * root.col(0).transpose();
  const Eigen::Matrix3d units = Eigen::Vector3d(1e-4, 1.0, 1e3).asDiagonal();
  const Eigen::MatrixXd K = share_known(A, B);
  EXPECT_TRUE(K.isApprox((A - B) * A.inverse(), 1e-9)) << K;
  EXPECT_TRUE(share_known(units * A * units, units * B * units).isApprox(units * K * units.inverse(), 1e-9));
}

TEST(ShareKnown, LeavesAloneWhatNothingIsSaidOf) {
  const Eigen::Matrix2d A{{1.0, 1.0}, {1.0, 1.0}};  // of the difference nothing
  const Eigen::MatrixXd K = share_known(A, Eigen::Matrix2d::Zero());
  EXPECT_TRUE((K * A * K.transpose()).isApprox(A, 1e-9)) << K;
  EXPECT_TRUE(share_known(Eigen::Matrix2d::Zero(), Eigen::Matrix2d::Zero()).isZero());
  const Eigen::MatrixXd none;  // nothing is sought
  EXPECT_EQ(share_known(none, none).size(), 0);
}

}  // namespace
}  // namespace trundle::calibration
