#include "trundle/slam/models/pending_motion.hpp"

#include <Eigen/Cholesky>

namespace trundle::slam {
namespace {

void make_symmetric(SystematicCovariance& covariance) {
  covariance = (0.5 * (covariance + covariance.transpose())).eval();
}

}  // namespace

PendingMotion::PendingMotion(const Systematic& mean, const SystematicCovariance& covariance)
    : between_(BySystematic::Zero(3, mean.size())), of_systematic_(covariance), reference_(mean) {
  drawn(mean);
}

// e ← Ad e + S (s − ŝ) + noise; the motion's mean is that of the present ŝ.
void PendingMotion::add(const Motion& motion) {
  const Eigen::Index n = systematic();
  if (n == 0) {
    const Matrix3 Ad = adjoint(motion.mean.inverse());
    mean_ = mean_ * motion.mean;
    of_motion_ = Ad * of_motion_ * Ad.transpose() + motion.covariance;
    return;
  }
  const Pose2 step = about(now_, motion).mean;
  const Matrix3 Ad = adjoint(step.inverse());
  const BySystematic S = motion.by_first(n);
  const BySystematic carried = Ad * between_;
  const BySystematic more = S * of_systematic_;
  const Matrix3 mixed = carried * S.transpose();
  mean_ = mean_ * step;
  of_motion_ = (Ad * of_motion_ * Ad.transpose() + mixed + mixed.transpose() + more * S.transpose() +
                motion.covariance)
                   .eval();
  between_ = carried + more;
  between_.col(0) += motion.with_walk;
  of_systematic_(0, 0) += motion.walk;
  motion_by_ = (Ad * motion_by_ + S * systematic_by_).eval();
  offset_ = (Ad * offset_).eval();
}

double PendingMotion::log_likelihood(const BiasReading& reading, const Systematic& drawn_with) const {
  const double S = of_systematic_(0, 0) + reading.variance;
  const double innovation = reading.rad_s - systematic_of(drawn_with)[0];
  return S > 0.0 ? -0.5 * innovation * innovation / S : 0.0;
}

void PendingMotion::read(const BiasReading& reading) {
  if (systematic() == 0) return;
  const double S = of_systematic_(0, 0) + reading.variance;
  if (S <= 0.0) return;
  const Vector3 of_motion = between_.col(0);
  const Systematic of_systematic = of_systematic_.col(0);
  const double innovation = reading.rad_s - now_[0];
  const Eigen::Matrix<double, 1, Eigen::Dynamic, Eigen::RowMajor, 1, kMostSystematic> by =
      systematic_by_.row(0);
  offset_ += of_motion * (innovation / S);
  now_ += of_systematic * (innovation / S);
  motion_by_ -= of_motion / S * by;
  systematic_by_ -= of_systematic / S * by;
  of_motion_ -= of_motion * of_motion.transpose() / S;
  between_ -= of_motion / S * of_systematic.transpose();
  of_systematic_ -= of_systematic * of_systematic.transpose() / S;
  make_symmetric(of_systematic_);
}

PredictedMotion PendingMotion::prediction() const {
  return {mean_, motion_by_, offset_ - motion_by_ * reference_};
}

Systematic PendingMotion::systematic_of(const Systematic& drawn_with) const {
  return now_ + systematic_by_ * (drawn_with - reference_);
}

Eigen::Matrix<double, Eigen::Dynamic, 3, 0, kMostSystematic, 3> PendingMotion::gain() const {
  return Eigen::LDLT<Matrix3>(of_motion_).solve(between_).transpose();
}

void PendingMotion::drawn(const Systematic& mean) {
  const Eigen::Index n = systematic();
  if (n > 0) {
    of_systematic_ -= gain() * between_;
    make_symmetric(of_systematic_);
  }
  mean_ = {};
  of_motion_.setZero();
  offset_.setZero();
  between_ = motion_by_ = BySystematic::Zero(3, n);
  systematic_by_ = SystematicCovariance::Identity(n, n);
  reference_ = now_ = mean;
}

}  // namespace trundle::slam
