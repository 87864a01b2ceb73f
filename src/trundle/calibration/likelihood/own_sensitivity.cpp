#include "trundle/calibration/likelihood/own_sensitivity.hpp"

namespace trundle::calibration {
namespace {

/// What becomes of an error of the pose where the robot has gone so far: a heading swings the way about.
Eigen::Matrix3Xd carried(Eigen::Matrix3Xd columns, const Pose2& from, const Pose2& to) {
  columns.row(0) -= (to.y - from.y) * columns.row(2);
  columns.row(1) += (to.x - from.x) * columns.row(2);
  return columns;
}

}  // namespace

void OwnSensitivity::mark(const Odometer& odometer) {
  from_ = odometer.pose();
  if (own_.walking_bias) by_bias_ = odometer.sensitivity().col(static_cast<Eigen::Index>(*own_.walking_bias));
}

void OwnSensitivity::begin(const Odometer& odometer, double time_s) {
  of_pose_.setZero(3, columns());
  time_s_ = time_s;
  mark(odometer);
}

void OwnSensitivity::begin_at_start(const Odometer& odometer, double time_s, const Vector2& lever) {
  begin(odometer, time_s);
  if (own_.start_heading) of_pose_.rightCols<1>() = Vector3(lever.y(), -lever.x(), 1.0);
}

void OwnSensitivity::advance(const Odometer& odometer, double time_s) {
  const Vector3 before = carried(by_bias_, from_, odometer.pose());
  of_pose_ = carried(of_pose_, from_, odometer.pose());
  mark(odometer);
  if (own_.walking_bias)
    of_pose_.leftCols(harmonics()) += (by_bias_ - before) * walk_.at(0.5 * (time_s_ + time_s));
  time_s_ = time_s;
}

void OwnSensitivity::correct(const Eigen::Matrix3Xd& KJ, const Odometer& odometer) {
  of_pose_ -= KJ;
  mark(odometer);
}

Eigen::MatrixXd OwnSensitivity::extended(const Eigen::MatrixXd& by_parameters, double time_s) const {
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(by_parameters.rows(), by_parameters.cols() + columns());
  all.leftCols(by_parameters.cols()) = by_parameters;
  if (own_.walking_bias)
    all.middleCols(by_parameters.cols(), harmonics()) =
        by_parameters.col(static_cast<Eigen::Index>(*own_.walking_bias)) * walk_.at(time_s);
  return all;
}

}  // namespace trundle::calibration
