#pragma once

#include <optional>

#include <Eigen/Core>

#include "trundle/geometry/pose2.hpp"
#include "trundle/statistics/paired_sums.hpp"

namespace trundle::inspection {

/// What something turns all the while beside what the wheels turn.
struct SteadyTurn {
  double rate_rad_s = 0.0;
  /// 1σ by what is left of the turns, and by what noise of the wheels' takes from a where they turn one way.
  double sigma_rad_s = 0.0;
  double duration_s = 0.0;       ///< over which it was seen
  double correlation = 0.0;      ///< of both turns, beside what diameters and a steady rate make of them
  double wheels_turn_rad = 0.0;  ///< of the wheels beside the same: root of the sum of squares
};

/// Pieces as TurnPairs has them, with the ways: their sums, and least squares of
///   turn = a · turn by wheels + c · way ahead + d · way aside + b · time
/// where a stands for a wrong scale or track, c and d for diameters that differ or a steering's zero; b is
/// sought.
class SteadyTurns {
 public:
  /// Of an interval in which both tell.
  void add(const Twist2& by_wheels, double turn_rad, double duration_s);
  /// By the wheels (x) and by the other (y), of the pieces that are complete.
  [[nodiscard]] PairedSums pairs() const;
  /// Root of the sum of squares of their durations: times a bias, that of the turns that it makes.
  [[nodiscard]] double of_a_bias_s() const;
  /// Nothing of a few pieces.
  [[nodiscard]] std::optional<SteadyTurn> turn() const;

 private:
  using Vector5 = Eigen::Matrix<double, 5, 1>;
  using Matrix5 = Eigen::Matrix<double, 5, 5>;

  Vector5 piece_ = Vector5::Zero();    ///< time, way ahead and aside, turn by wheels, turn
  Vector5 sum_ = Vector5::Zero();      ///< of the complete ones
  Matrix5 moments_ = Matrix5::Zero();  ///< of the same
  int pieces_ = 0;
};

}  // namespace trundle::inspection
