#pragma once

#include <cstddef>

#include "trundle/geometry/trajectory.hpp"

namespace trundle::geometry {

/// Poses as they come, of which at most about so many are kept: as long as they are fewer all, then every
/// second, every fourth and so on, and always the last.
class ThinnedTrajectory {
 public:
  ThinnedTrajectory(std::size_t most, bool with_covariance)
      : most_(most), with_covariance_(with_covariance) {}

  void add(const StampedPose& pose, const Matrix3& covariance);

  /// Those that are kept, once.
  [[nodiscard]] Trajectory take();
  /// Before that: how many are not.
  [[nodiscard]] std::size_t left_out() const;

 private:
  void keep();
  bool keeps_last() const { return count_ == 0 || (count_ - 1) % stride_ == 0; }

  std::size_t most_;
  bool with_covariance_;
  std::size_t stride_ = 1;
  std::size_t count_ = 0;
  Trajectory kept_;
  StampedPose last_;
  Matrix3 last_covariance_ = Matrix3::Zero();
};

}  // namespace trundle::geometry
