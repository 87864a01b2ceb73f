#include "trundle/calibration/likelihood/walk_sensitivity.hpp"

namespace trundle::calibration {
namespace {

/// What becomes of an error of the pose where the robot has gone so far: a heading swings the way about.
Eigen::Matrix3Xd carried(Eigen::Matrix3Xd columns, const Pose2& from, const Pose2& to) {
  columns.row(0) -= (to.y - from.y) * columns.row(2);
  columns.row(1) += (to.x - from.x) * columns.row(2);
  return columns;
}

}  // namespace

void WalkSensitivity::mark(const Odometer& odometer) {
  from_ = odometer.pose();
  by_bias_ = odometer.sensitivity().col(static_cast<Eigen::Index>(bias_));
}

void WalkSensitivity::begin(const Odometer& odometer, double time_s) {
  of_pose_.setZero(3, walk_.harmonics);
  time_s_ = time_s;
  mark(odometer);
}

void WalkSensitivity::advance(const Odometer& odometer, double time_s) {
  const Vector3 before = carried(by_bias_, from_, odometer.pose());
  of_pose_ = carried(of_pose_, from_, odometer.pose());
  mark(odometer);
  of_pose_ += (by_bias_ - before) * walk_.at(0.5 * (time_s_ + time_s));
  time_s_ = time_s;
}

void WalkSensitivity::correct(const Eigen::Matrix3Xd& KJ, const Odometer& odometer) {
  of_pose_ -= KJ;
  mark(odometer);
}

Eigen::MatrixXd WalkSensitivity::extended(const Eigen::MatrixXd& by_parameters, double time_s) const {
  Eigen::MatrixXd all(by_parameters.rows(), by_parameters.cols() + harmonics());
  all << by_parameters, by_parameters.col(static_cast<Eigen::Index>(bias_)) * walk_.at(time_s);
  return all;
}

}  // namespace trundle::calibration
