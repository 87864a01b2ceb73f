#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "trundle/odometry/steered_model.hpp"

namespace trundle::odometry {

using Inputs = std::array<double, kAllInputs>;
/// Per unit of each input a twist: ξ = T u.
using InputMatrix = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMaxInputs>;

/// A chassis with one gain at all speeds: the twist is T u, and its change with parameter j is T_j u, with
/// constant matrices. docs/theory/odometry.md, eq. 6.
struct LinearisedChassis {
  InputMatrix twist;                    ///< T = G Z
  std::vector<InputMatrix> derivative;  ///< T_j of a square H, as the parameters given

  int inputs() const { return static_cast<int>(twist.cols()); }
};

/// A chassis prepared for stepping: ξ = G z with z = Z u, and the covariance of that. The gain G weighs the
/// rows as the octave of the speed has it, never by the readings themselves: docs/theory/odometry.md, eq. 2.
/// Its functions never allocate.
class MotionModel {
 public:
  /// At most kMaxModelParameters. H must have rank 3.
  MotionModel(const Chassis& chassis, std::span<const Parameter> parameters, bool with_gyro);

  /// H is square: weights drop out.
  bool square() const { return square_; }
  /// No gyro is weighed against wheels: one gain serves all speeds. Not where wheels are steered.
  bool has_one_gain() const { return gains_.size() == 1; }
  /// Where wheels are steered.
  const std::optional<SteeredModel>& steered() const { return steered_; }
  /// Only where there is one gain, whatever the wheels' speed; derivatives only where H is square.
  LinearisedChassis linearised() const;

  /// ξ̂ = G z alone.
  std::array<double, 3> twist(const Increment& increment, std::size_t octave) const {
    if (is_of_its_own(increment)) [[unlikely]]
      return twist_of_its_own(increment, octave);
    return twist_by(gain_at(octave), increment);
  }
  /// With covariance and derivatives. `rolled`: see RollingGauge.
  void twist_with_covariance(const Increment& increment, const Rolled& rolled, std::size_t octave,
                             TwistStep& step) const {
    if (is_of_its_own(increment)) [[unlikely]]
      return step_of_its_own(increment, rolled, octave, step);
    step_by(gain_at(octave), increment, rolled, step);
  }
  /// How the twist answers to a turn that the gyro alone sees: ∂ξ/∂(its reading as a turn).
  std::array<double, 3> response_to_turn(const Increment& increment, std::size_t octave) const;

 private:
  struct RowChange {
    std::size_t parameter;
    std::size_t row;
    Triple dh;
  };
  struct ReadingChange {
    std::size_t parameter;
    std::size_t row;
    std::size_t input;
    double dz;
  };
  /// All that follows from one choice of weights. Inputs stand as in column_of().
  struct Gain {
    std::array<Triple, kMaxRows> by_row{};       ///< columns of G = N⁻¹ Hᵀ W
    std::array<Triple, kAllInputs> by_input{};   ///< columns of T = G Z
    std::array<Symmetric3, kAllInputs> noise{};  ///< covariance of the twist per |input|
    Symmetric3 floor{};                          ///< and of an interval in which nothing moves
    std::array<double, kMaxRows> weight{};       ///< W
    Symmetric3 inverse_normal{};                 ///< N⁻¹
    WheelVectors by_travel{};                    ///< of by_row, those of the wheels
  };

  /// Wheels first; the gyro's integral, the duration, what is scrubbed and speeds always behind all of them.
  std::size_t column_of(std::size_t input) const {
    return input < wheels_ ? input : kMaxWheels + (input - wheels_);
  }
  /// Has the interval a gain of its own? A square H does not weigh: what slips changes the covariance alone.
  bool is_of_its_own(const Increment& increment) const {
    if (square_) return false;
    if (steered_) return true;
    double sum = 0.0;
    for (std::size_t i = 0; i < wheels_; ++i) sum += increment.slip_variance[i];
    return sum > 0.0;
  }
  void probe_readings(const Chassis& chassis, const Rows& rows);
  void probe_derivatives(const Chassis& chassis, const Rows& rows, std::span<const Parameter> parameters);
  const Gain& gain_at(std::size_t octave) const { return gains_[has_one_gain() ? 0 : octave]; }
  Gain gain_of(const std::array<double, kMaxRows>& variance) const;
  Gain gain_for(const Increment& increment, std::size_t octave) const;
  Triple twist_of_its_own(const Increment& increment, std::size_t octave) const;
  void step_of_its_own(const Increment& increment, const Rolled& rolled, std::size_t octave,
                       TwistStep& step) const;
  Triple twist_by(const Gain& gain, const Increment& increment) const;
  void step_by(const Gain& gain, const Increment& increment, const Rolled& rolled, TwistStep& step) const;
  void derive(const Gain& gain, const Increment& increment, TwistStep& step) const;
  double residual(std::size_t row, const Increment& increment, const Triple& twist) const;

  std::size_t rows_ = 0;
  std::size_t inputs_ = 0;
  std::size_t parameters_ = 0;
  std::size_t wheels_ = 0;  ///< inputs, and rows of H, that are wheels (without wheels: forward and turn)
  bool with_gyro_ = false;
  /// The gyro's integral and the duration are inputs: of a gyro, or of a velocity, whose turn has a bias.
  bool with_duration_ = false;
  bool scrubs_ = false;  ///< what skid wheels scrub is an input, the third behind the wheels
  bool grows_ = false;   ///< speeds of wheels are inputs, behind that
  bool square_ = false;
  std::array<Triple, kMaxRows> h_{};
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
  std::vector<std::array<double, kMaxRows>> weighing_;  ///< variances per second, by octave
  std::vector<Gain> gains_;                             ///< by octave; or one; none of steered wheels
  std::optional<SteeredModel> steered_;
};

inline std::array<double, 3> MotionModel::twist_by(const Gain& gain, const Increment& increment) const {
  double dx = 0.0;
  double dy = 0.0;
  double turn = 0.0;
  const auto add = [&](const Triple& column, double u) {
    dx += column[0] * u;
    dy += column[1] * u;
    turn += column[2] * u;
  };
  add(gain.by_input[0], increment.turned[0]);  // the first two without a loop: most robots have no more
  add(gain.by_input[1], increment.turned[1]);
  for (std::size_t k = 2; k < wheels_; ++k) add(gain.by_input[k], increment.turned[k]);
  if (with_duration_) {
    add(gain.by_input[kMaxWheels], increment.gyro_rad);
    add(gain.by_input[kMaxWheels + 1], increment.duration_s);
  }
  if (scrubs_) add(gain.by_input[kMaxWheels + 2], increment.scrub_turned);
  for (std::size_t k = 0; grows_ && k < wheels_; ++k)
    add(gain.by_input[kMaxInputs + k], increment.speed_turned[k]);
  return {dx, dy, turn};
}

}  // namespace trundle::odometry
