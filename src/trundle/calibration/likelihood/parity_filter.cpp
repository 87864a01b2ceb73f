#include "trundle/calibration/likelihood/parity_filter.hpp"

#include <utility>

#include "trundle/geometry/decompositions.hpp"

namespace trundle::calibration {
ParityFilter::ParityFilter(const Run& run, const Robot& robot, const Chassis& weighing,
                           std::span<const Parameter> parameters, const ChassisLikelihoodOptions& options,
                           OwnSensitivity& own)
    : windows_(run, robot.chassis, weighing, parameters, kParityWindow_s, options.sums, options.with_noise),
      options_(options),
      parameters_(static_cast<Eigen::Index>(parameters.size())),
      own_(own) {}

void ParityFilter::end_arc(const Pose2& pose) {
  if (parity_.with_pose.cols() == 0) return;
  const auto [F, M] = arc_errors(parity_.arc_start, pose);
  const CommonError own = windows_.take_common_error();
  parity_.with_pose = (F * parity_.with_pose).eval();
  if (own.cols() > 0) parity_.with_pose += M * own;
  parity_.arc_start = pose;
  parity_.arc_s = 0.0;
}

void ParityFilter::begin(const Pose2& pose) {
  const Eigen::Index m = windows_.combinations().cols();
  parity_ = {.with_pose = CommonError::Zero(3, m),
             .correction = Eigen::VectorXd::Zero(m),
             .variance_reduction = Eigen::MatrixXd::Zero(m, m),
             .correction_by_parameters = Eigen::MatrixXd::Zero(m, parameters_ + own_.columns()),
             .arc_start = pose};
}

std::optional<Contradiction> ParityFilter::take(double time_s, const Rolling* before) {
  std::optional<Contradiction> ended = windows_.take(before);
  if (ended) ended->J = own_.extended(ended->J, time_s - 0.5 * kParityWindow_s);
  return ended;
}

void ParityFilter::skip(double time_s, Information& information) {
  if (const auto ended = take(time_s, nullptr)) add_to(information, *ended, options_);
}

void ParityFilter::propagate(const Increment& increment, const Pose2& from, const Rolling& rolling,
                             Odometer& odometer, SensitivityErrors& errors, Information& information) {
  if (!windows_.any()) return errors.propagate(increment, odometer.pose());
  const std::optional<Contradiction> ended = take(increment.time_s, &rolling);
  if (windows_.is_within()) {
    if (parity_.with_pose.cols() == 0) begin(from);
    errors.add_to_parity(windows_.combinations(), from);
  }
  errors.propagate(increment, odometer.pose());
  parity_.arc_s += increment.duration_s;
  const bool goes_on = !ended && windows_.is_within();
  if (goes_on && parity_.arc_s < kLongestArc_s) return;
  end_arc(odometer.pose());
  if (goes_on) return;
  errors.end_parity(odometer.pose());
  if (ended) measure(*ended, increment.time_s, odometer, errors, information);
  errors.drop_parity();
  parity_ = {};
}

void ParityFilter::measure(const Contradiction& ended, double time_s, Odometer& odometer,
                           SensitivityErrors& errors, Information& information) {
  // Ways become sure only later, and then their variances may contradict each other: no covariance is as
  // large. They count as independent then.
  Eigen::MatrixXd S = options_.variance_factor * ended.S;
  const bool common =
      parity_.with_pose.cols() > 0 && is_positive_semidefinite(S - parity_.variance_reduction);
  Eigen::VectorXd innovation = -ended.y;
  Eigen::MatrixXd J = -ended.J;
  if (common) {
    S -= parity_.variance_reduction;
    innovation -= parity_.correction;
    J += parity_.correction_by_parameters;
  }
  const Eigen::MatrixXd W = inverse_of(S);
  const Eigen::VectorXd weighed = W * innovation;
  if (common)
    for (std::size_t j = 0; j < errors.of_parity().size(); ++j)
      J.col(static_cast<Eigen::Index>(j)) += errors.of_parity()[j].parity_parity * weighed;
  if (!add_within(information, J, W, innovation, options_.gate)) return;
  if (options_.with_noise)
    information.add_noise(common && !errors.of_parity().empty() ? errors.noise_in_parity(W)
                                                                : information_of_noise(W, ended.J_errors));
  if (!common) return;
  const CommonError K = parity_.with_pose * W;
  const Matrix3 reduction = K * parity_.with_pose.transpose();
  if (!is_positive_semidefinite(odometer.white_covariance() - reduction)) return;
  const Eigen::Matrix3Xd KJ = K * J;
  own_.advance(odometer, time_s);
  PoseSensitivity sensitivity = odometer.sensitivity() - KJ.leftCols(parameters_);
  for (std::size_t j = 0; j < errors.of_parity().size(); ++j)
    sensitivity.col(static_cast<Eigen::Index>(j)) += errors.of_parity()[j].pose_parity * weighed;
  odometer.correct(K * innovation, Matrix3::Identity(), -reduction, sensitivity);
  own_.correct(KJ.rightCols(own_.columns()), odometer);
  errors.correct_by_parity(W, K, odometer.pose());
}

Eigen::MatrixX3d ParityFilter::correct(const ReferenceMeasurement& m, const ReferenceMeasurement::Weight& W,
                                       const Matrix3& keep, const SensitivityErrors& errors,
                                       const Pose2& pose) {
  if (parity_.with_pose.cols() == 0) return {};
  const Eigen::MatrixXd HC = m.H * parity_.with_pose;
  const Eigen::MatrixXd K = HC.transpose() * W;
  const Vector3 weighed = m.H.transpose() * (W * m.innovation);
  parity_.correction += K * m.innovation;
  parity_.variance_reduction += K * HC;
  parity_.correction_by_parameters -= K * m.J;
  for (std::size_t j = 0; j < errors.of_parity().size(); ++j)
    parity_.correction_by_parameters.col(static_cast<Eigen::Index>(j)) +=
        errors.of_parity()[j].parity_pose * weighed;
  parity_.with_pose = (keep * parity_.with_pose).eval();
  parity_.arc_start = pose;
  return -K * m.H;
}

}  // namespace trundle::calibration
