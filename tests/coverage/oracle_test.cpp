// The drives that coverage is measured on are what they claim to be.
#include <cmath>

#include <gtest/gtest.h>

#include "coverage/coverage.hpp"
#include "coverage/true_weights.hpp"
#include "scale.hpp"

namespace trundle::coverage {
namespace {

struct Spread {
  double variance = 0.0;  ///< of one wheel's whole travel, measured less true [m²]
  double expected = 0.0;  ///< k² · true travel
};

Spread roll_noise(double rate_hz, int seeds) {
  const Cell cell{.rate_hz = rate_hz, .k = 0.02};
  const Robot robot = robot_of(cell);
  Spread spread;
  for (int i = 0; i < seeds; ++i) {
    SimulatedDrive drive(robot.chassis, {.duration_s = 4.0}, rate_hz, seed_of(cell, i));
    double error = 0.0;
    double travel = 0.0;
    while (!drive.over()) {
      drive.next();
      error += drive.noisy_travel()[0] - drive.travel()[0];
      travel += std::abs(drive.travel()[0]);
    }
    spread.variance += error * error / seeds;
    spread.expected += cell.k * cell.k * travel / seeds;
  }
  return spread;
}

TEST(CoverageOracle, RollNoiseIsWhiteInDistance) {
  const int seeds = test::trials(1000, 100);
  const double limit = 5.0 * std::sqrt(2.0 / seeds);  // of a variance from so many normal numbers
  for (const double rate : {10.0, 200.0, 1000.0}) {
    const Spread spread = roll_noise(rate, seeds);
    EXPECT_NEAR(spread.variance / spread.expected, 1.0, limit) << rate << " Hz";
  }
}

TEST(CoverageOracle, RoundingDoesNotAddUp) {
  const Cell cell{.rate_hz = 1000.0, .counts = 100.0};
  const Robot robot = robot_of(cell);
  const double tick_m = kPi * 0.1 / cell.counts;
  const int seeds = test::trials(1000, 100);
  double squares = 0.0;
  for (int i = 0; i < seeds; ++i) {
    SimulatedDrive drive(robot.chassis, {.duration_s = 2.0}, cell.rate_hz, seed_of(cell, i));
    double error = 0.0;
    while (!drive.over()) error += drive.next().turned[0] * kPi * 0.1 - drive.noisy_travel()[0];
    ASSERT_LE(std::abs(error), tick_m * (1.0 + 1e-9));
    squares += error * error / seeds;
  }
  // ε_n − ε_0 of two independent uniform errors: triangular, with kurtosis 2.4
  EXPECT_NEAR(squares / (tick_m * tick_m / 6.0), 1.0, 5.0 * std::sqrt(1.4 / seeds));
}

Outcome run_with_true_weights(const Cell& cell, std::uint64_t seed) {
  Random random(seed);
  Robot robot = robot_of(cell);
  if (robot.chassis.gyro) robot.chassis.gyro->bias_walk_rad_s_sqrt_s = 0.0;  // it knows of no walk
  SimulatedDrive drive(robot.chassis, drive_of(cell, random), cell.rate_hz, Random::splitmix(seed));
  TrueWeights odometry(robot.chassis);
  while (!drive.over()) {
    const Increment reading = drive.next();
    odometry.step(drive, reading);
  }
  return judge(drive, odometry.pose(), odometry.covariance());
}

TEST(CoverageOracle, OdometryWithTheTrueWeightsIsUnbiasedAndHonest) {
  const int seeds = test::trials(200, 20);
  const Limits limit = limits(seeds, kChassis.size() * kMotions.size());
  for (const std::string_view chassis : kChassis) {
    for (std::size_t motion = 0; motion < kMotions.size(); ++motion) {
      const Cell cell{.chassis = chassis, .k = 0.02, .motion = static_cast<Motion>(motion)};
      if (is_steered(robot_of(cell).chassis)) continue;  // rows that are misread have no true weights
      Tally tally;
      for (int i = 0; i < seeds; ++i) tally.add(run_with_true_weights(cell, seed_of(cell, i)));
      EXPECT_TRUE(unbiased(tally, limit)) << chassis << ' ' << name_of(cell.motion) << ": " << tally.bias();
      EXPECT_TRUE(honest(tally, limit)) << chassis << ' ' << name_of(cell.motion) << ": " << tally.nees();
    }
  }
}

}  // namespace
}  // namespace trundle::coverage
