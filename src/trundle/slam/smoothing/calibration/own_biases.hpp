#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "trundle/calibration/likelihood/gyro_bias_spread.hpp"

namespace trundle::slam {

/// The gyro's bias of each recording about the one that all share, as they are sought: so many units each,
/// behind what is sought of the robot. docs/theory/calibration-runs.md.
struct OwnBiases {
  double unit_rad_s = 0.0;  ///< the robot file's spread
  /// As far as they are found; nothing: the recording does not show it. Empty: all recordings have one.
  std::vector<std::optional<double>> rad_s = {};
  /// Of the prior of each, about 0 and in units: the spread's, times by how much all scatters more than its
  /// noise, so that it weighs what it should.
  double information = 1.0;

  [[nodiscard]] Eigen::Index count() const;
  /// Which of those that are sought it is; nothing: that recording has none.
  [[nodiscard]] std::optional<Eigen::Index> place_of(std::size_t recording) const;
  [[nodiscard]] double of(std::size_t recording) const;
  /// In units, in the order of their places.
  [[nodiscard]] Eigen::VectorXd values() const;
  void move(const Eigen::VectorXd& units);
};

/// The spread from recording to recording by restricted maximum likelihood, docs/theory/calibration-runs.md,
/// eq. 6c: `covariance` is that of what is sought of the robot and the biases behind it at the minimum, where
/// noise scatters by what was assumed times `dispersion`.
[[nodiscard]] GyroBiasSpread spread_of(const OwnBiases& own, const Eigen::MatrixXd& covariance,
                                       double dispersion);

}  // namespace trundle::slam
