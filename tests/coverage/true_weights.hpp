#pragma once

#include <array>
#include <cmath>

#include <Eigen/LU>

#include "trundle/geometry/gaussian.hpp"

#include "coverage/drive_oracle.hpp"

namespace trundle::coverage {
using namespace chassis;

/// What no real odometry can be: one that reads counters without rounding and knows each wheel's true travel,
/// and so the true variance of each reading. It shows that the drives fit the model that they claim.
///
///   ξ̂ = Q Hᵀ W z,  Q = (Hᵀ W H)⁻¹;   pose ← pose · Exp(ξ̂),  P ← A P Aᵀ + Jr Q Jrᵀ,  A = Ad(Exp(−ξ̂))
class TrueWeights {
 public:
  explicit TrueWeights(const Chassis& chassis) : chassis_(chassis) {}

  void step(const SimulatedDrive& drive, const Increment& reading) {
    add_wheels(drive);
    if (reading.has_gyro) add_gyro(reading);
    const Matrix3 Q = information_.inverse();
    const Twist2 twist = Twist2::from(Q * sum_);
    const Matrix3 A = adjoint(exp({-twist.dx, -twist.dy, -twist.dtheta}));
    const Matrix3 J = right_jacobian(twist);
    estimate_.mean = estimate_.mean * exp(twist);
    estimate_.covariance = A * estimate_.covariance * A.transpose() + J * Q * J.transpose();
    information_.setZero();
    sum_.setZero();
  }

  const Pose2& pose() const { return estimate_.mean; }
  Matrix3 covariance() const { return world_covariance(estimate_); }

 private:
  void add(const Vector3& row, double reading, double variance) {
    const double weight = 1.0 / (variance + kFloor * kFloor);
    information_ += weight * row * row.transpose();
    sum_ += weight * reading * row;
  }

  void add_wheels(const SimulatedDrive& drive) {
    double mean = 0.0;
    for (std::size_t i = 0; i < chassis_.wheels().size(); ++i) {
      const double travel = std::abs(drive.travel()[i]);
      mean += travel / chassis_.wheel_count;
      add(travel_row(chassis_.wheels()[i]), drive.noisy_travel()[i],
          std::pow(chassis_.noise.wheel_per_sqrt_m, 2) * travel);
    }
    if (const double k = skid_noise(chassis_); k > 0.0) add({0.0, 1.0, -chassis_.icr_x_m}, 0.0, k * k * mean);
  }

  void add_gyro(const Increment& reading) {
    const Gyro& gyro = *chassis_.gyro;
    const double turn = (reading.gyro_rad - gyro.bias_rad_s * reading.duration_s) * gyro.scale;
    add({0.0, 0.0, 1.0}, turn, std::pow(gyro.scale * gyro.noise_rad_s_sqrt_hz, 2) * reading.duration_s);
  }

  static constexpr double kFloor = 1e-8;  ///< [m, rad] of a reading, for intervals at rest

  Chassis chassis_;
  GaussianPose estimate_;
  Matrix3 information_ = Matrix3::Zero();
  Vector3 sum_ = Vector3::Zero();
};

}  // namespace trundle::coverage
