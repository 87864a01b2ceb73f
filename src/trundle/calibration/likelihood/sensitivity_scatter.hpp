#pragma once

#include <Eigen/Core>

#include "trundle/calibration/likelihood/common_errors.hpp"
#include "trundle/chassis/rows.hpp"

namespace trundle::calibration {

/// Applies a map to so many threes of rows and columns of a covariance.
void map_threes(const Matrix3& map, Eigen::Index count, Eigen::MatrixXd& covariance);

/// Covariance of the errors of a pose's sensitivities, and behind them of those of the parity residual Pᵀz
/// beside it: first the three of the pose by each parameter, then those of the residual by each. What they
/// make of information: docs/theory/calibration-redundancy.md, eq. 7c. `with_measured` below: their
/// covariance with the error of what is measured, by which an innovation, weighed, corrects them.
class SensitivityScatter {
 public:
  explicit SensitivityScatter(std::size_t parameters);

  void begin_parity(Eigen::Index size);
  void drop_parity();
  /// Over an arc that maps errors of the pose by F. `by_reading`: of all, per unit error of each reading.
  void propagate(const Matrix3& F, const Eigen::MatrixXd& by_reading, const RowVector& variance);

  /// What the errors that a measurement of the pose leaves make of its information; `weight`: Hᵀ S⁻¹ H.
  [[nodiscard]] Eigen::MatrixXd noise_in_pose(const Matrix3& weight,
                                              const Eigen::MatrixXd& with_measured) const;
  /// The same of a measurement of the parity residual.
  [[nodiscard]] Eigen::MatrixXd noise_in_parity(const Eigen::MatrixXd& weight,
                                                const Eigen::MatrixXd& with_measured) const;
  /// After that of the pose: keep = I − K H; the parity residual moved by `parity_by_pose` times the error of
  /// the pose.
  void correct_by_pose(const Matrix3& weight, const Eigen::MatrixXd& with_measured, const Matrix3& keep,
                       const Eigen::MatrixX3d& parity_by_pose);
  /// After that of the parity residual, which moved the pose by `gain`. There is none any more.
  void correct_by_parity(const Eigen::MatrixXd& weight, const Eigen::MatrixXd& with_measured,
                         const CommonError& gain);
  /// Of the pose; all begins anew.
  [[nodiscard]] Eigen::MatrixXd take();

 private:
  Eigen::Index parameters_;
  Eigen::MatrixXd covariance_;
};

}  // namespace trundle::calibration
