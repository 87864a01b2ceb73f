#include "trundle/calibration/likelihood/sensitivity_scatter.hpp"

#include <algorithm>

#include "trundle/calibration/likelihood/information.hpp"

namespace trundle::calibration {

void map_threes(const Matrix3& map, Eigen::Index count, Eigen::MatrixXd& covariance) {
  for (Eigen::Index i = 0; i < 3 * count; i += 3)
    covariance.middleRows<3>(i) = (map * covariance.middleRows<3>(i)).eval();
  for (Eigen::Index i = 0; i < 3 * count; i += 3)
    covariance.middleCols<3>(i) = (covariance.middleCols<3>(i) * map.transpose()).eval();
}

SensitivityScatter::SensitivityScatter(std::size_t parameters)
    : parameters_(static_cast<Eigen::Index>(parameters)),
      covariance_(Eigen::MatrixXd::Zero(3 * parameters_, 3 * parameters_)) {}

void SensitivityScatter::begin_parity(Eigen::Index size) {
  const Eigen::Index all = (3 + size) * parameters_;
  covariance_.conservativeResizeLike(Eigen::MatrixXd::Zero(all, all));
}

void SensitivityScatter::drop_parity() {
  covariance_.conservativeResize(3 * parameters_, 3 * parameters_);
}

void SensitivityScatter::propagate(const Matrix3& F, const Eigen::MatrixXd& by_reading,
                                   const RowVector& variance) {
  map_threes(F, parameters_, covariance_);
  covariance_ += by_reading * variance.asDiagonal() * by_reading.transpose();
}

Eigen::MatrixXd SensitivityScatter::noise_in_pose(const Matrix3& weight,
                                                  const Eigen::MatrixXd& with_measured) const {
  const Eigen::Index own = 3 * parameters_;
  const auto by = with_measured.topRows(own);
  return information_of_noise(weight, covariance_.topLeftCorner(own, own) - by * weight * by.transpose());
}

Eigen::MatrixXd SensitivityScatter::noise_in_parity(const Eigen::MatrixXd& weight,
                                                    const Eigen::MatrixXd& with_measured) const {
  const Eigen::Index own = covariance_.rows() - 3 * parameters_;
  const auto by = with_measured.bottomRows(own);
  return information_of_noise(weight, covariance_.bottomRightCorner(own, own) - by * weight * by.transpose());
}

void SensitivityScatter::correct_by_pose(const Matrix3& weight, const Eigen::MatrixXd& with_measured,
                                         const Matrix3& keep, const Eigen::MatrixX3d& parity_by_pose) {
  covariance_ -= with_measured * weight * with_measured.transpose();
  const Eigen::Index m = covariance_.rows() / std::max<Eigen::Index>(parameters_, 1) - 3;
  if (m > 0) {
    Eigen::MatrixXd map = Eigen::MatrixXd::Identity(covariance_.rows(), covariance_.rows());
    for (Eigen::Index j = 0; j < parameters_; ++j)
      map.block(3 * parameters_ + m * j, 3 * j, m, 3) = parity_by_pose;
    covariance_ = (map * covariance_ * map.transpose()).eval();
  }
  map_threes(keep, parameters_, covariance_);
}

void SensitivityScatter::correct_by_parity(const Eigen::MatrixXd& weight,
                                           const Eigen::MatrixXd& with_measured, const CommonError& gain) {
  covariance_ -= with_measured * weight * with_measured.transpose();
  const Eigen::Index own = 3 * parameters_, m = gain.cols();
  Eigen::MatrixXd map = Eigen::MatrixXd::Zero(own, covariance_.rows());
  map.leftCols(own).setIdentity();
  for (Eigen::Index j = 0; j < parameters_; ++j) map.block(3 * j, own + m * j, 3, m) = -gain;
  covariance_ = (map * covariance_ * map.transpose()).eval();
}

Eigen::MatrixXd SensitivityScatter::take() {
  const Eigen::Index own = 3 * parameters_;
  const Eigen::MatrixXd of_pose = covariance_.topLeftCorner(own, own);
  covariance_.setZero();
  return of_pose;
}

}  // namespace trundle::calibration
