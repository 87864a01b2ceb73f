#include "trundle/calibration/likelihood/relative_kernel.hpp"

#include <fmt/format.h>

#include "trundle/calibration/likelihood/relative_sum_kernels.hpp"
#include "trundle/geometry/decompositions.hpp"
#include "trundle/geometry/pose2.hpp"
#include "trundle/io/error.hpp"

namespace trundle::calibration {
namespace {

/// The lanes added up in their order.
double total(const RelativeSum& lanes) {
  double sum = 0.0;
  for (const double lane : lanes) sum += lane;
  return sum;
}

Matrix3 total(const std::array<RelativeSum, 6>& symmetric) {
  Symmetric3 sum;
  for (std::size_t i = 0; i < 6; ++i) sum[i] = total(symmetric[i]);
  return full_matrix(sum);
}

Vector3 total(const std::array<RelativeSum, 3>& vector) {
  return {total(vector[0]), total(vector[1]), total(vector[2])};
}

Matrix3 total(const std::array<RelativeSum, 9>& rows) {
  Matrix3 sum;
  for (int i = 0; i < 9; ++i) sum(i / 3, i % 3) = total(rows[static_cast<std::size_t>(i)]);
  return sum;
}

/// Information about the coefficients of T themselves, column after column, then about ℓ.
struct InputEquations {
  Eigen::MatrixXd information;
  Eigen::VectorXd gradient;
};

InputEquations by_inputs(const RelativeSums& sums, int inputs) {
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

RelativeConstants constants_of(const LinearisedChassis& chassis, const Pose2& mount,
                               const RelativeWeights& weights) {
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
  RelativeSums sums{};
  sum_relative(columns, constants_of(chassis, body_from_sensor, weights), sums);
  const InputEquations equations = by_inputs(sums, chassis.inputs());
  const Eigen::MatrixXd D = coefficients_by_parameter(chassis);
  return {congruent(equations.information, D), D.transpose() * equations.gradient, total(sums.cost),
          static_cast<std::size_t>(total(sums.outliers))};
}

}  // namespace trundle::calibration
