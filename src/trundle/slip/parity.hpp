#pragma once

#include "trundle/chassis/robot.hpp"
#include "trundle/chassis/rows.hpp"
#include "trundle/odometry/rest.hpp"

namespace trundle::slip {

/// Most directions in which readings can contradict each other: every wheel and the gyro, less one.
inline constexpr int kMaxParity = kMaxWheels;
using ParityVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxParity, 1>;
using ParityMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxParity, kMaxParity>;
using MotionToParity = Eigen::Matrix<double, Eigen::Dynamic, 3, 0, kMaxParity, 3>;
using WheelDirections = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxParity, kMaxWheels>;
using PerWheel = std::array<double, kMaxWheels>;

/// What is judged at once: readings added up, and what was known when they were complete.
struct JudgedInterval {
  Increment readings;
  GyroBias bias;
  double turn_rate_change_rad_s = 0.0;  ///< from the first of the readings to the last
};

/// What clean recordings taught of the residuals of a chassis: docs/theory/slip-detection.md, eq. 12 and 13.
struct ResidualModel {
  MotionToParity by_motion;  ///< mean of the residual per unit of twist: what is wrong in the geometry
  ParityMatrix scale;  ///< lower L with L Lᵀ = covariance of the residuals whitened by the robot's noise
  double timing_sigma_s = 0.0;    ///< of the gyro's stamps against the wheels'
  std::size_t samples = 0;        ///< intervals it was learned from
  double interval_s = 0.0;        ///< their length
  double limit = 0.0;             ///< of χ² at the probability it was learned for
  bool empirical = false;         ///< the limit is a quantile of the sample, which is not normal
  bool beyond_sample = false;     ///< and the sample is too small for it: its largest value is used
  double persistent_limit = 0.0;  ///< of the cumulative sums: their theory, or the largest they reached
};

/// One interval as contradiction: all in units of one sigma. docs/theory/slip-detection.md, eq. 6 to 8.
struct Contradiction {
  ParityVector e;           ///< whitened: N(0, I) when nothing slips
  double chi2 = 0.0;        ///< |e|²
  WheelDirections towards;  ///< column i: unit vector in which an error of wheel i moves e
  PerWheel excess_m{};      ///< of each wheel, were it the one that slips
  PerWheel excess_sigma_m{};
  PerWheel score{};   ///< excess / its sigma
  PerWheel drift{};   ///< 1σ of the score's mean from the gyro's bias: the same in all intervals
  PerWheel travel{};  ///< of each wheel [m]
  PerWheel travel_sigma{};
  double gyro_rad = 0.0;  ///< less its bias
  double gyro_sigma_rad = 0.0;
};

/// Whether readings check each other, in one and the same way for all time: not those of wheels with an
/// encoder that are steered.
[[nodiscard]] bool can_show_slip(const Chassis& chassis, bool with_gyro);

/// The slip test's geometry of a robot. Its functions never allocate.
class Parity {
 public:
  /// Throws CannotAnswer where the sensors leave no reading to check the others.
  explicit Parity(const Robot& robot);

  int degrees_of_freedom() const { return static_cast<int>(combinations_.cols()); }
  std::size_t wheels() const { return static_cast<std::size_t>(chassis_.wheel_count); }
  bool uses_gyro() const { return chassis_.gyro.has_value(); }
  const Rows& rows() const { return rows_; }
  const Chassis& chassis() const { return chassis_; }

  /// Where the robot has a gyro the interval must have it. `model`: learned, or none.
  Contradiction contradiction(const JudgedInterval& interval, const ResidualModel* model) const;
  /// y = Pᵀ z and its covariance before any learning, and the twist: for learning.
  struct Raw {
    ParityVector y;
    ParityMatrix covariance;
    Vector3 twist;
    Readings readings;
  };
  Raw raw(const JudgedInterval& interval, double timing_sigma_s) const;
  /// Wheels turn while those rows that stand still see every motion that the sensors see at all.
  bool is_stuck(const Contradiction& c) const;
  /// Sizes of the columns of H, by which geometry errors of so many percent are compared.
  const Vector3& size() const { return size_; }

 private:
  using Solver = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMaxRows>;

  Chassis chassis_;
  Rows rows_;
  Combinations combinations_;  ///< P
  Solver twist_from_readings_;
  Vector3 size_;
  double gyro_scale_ = 1.0;
};

}  // namespace trundle::slip
