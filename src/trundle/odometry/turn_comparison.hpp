#pragma once

#include <array>
#include <span>
#include <vector>

#include "trundle/chassis/parameter.hpp"
#include "trundle/odometry/motion_model.hpp"
#include "trundle/odometry/rolling.hpp"

namespace trundle::odometry {

inline constexpr int kMaxParameters = 32;

/// What the gyro read of a turn beyond what the wheels did: plain numbers.
struct TurnDifference {
  double duration_s = 0.0;
  double rad = 0.0;
  double variance = 0.0;           ///< of the noise of both, which adds up
  double rounding_variance = 0.0;  ///< of the last counts and stamps, which the next take back
  std::array<double, kMaxParameters> by_parameter{};  ///< ∂rad/∂p
};

/// Readings that are not compared yet, as Increment has them, and the difference of those that are.
struct ComparedTurn {
  double duration_s = 0.0;
  double gyro_rad = 0.0;
  double scrub_turned = 0.0;
  std::array<double, kMaxWheels> turned{};
  std::array<double, kMaxWheels> speed_turned{};
  std::array<double, kMaxWheels> slip_variance{};
  Rolled rolled{};
  TurnDifference difference;
};

/// Compares the gyro's turn with that of wheels that show it too. docs/theory/redundant-turn.md. Its
/// functions never allocate.
class TurnComparison {
 public:
  /// `parameters`: at most kMaxParameters, none of them the gyro's bias. The chassis must show the turn
  /// without its gyro.
  TurnComparison(const Robot& robot, std::span<const Parameter> parameters);

  /// One interval more, whose gyro reads less its bias.
  void add(ComparedTurn& sum, const Increment& increment, const Rolled& rolled, std::size_t octave) const;
  /// Whether enough was added for a comparison.
  static bool is_due(const ComparedTurn& sum);
  /// Of all that was added; begins anew.
  TurnDifference take(ComparedTurn& sum, std::size_t octave) const;

 private:
  void compare(const Increment& readings, const Rolled& rolled, std::size_t octave,
               TurnDifference& difference) const;

  Gyro gyro_;
  std::vector<Parameter> parameters_;
  MotionModel by_wheels_;
  std::size_t wheels_ = 0;
  std::array<double, kMaxWheels> rounding_variance_{};  ///< of a count of each wheel [m²]
};

}  // namespace trundle::odometry
