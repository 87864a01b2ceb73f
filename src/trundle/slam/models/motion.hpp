#pragma once

#include <Eigen/Core>

#include "trundle/geometry/gaussian.hpp"

namespace trundle::slam {

/// No robot has more systematic errors: so many that nothing here needs the heap.
inline constexpr int kMostSystematic = 12;
/// Errors s that the odometry makes all along a run, each by a component: the gyro's bias, what a calibration
/// left open, or shares of travel and turning. SystematicErrors (steps.hpp) says which they are.
using Systematic = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostSystematic, 1>;
using SystematicCovariance =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostSystematic, kMostSystematic>;
/// Of (forward, left, turn) by s, or their covariance with s.
using BySystematic = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMostSystematic>;

/// How the body moved over some time, as odometry shows it:
/// truth = mean · exp(by_systematic · s + e), e ~ N(0, covariance). docs/theory/motion-and-sensor.md, eq. 1.
/// The first of s may walk: meanwhile it changes by w of variance `walk`, which goes with e. Eq. 1a.
struct Motion {
  Pose2 mean;
  Matrix3 covariance = Matrix3::Zero();  ///< of (forward, left, turn) in the frame at the end [m, m, rad]
  BySystematic by_systematic = BySystematic(3, 0);  ///< of the same, by s at the start; none by further ones
  double walk = 0.0;                                ///< variance of w [of s²]
  Vector3 with_walk = Vector3::Zero();              ///< covariance of e and w

  /// By so many of s, whether it knows of them or not.
  [[nodiscard]] BySystematic by_first(Eigen::Index count) const;

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.mean, self.covariance, self.by_systematic, self.walk, self.with_walk);
  }
};

/// One interval of constant twist, by the three shares that wrong wheels make: s are errors of travel and of
/// turning, each as a share of itself, and turning that comes with travel [rad/m].
[[nodiscard]] Motion motion_of(const Twist2& twist, const Matrix3& covariance);
inline constexpr Eigen::Index kShares = 3;

/// One after the other, with independent noise and the same systematic errors.
Motion operator*(const Motion& first, const Motion& second);

/// The same motion of errors s counted from `reference`: its mean is that of these.
[[nodiscard]] Motion about(const Systematic& reference, const Motion& motion);

}  // namespace trundle::slam
