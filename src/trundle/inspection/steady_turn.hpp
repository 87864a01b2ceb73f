#pragma once

#include <optional>

#include <Eigen/Core>

#include "trundle/geometry/pose2.hpp"

namespace trundle::inspection {

/// What something turns all the while beside what the wheels turn.
struct SteadyTurn {
  double rate_rad_s = 0.0;
  double sigma_rad_s = 0.0;  ///< 1σ by what is left of the turns
  double duration_s = 0.0;   ///< over which it was seen
  double correlation = 0.0;  ///< of both turns, beside what diameters and a steady rate make of them
};

/// Least squares, over pieces of half a second, of
///   turn = a · turn by wheels + c · way + b · time
/// where a stands for a wrong scale or track, c for diameters that differ or a steering's zero, b is sought.
class SteadyTurns {
 public:
  /// Of an interval in which both tell.
  void add(const Twist2& by_wheels, double turn_rad, double duration_s);
  /// Nothing of a few pieces.
  [[nodiscard]] std::optional<SteadyTurn> turn() const;

 private:
  Eigen::Vector4d piece_ = Eigen::Vector4d::Zero();    ///< time, way, turn by wheels, turn
  Eigen::Matrix4d moments_ = Eigen::Matrix4d::Zero();  ///< of the complete ones
  double duration_s_ = 0.0;
  int pieces_ = 0;
};

}  // namespace trundle::inspection
