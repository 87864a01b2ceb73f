#pragma once

#include "trundle/slip/parity.hpp"

namespace trundle::slip {

/// Relative sigma of a wheel's rolling radius: of a robot file's diameter, and of what load, dirt or tape
/// make of it.
inline constexpr double kRadiusSigma = 0.05;

/// A wheel that is not round errs once in each of its own turns: with one degree of freedom the angle in
/// which the residual is periodic says which wheel that is. Bayesian regression of the residual on each
/// wheel's angle, against none. docs/theory/slip-wheel.md, eq. 18.
class UnevenWheel {
 public:
  /// Any interval that is judged: residual and travel of the wheels.
  void add(const Contradiction& c, const Parity& parity);
  /// An interval that is not judged, whose travel is known.
  void turn(const Increment& interval);
  /// Travel was lost: the angles are not known any more.
  void forget() { *this = {}; }

  /// Of each wheel, that its radius is at fault, if one is; alike where no angle shows it.
  PerWheel probability(std::size_t wheels) const;

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.fits_, self.squares_, self.intervals_, self.angle_);
  }

 private:
  static constexpr int kFeatures = 4;
  using Features = Eigen::Matrix<double, kFeatures, 1>;
  using Normal = Eigen::Matrix<double, kFeatures, kFeatures>;
  /// Normal equations of the residual, in units of one prior sigma: turn of the robot (track, gyro), radius,
  /// cosine and sine of the angle.
  struct Fit {
    std::array<double, kFeatures * kFeatures> normal{};
    std::array<double, kFeatures> right{};

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.normal, self.right);
    }
  };
  double log_likelihood(const Fit& fit, int features) const;

  std::array<Fit, kMaxWheels> fits_{};
  double squares_ = 0.0;  ///< Σ e²
  double intervals_ = 0.0;
  PerWheel angle_{};  ///< of each wheel [rad]
};

}  // namespace trundle::slip
