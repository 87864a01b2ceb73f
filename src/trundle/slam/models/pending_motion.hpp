#pragma once

#include "trundle/slam/report.hpp"

namespace trundle::slam {

/// Where a pose is after a motion, by the systematic errors s that a particle has:
/// pose · mean · exp(by_systematic · s + offset).
struct PredictedMotion {
  Pose2 mean;
  BySystematic by_systematic = BySystematic(3, 0);
  Vector3 offset = Vector3::Zero();
};

/// The motion since particles were drawn, and what is known of the systematic errors by then, as one Gaussian
/// of the motion's error e and of s. Given their paths it is the same for all particles but for the mean,
/// which is linear in the ŝ that each had when it was drawn. docs/theory/fastslam.md, eq. 9 to 10b.
class PendingMotion {
 public:
  explicit PendingMotion(const Systematic& sigma)
      : PendingMotion(Systematic::Zero(sigma.size()), sigma.cwiseAbs2().asDiagonal()) {}
  /// What is known of s given the poses, and the mean of all particles' ŝ.
  PendingMotion(const Systematic& mean, const SystematicCovariance& covariance);

  /// One more motion. Eq. 9.
  void add(const Motion& motion);
  /// How likely a reading of the first of s is, now, for a particle that was drawn with ŝ: a logarithm, the
  /// same constant left out for all. Eq. 10b.
  [[nodiscard]] double log_likelihood(const BiasReading& reading, const Systematic& drawn_with) const;
  /// A reading of the first of s, now. Eq. 10b.
  void read(const BiasReading& reading);

  [[nodiscard]] Eigen::Index systematic() const { return reference_.size(); }
  /// Of a particle by its ŝ.
  [[nodiscard]] PredictedMotion prediction() const;
  /// Of e, in the frame at the end, about its prediction.
  [[nodiscard]] const Matrix3& covariance() const { return of_motion_; }
  /// What is known of s now: the mean of a particle that was drawn with ŝ, and the covariance of all.
  [[nodiscard]] Systematic systematic_of(const Systematic& drawn_with) const;
  [[nodiscard]] const SystematicCovariance& systematic_covariance() const { return of_systematic_; }
  [[nodiscard]] const BySystematic& with_systematic() const { return between_; }

  /// What the mean of s moves by where a pose is drawn so far from its prediction: K of eq. 10.
  [[nodiscard]] Eigen::Matrix<double, Eigen::Dynamic, 3, 0, kMostSystematic, 3> gain() const;
  /// All particles have been drawn; `mean` of their ŝ.
  void drawn(const Systematic& mean);

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.mean_, self.of_motion_, self.between_, self.of_systematic_, self.reference_, self.now_,
            self.motion_by_, self.offset_, self.systematic_by_);
  }

 private:
  Pose2 mean_;                           ///< for a particle of the mean ŝ
  Matrix3 of_motion_ = Matrix3::Zero();  ///< covariance
  BySystematic between_;                 ///< of e and s
  SystematicCovariance of_systematic_;   ///< of s
  Systematic reference_;                 ///< mean ŝ when particles were drawn
  Systematic now_;                       ///< what has become of it
  BySystematic motion_by_;               ///< of the mean of e, by ŝ
  Vector3 offset_ = Vector3::Zero();     ///< mean of e at the reference
  SystematicCovariance systematic_by_;   ///< of the mean of s, by ŝ
};

}  // namespace trundle::slam
