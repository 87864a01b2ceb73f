#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "trundle/chassis/parameter.hpp"

namespace trundle {

/// The raw readings of an interval as one vector u: `turned` of each wheel (forward and turn without wheels);
/// then, where the gyro is used, its integral and the duration. Readings z and twist are linear in it.
inline constexpr int kMaxInputs = kMaxWheels + 2;
using Inputs = std::array<double, kMaxInputs>;
/// Per unit of each input a twist: ξ = T u.
using InputMatrix = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMaxInputs>;

/// A chassis whose H is square: whatever the weights are, the twist is T u, and its change with parameter j
/// is T_j u, with constant matrices. docs/odometry.md, eq. 6.
struct LinearisedChassis {
  InputMatrix twist;                    ///< T = H⁻¹ Z
  std::vector<InputMatrix> derivative;  ///< T_j = H⁻¹ (∂Z/∂p_j − ∂H/∂p_j T), as the parameters given

  int inputs() const { return static_cast<int>(twist.cols()); }
};

/// A symmetric 3×3 matrix: xx, xy, xh, yy, yh, hh.
using Symmetric3 = std::array<double, 6>;
Matrix3 full_matrix(const Symmetric3& s);
Symmetric3 symmetric_of(const Matrix3& matrix);

/// The parameters an odometer carries along, and the gyro's bias.
inline constexpr int kMaxModelParameters = 33;

/// The twist of an interval, its noise, and its derivatives by the model's parameters.
struct TwistStep {
  std::array<double, 3> twist;
  Symmetric3 covariance;
  std::array<std::array<double, 3>, kMaxModelParameters> derivative;  ///< ∂ξ/∂p for each parameter
};

/// A chassis prepared for stepping: H, z = Z u and its variances (linear in |u|) as plain numbers.
/// Its functions never allocate.
class MotionModel {
 public:
  /// At most kMaxModelParameters. H must have rank 3.
  MotionModel(const Chassis& chassis, std::span<const Parameter> parameters, bool with_gyro);

  bool square() const { return square_; }
  /// Only where H is square.
  const LinearisedChassis& linearised() const { return linearised_; }

  /// ξ̂ = (HᵀWH)⁻¹HᵀWz alone.
  std::array<double, 3> twist(const Increment& increment) const;
  /// With covariance and derivatives.
  void twist_with_covariance(const Increment& increment, TwistStep& step) const;
  /// How the twist answers to a turn that the gyro alone sees: ∂ξ/∂(its reading as a turn).
  std::array<double, 3> response_to_turn(const Increment& increment, double gyro_scale) const;

 private:
  struct RowChange {
    std::size_t parameter;
    std::size_t row;
    std::array<double, 3> dh;
  };
  struct ReadingChange {
    std::size_t parameter;
    std::size_t row;
    std::size_t input;
    double dz;
  };
  struct Weighted;

  void probe_readings(const Chassis& chassis, const Rows& rows);
  void probe_derivatives(const Chassis& chassis, const Rows& rows, std::span<const Parameter> parameters);
  void linearise();
  void linearise_noise(const Matrix3& M);
  void read_inputs(const Increment& increment, Inputs& u) const;
  void weigh(const Inputs& u, const Increment& increment, Weighted& equations) const;
  std::array<double, 3> weighted_twist(const Increment& increment) const;
  void square_step(const Inputs& u, const Increment& increment, TwistStep& step) const;
  void weighted_step(const Inputs& u, const Increment& increment, TwistStep& step) const;

  std::size_t rows_ = 0;
  std::size_t inputs_ = 0;
  std::size_t parameters_ = 0;
  std::size_t wheels_ = 0;  ///< inputs, and rows of H, that are wheels (without wheels: forward and turn)
  bool with_gyro_ = false;
  bool square_ = false;
  std::array<std::array<double, 3>, kMaxRows> h_{};
  std::array<Inputs, kMaxRows> reading_{};   ///< Z
  std::array<Inputs, kMaxRows> variance_{};  ///< by |u|
  std::array<double, kMaxRows> variance_at_rest_{};
  std::vector<RowChange> row_changes_;
  std::vector<ReadingChange> reading_changes_;
  /// The parameter that is the gyro's time offset, and the row of the gyro. It moves a reading by the change
  /// of the rate, which is no input.
  struct Clock {
    std::size_t parameter;
    std::size_t row;
    double scale;
  };
  std::optional<Clock> clock_;
  LinearisedChassis linearised_;
  std::array<std::array<double, 3>, kMaxInputs> columns_{};  ///< square H: T, the gyro's two columns last
  std::array<Symmetric3, kMaxInputs> noise_{};               ///< square H: covariance of the twist by |u|
  Symmetric3 noise_at_rest_{};
  std::array<std::array<double, 3>, 3> by_row_{};  ///< square H: columns of H⁻¹
};

inline std::array<double, 3> MotionModel::twist(const Increment& increment) const {
  if (!square_) return weighted_twist(increment);
  double dx = 0.0;
  double dy = 0.0;
  double turn = 0.0;
  const auto add = [&](const std::array<double, 3>& column, double u) {
    dx += column[0] * u;
    dy += column[1] * u;
    turn += column[2] * u;
  };
  add(columns_[0], increment.turned[0]);  // the first two without a loop: most robots have no more
  add(columns_[1], increment.turned[1]);
  for (std::size_t k = 2; k < wheels_; ++k) add(columns_[k], increment.turned[k]);
  if (with_gyro_) {
    add(columns_[kMaxWheels], increment.gyro_rad);
    add(columns_[kMaxWheels + 1], increment.duration_s);
  }
  return {dx, dy, turn};
}

}  // namespace trundle
