#pragma once

#include <array>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include "trundle/statistics/distribution.hpp"

#include "calibration/simulated_runs.hpp"

namespace trundle::test {

inline constexpr std::array kVelocityParameters = {
    Parameter{ParameterKind::velocity_forward_scale, -1}, Parameter{ParameterKind::velocity_yaw_scale, -1},
    Parameter{ParameterKind::velocity_yaw_per_forward, -1}, Parameter{ParameterKind::velocity_yaw_bias, -1}};

inline Robot nominal_velocity() {
  Robot robot;
  robot.name = "velocity";
  robot.chassis.noise = {.wheel_per_sqrt_m = 0.01, .turn_per_sqrt_m = 0.01, .turn_per_sqrt_rad = 0.01};
  return robot;
}

/// Wrong by less than the priors: 2 %, 5 %, 0.02 rad/m and 0.005 rad/s.
inline Robot true_velocity(std::uint64_t seed) {
  Robot robot = nominal_velocity();
  Random random(seed, 41);
  robot.chassis.velocity = {.forward_scale = 1.0 + random.normal(0.02),
                            .yaw_scale = 1.0 + random.normal(0.05),
                            .yaw_per_forward_rad_m = random.normal(0.02),
                            .yaw_bias_rad_s = random.normal(0.005)};
  return robot;
}

/// Errors of many calibrations, each by its own covariance.
class VelocityEvidence {
 public:
  /// `covariance`: of kVelocityParameters.
  void add(const Robot& found, const Eigen::MatrixXd& covariance, const Robot& truth) {
    ASSERT_EQ(covariance.rows(), 4);
    Eigen::Vector4d error;
    for (std::size_t i = 0; i < kVelocityParameters.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      error[row] = value_of(kVelocityParameters[i], found) - value_of(kVelocityParameters[i], truth);
      squares_[i] += error[row] * error[row] / covariance(row, row);
    }
    together_ += error.dot(covariance.ldlt().solve(error));
    ++runs_;
  }
  /// Each sum of squares over variances is χ²: outside of these limits once in a thousand on either side.
  void expect_consistent() const {
    const auto expect = [](double sum, double dof, std::string_view what) {
      EXPECT_LT(sum, chi_squared_limit(1e-3, dof)) << what << ", mean " << sum / dof;
      EXPECT_GT(sum, chi_squared_limit(1.0 - 1e-3, dof)) << what << ", mean " << sum / dof;
    };
    for (std::size_t i = 0; i < squares_.size(); ++i)
      expect(squares_[i], runs_, name_of(kVelocityParameters[i], nominal_velocity()));
    expect(together_, 4.0 * runs_, "all together");
  }

 private:
  std::array<double, 4> squares_{};
  double together_ = 0.0;
  int runs_ = 0;
};

}  // namespace trundle::test
