#include "trundle/geometry/gaussian.hpp"

#include <cmath>

#include <Eigen/Cholesky>

namespace trundle::geometry {

Matrix3 world_from_body_axes(const Pose2& pose) {
  Matrix3 R = Matrix3::Identity();
  R.topLeftCorner<2, 2>() = rotation(pose.heading);
  return R;
}

GaussianPose operator*(const GaussianPose& a, const GaussianPose& b) {
  const Matrix3 Ad = adjoint(b.mean.inverse());
  return {a.mean * b.mean, Ad * a.covariance * Ad.transpose() + b.covariance};
}

GaussianPose inverse(const GaussianPose& a) {
  const Matrix3 Ad = adjoint(a.mean);
  return {a.mean.inverse(), Ad * a.covariance * Ad.transpose()};
}

Matrix3 world_covariance(const GaussianPose& pose) {
  const Matrix3 R = world_from_body_axes(pose.mean);
  return R * pose.covariance * R.transpose();
}

Matrix3 body_covariance(const Pose2& pose, const Matrix3& covariance_in_world) {
  const Matrix3 R = world_from_body_axes(pose);
  return R.transpose() * covariance_in_world * R;
}

double position_sigma(const Matrix2& covariance) {
  return std::sqrt(covariance.trace());
}

double position_sigma(const Matrix3& covariance) {
  return position_sigma(Matrix2(covariance.topLeftCorner<2, 2>()));
}

double squared_mahalanobis(const Vector2& v, const Matrix2& S) {
  return v.dot(S.llt().solve(v));
}

}  // namespace trundle::geometry
