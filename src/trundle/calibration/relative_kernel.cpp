#include "trundle/calibration/relative_kernel.hpp"

#include <cmath>
#include <cstring>

#include <fmt/format.h>

#include "trundle/geometry/pose2.hpp"
#include "trundle/io/error.hpp"
#include "trundle/odometry/arc_kernel.hpp"

// Lanes stay inside one kernel: how they would be passed between functions does not matter.
#pragma GCC diagnostic ignored "-Wpsabi"

namespace trundle {
namespace {

constexpr std::size_t kMaxPairs = kMaxInputs * (kMaxInputs + 1) / 2;

/// What is summed. A chassis parameter's Jacobian is A T_j u, so moments of the inputs u with AᵀΩA, AᵀΩS and
/// AᵀΩr are enough, whatever the T_j are; A = ∂predicted/∂ξ, S = ∂predicted/∂ℓ.
struct Sums {
  std::array<std::array<Lanes, 6>, kMaxPairs> chassis;   ///< u_a u_b AᵀΩA (a <= b), symmetric
  std::array<std::array<Lanes, 9>, kMaxInputs> crossed;  ///< u_a AᵀΩS, by rows
  std::array<Lanes, 6> sensor;                           ///< SᵀΩS, symmetric
  std::array<std::array<Lanes, 3>, kMaxInputs> chassis_gradient;
  std::array<Lanes, 3> sensor_gradient;
  Lanes cost;
  Lanes outliers;
};

/// Everything that is the same for all increments. Vectors are in body axes: the residual turned by ℓ's
/// heading.
struct Constants {
  const double* T;
  std::size_t inputs;
  double lever_x, lever_y;
  double cos_mount, sin_mount;
  std::array<double, 6> omega;  ///< Ω in body axes: xx, xy, xh, yy, yh, hh
  double gate;
};

struct Vector {
  Lanes x, y;
};

struct HalfTurn {
  Lanes cos, sin, sinc, sinc_derivative;
};

/// Of θ/2 = `half`, by polynomials where all lanes lie in their range.
TRUNDLE_INLINE HalfTurn half_turn(const Lanes& half) {
  const Lanes sinc_half = half_sinc(half);
  HalfTurn parts{cos_polynomial(half * half), half * sinc_half, sinc_half, half_sinc_derivative(half)};
  if (!any_beyond(beyond(half, kLargestHalfTurn))) return parts;
  for (int lane = 0; lane < kLanes; ++lane) {
    parts.cos[lane] = std::cos(half[lane]);
    parts.sin[lane] = std::sin(half[lane]);
    parts.sinc[lane] = sinc(half[lane]);
    parts.sinc_derivative[lane] = sinc_derivative(half[lane]);
  }
  return parts;
}

TRUNDLE_INLINE Lanes wrapped(const Lanes& angle) {
  constexpr double kRound = 0x1.8p52;
  const Lanes turns = (angle * (0.5 / kPi) + kRound) - kRound;
  return angle - turns * (2.0 * kPi);
}

struct Twists {
  Lanes dx, dy, turn;
};
using InputLanes = std::array<Lanes, kMaxInputs>;

TRUNDLE_INLINE Twists twists(const Constants& is, const InputLanes& u) {
  Twists twist{u[0] * is.T[0], u[0] * is.T[1], u[0] * is.T[2]};
  for (std::size_t k = 1; k < is.inputs; ++k) {
    twist.dx += u[k] * is.T[3 * k];
    twist.dy += u[k] * is.T[3 * k + 1];
    twist.turn += u[k] * is.T[3 * k + 2];
  }
  return twist;
}

/// Eight predictions in body axes, v = t + (R(θ) − 1) l with the chord t, and their derivatives:
/// A by the twist, with columns (a, b, 0), (−b, a, 0), (p, q, 1); S by ℓ, with columns (c, s, 0), (−s, c, 0)
/// and (vy, −vx, 0), where R(θ) − 1 = [c −s; s c].
struct Prediction {
  Vector v;
  Lanes turn;
  Lanes a, b, p, q, c, s;
};

TRUNDLE_INLINE Prediction predict(const Constants& is, const Twists& twist) {
  const HalfTurn half = half_turn(0.5 * twist.turn);
  const Lanes a = half.sinc * half.cos;
  const Lanes b = half.sinc * half.sin;
  const Vector t = {a * twist.dx - b * twist.dy, b * twist.dx + a * twist.dy};
  const Lanes c = -2.0 * half.sin * half.sin;
  const Lanes s = 2.0 * half.sin * half.cos;
  const Vector lever = {c * is.lever_x - s * is.lever_y, s * is.lever_x + c * is.lever_y};
  const Lanes bent_x = half.sinc_derivative * (half.cos * twist.dx - half.sin * twist.dy);
  const Lanes bent_y = half.sinc_derivative * (half.sin * twist.dx + half.cos * twist.dy);
  return {{t.x + lever.x, t.y + lever.y},
          twist.turn,
          a,
          b,
          0.5 * (bent_x - t.y) - (lever.y + is.lever_y),
          0.5 * (bent_y + t.x) + (lever.x + is.lever_x),
          c,
          s};
}

/// Ω r, and what each increment costs; beyond the gate it has no weight.
struct Residual {
  Lanes x, y, turn;  ///< of Ω r, times the weight
  Lanes weight, cost;
};

TRUNDLE_INLINE Residual residual(const Constants& is, const Prediction& at, const Vector& measured,
                                 const Lanes& measured_turn) {
  const auto& [Oxx, Oxy, Oxh, Oyy, Oyh, Ohh] = is.omega;
  const Lanes x = is.cos_mount * measured.x - is.sin_mount * measured.y - at.v.x;
  const Lanes y = is.sin_mount * measured.x + is.cos_mount * measured.y - at.v.y;
  const Lanes turn = wrapped(measured_turn - at.turn);
  Residual f{Oxx * x + Oxy * y + Oxh * turn, Oxy * x + Oyy * y + Oyh * turn, Oxh * x + Oyh * y + Ohh * turn,
             Lanes{} + 1.0, Lanes{}};
  f.cost = x * f.x + y * f.y + turn * f.turn;
  if (!any_beyond(beyond(f.cost, is.gate))) return f;
  for (int lane = 0; lane < kLanes; ++lane) {
    if (f.cost[lane] <= is.gate) continue;
    f.weight[lane] = f.x[lane] = f.y[lane] = f.turn[lane] = 0.0;
    f.cost[lane] = is.gate;
  }
  return f;
}

TRUNDLE_INLINE void add_chassis(const Constants& is, const InputLanes& u, const Prediction& at,
                                const Residual& f, Sums& sums) {
  const auto& [Oxx, Oxy, Oxh, Oyy, Oyh, Ohh] = is.omega;
  const auto& [v, turn, a, b, p, q, c, s] = at;
  const Vector A1 = {Oxx * a + Oxy * b, Oxy * a + Oyy * b};  // columns of Ω A
  const Vector A2 = {Oxy * a - Oxx * b, Oyy * a - Oxy * b};
  const Vector A3 = {Oxx * p + Oxy * q + Oxh, Oxy * p + Oyy * q + Oyh};
  const Lanes A3h = Oxh * p + Oyh * q + Ohh;
  const std::array<Lanes, 6> AA = {A1.x * a + A1.y * b, A2.x * a + A2.y * b, A3.x * a + A3.y * b,
                                   A2.y * a - A2.x * b, A3.y * a - A3.x * b, A3.x * p + A3.y * q + A3h};
  const std::array<Lanes, 9> AS = {A1.x * c + A1.y * s, A1.y * c - A1.x * s, A1.x * v.y - A1.y * v.x,
                                   A2.x * c + A2.y * s, A2.y * c - A2.x * s, A2.x * v.y - A2.y * v.x,
                                   A3.x * c + A3.y * s, A3.y * c - A3.x * s, A3.x * v.y - A3.y * v.x};
  const std::array<Lanes, 3> Ar = {a * f.x + b * f.y, a * f.y - b * f.x, p * f.x + q * f.y + f.turn};
  std::size_t pair = 0;
  for (std::size_t i = 0; i < is.inputs; ++i) {
    const Lanes wu = f.weight * u[i];
    for (std::size_t k = 0; k < 9; ++k) sums.crossed[i][k] += wu * AS[k];
    for (std::size_t k = 0; k < 3; ++k) sums.chassis_gradient[i][k] += u[i] * Ar[k];
    for (std::size_t j = i; j < is.inputs; ++j, ++pair) {
      const Lanes wuu = wu * u[j];
      for (std::size_t k = 0; k < 6; ++k) sums.chassis[pair][k] += wuu * AA[k];
    }
  }
}

TRUNDLE_INLINE void add_sensor(const Constants& is, const Prediction& at, const Residual& f, Sums& sums) {
  const auto& [Oxx, Oxy, Oxh, Oyy, Oyh, Ohh] = is.omega;
  const auto& [v, turn, a, b, p, q, c, s] = at;
  const Vector S1 = {Oxx * c + Oxy * s, Oxy * c + Oyy * s};  // columns of Ω S
  const Vector S2 = {Oxy * c - Oxx * s, Oyy * c - Oxy * s};
  const Vector S3 = {Oxx * v.y - Oxy * v.x, Oxy * v.y - Oyy * v.x};
  sums.sensor[0] += f.weight * (S1.x * c + S1.y * s);
  sums.sensor[1] += f.weight * (S2.x * c + S2.y * s);
  sums.sensor[2] += f.weight * (S3.x * c + S3.y * s);
  sums.sensor[3] += f.weight * (S2.y * c - S2.x * s);
  sums.sensor[4] += f.weight * (S3.y * c - S3.x * s);
  sums.sensor[5] += f.weight * (S3.x * v.y - S3.y * v.x);
  sums.sensor_gradient[0] += c * f.x + s * f.y;
  sums.sensor_gradient[1] += c * f.y - s * f.x;
  sums.sensor_gradient[2] += v.y * f.x - v.x * f.y;
}

/// Rows first ... first + 7; beyond the last one zeros, which add nothing.
TRUNDLE_INLINE Lanes load(std::span<const double> column, std::size_t first) {
  Lanes lanes{};
  if (first + kLanes <= column.size()) {
    std::memcpy(&lanes, &column[first], sizeof lanes);
  } else {
    for (std::size_t i = first; i < column.size(); ++i) lanes[i - first] = column[i];
  }
  return lanes;
}

TRUNDLE_KERNEL void sum_rows(const RelativeColumns& columns, const Constants& constants, Sums& sums) {
  InputLanes u;
  for (std::size_t first = 0; first < columns.rows(); first += kLanes) {
    for (std::size_t k = 0; k < constants.inputs; ++k) u[k] = load(columns.input[k], first);
    const Prediction at = predict(constants, twists(constants, u));
    const Vector measured = {load(columns.x_m, first), load(columns.y_m, first)};
    const Residual f = residual(constants, at, measured, load(columns.heading_rad, first));
    sums.cost += f.cost;
    sums.outliers += 1.0 - f.weight;
    add_chassis(constants, u, at, f, sums);
    add_sensor(constants, at, f, sums);
  }
}

/// The lanes added up in their order.
double total(const Lanes& lanes) {
  double sum = 0.0;
  for (int lane = 0; lane < kLanes; ++lane) sum += lanes[lane];
  return sum;
}

Matrix3 total(const std::array<Lanes, 6>& symmetric) {
  Symmetric3 sum;
  for (std::size_t i = 0; i < 6; ++i) sum[i] = total(symmetric[i]);
  return full_matrix(sum);
}

Vector3 total(const std::array<Lanes, 3>& vector) {
  return {total(vector[0]), total(vector[1]), total(vector[2])};
}

Matrix3 total(const std::array<Lanes, 9>& rows) {
  Matrix3 sum;
  for (int i = 0; i < 9; ++i) sum(i / 3, i % 3) = total(rows[static_cast<std::size_t>(i)]);
  return sum;
}

/// Information about the coefficients of T themselves, column after column, then about ℓ.
struct InputEquations {
  Eigen::MatrixXd information;
  Eigen::VectorXd gradient;
};

InputEquations by_inputs(const Sums& sums, int inputs) {
  InputEquations equations{Eigen::MatrixXd(3 * inputs + 3, 3 * inputs + 3), Eigen::VectorXd(3 * inputs + 3)};
  std::size_t pair = 0;
  for (int a = 0; a < inputs; ++a) {
    const auto i = static_cast<std::size_t>(a);
    equations.gradient.segment<3>(3 * a) = total(sums.chassis_gradient[i]);
    const Matrix3 crossed = total(sums.crossed[i]);
    equations.information.block<3, 3>(3 * a, 3 * inputs) = crossed;
    equations.information.block<3, 3>(3 * inputs, 3 * a) = crossed.transpose();
    for (int b = a; b < inputs; ++b, ++pair) {
      equations.information.block<3, 3>(3 * a, 3 * b) = total(sums.chassis[pair]);
      equations.information.block<3, 3>(3 * b, 3 * a) = equations.information.block<3, 3>(3 * a, 3 * b);
    }
  }
  equations.information.bottomRightCorner<3, 3>() = total(sums.sensor);
  equations.gradient.tail<3>() = total(sums.sensor_gradient);
  return equations;
}

/// Columns: how each parameter changes the coefficients of T, and ℓ.
Eigen::MatrixXd coefficients_by_parameter(const LinearisedChassis& chassis) {
  const auto coefficients = static_cast<Eigen::Index>(3 * chassis.inputs());
  const auto parameters = static_cast<Eigen::Index>(chassis.derivative.size());
  Eigen::MatrixXd D = Eigen::MatrixXd::Zero(coefficients + 3, parameters + 3);
  for (Eigen::Index j = 0; j < parameters; ++j)
    D.col(j).head(coefficients) = Eigen::Map<const Eigen::VectorXd>(
        chassis.derivative[static_cast<std::size_t>(j)].data(), coefficients);
  D.bottomRightCorner<3, 3>().setIdentity();
  return D;
}

Constants constants_of(const LinearisedChassis& chassis, const Pose2& mount, const RelativeWeights& weights) {
  Matrix3 R = Matrix3::Identity();
  R.topLeftCorner<2, 2>() = rotation(mount.heading);
  return {.T = chassis.twist.data(),
          .inputs = static_cast<std::size_t>(chassis.inputs()),
          .lever_x = mount.x,
          .lever_y = mount.y,
          .cos_mount = R(0, 0),
          .sin_mount = R(1, 0),
          .omega = symmetric_of(R * weights.information * R.transpose()),
          .gate = weights.gate};
}

void require_equal_lengths(const RelativeColumns& columns, std::size_t inputs) {
  const auto require = [&](std::size_t rows, const std::string& name) {
    if (rows != columns.rows())
      throw InputError("relative motions", fmt::format("column {} has {} rows", name, rows),
                       fmt::format("{} as x_m", columns.rows()));
  };
  require(columns.y_m.size(), "y_m");
  require(columns.heading_rad.size(), "heading_rad");
  for (std::size_t k = 0; k < inputs; ++k) require(columns.input[k].size(), fmt::format("input[{}]", k));
}

}  // namespace

RelativeNormalEquations accumulate_relative(const RelativeColumns& columns, const LinearisedChassis& chassis,
                                            const Pose2& body_from_sensor, const RelativeWeights& weights) {
  require_equal_lengths(columns, static_cast<std::size_t>(chassis.inputs()));
  Sums sums{};
  sum_rows(columns, constants_of(chassis, body_from_sensor, weights), sums);
  const InputEquations equations = by_inputs(sums, chassis.inputs());
  const Eigen::MatrixXd D = coefficients_by_parameter(chassis);
  return {D.transpose() * equations.information * D, D.transpose() * equations.gradient, total(sums.cost),
          static_cast<std::size_t>(total(sums.outliers))};
}

}  // namespace trundle
