#include "trundle/calibration/likelihood/parity_filter.hpp"

#include <algorithm>
#include <utility>

#include "trundle/geometry/decompositions.hpp"

namespace trundle::calibration {
ParityFilter::ParityFilter(const Run& run, const Robot& robot, std::span<const Parameter> parameters,
                           const ChassisLikelihoodOptions& options)
    : windows_(run, robot.chassis, parameters, options.window_s, options.sums, options.with_noise),
      options_(options),
      parameters_(static_cast<Eigen::Index>(parameters.size())) {}

// Where the readings' noise shows as a share of what they are said to have, so does what is common; what
// shows beside it need not be common.
void ParityFilter::close(const Pose2& pose) {
  if (sum_.with_pose.cols() == 0) return;
  const auto [F, M] = arc_errors(sum_.from, pose);
  const CommonError own = std::min(options_.variance_factor, 1.0) * windows_.take_common_error();
  sum_.with_pose = (F * sum_.with_pose).eval();
  if (own.cols() > 0) sum_.with_pose += M * own;
  sum_.from = pose;
  sum_.open_s = 0.0;
}

void ParityFilter::begin(const Pose2& pose) {
  const Eigen::Index m = windows_.combinations().cols();
  sum_ = {.with_pose = CommonError::Zero(3, m),
          .moved = Eigen::VectorXd::Zero(m),
          .lessened = Eigen::MatrixXd::Zero(m, m),
          .moved_by_parameters = Eigen::MatrixXd::Zero(m, parameters_),
          .from = pose};
}

void ParityFilter::skip(Information& information) {
  if (const auto ended = windows_.take()) add_to(information, *ended, options_);
}

void ParityFilter::follow(const Increment& increment, const Pose2& from, const Rolling& rolling,
                          Odometer& odometer, SensitivityErrors& errors, Information& information) {
  if (!windows_.any()) return errors.follow(increment, odometer.pose());
  const std::optional<Contradiction> ended = windows_.take(&rolling);
  if (windows_.is_within()) {
    if (sum_.with_pose.cols() == 0) begin(from);
    errors.add_to_sum(windows_.combinations(), from);
  }
  errors.follow(increment, odometer.pose());
  sum_.open_s += increment.duration_s;
  const bool goes_on = !ended && windows_.is_within();
  if (goes_on && sum_.open_s < kLongestArc_s) return;
  close(odometer.pose());
  if (goes_on) return;
  errors.end_sum(odometer.pose());
  if (ended) measure(*ended, odometer, errors, information);
  errors.drop_sum();
  sum_ = {};
}

void ParityFilter::measure(const Contradiction& ended, Odometer& odometer, SensitivityErrors& errors,
                           Information& information) {
  // Ways become sure only later, and then their variances may contradict each other: no covariance is as
  // large. They count as independent then.
  Eigen::MatrixXd S = options_.variance_factor * ended.S;
  const bool common = sum_.with_pose.cols() > 0 && is_positive_semidefinite(S - sum_.lessened);
  Eigen::VectorXd innovation = -ended.y;
  Eigen::MatrixXd J = -ended.J;
  if (common) {
    S -= sum_.lessened;
    innovation -= sum_.moved;
    J += sum_.moved_by_parameters;
  }
  const Eigen::MatrixXd W = inverse_of(S);
  const Eigen::VectorXd weighed = W * innovation;
  if (common)
    for (std::size_t j = 0; j < errors.of_sum().size(); ++j)
      J.col(static_cast<Eigen::Index>(j)) += errors.of_sum()[j].sum_sum * weighed;
  if (!add_within(information, J, W, innovation, options_.gate)) return;
  if (options_.with_noise)
    information.add_noise(common && !errors.of_sum().empty() ? errors.noise_in_sum(W)
                                                             : noise_in(ended, W, options_));
  if (!common) return;
  const CommonError K = sum_.with_pose * W;
  const Matrix3 lessened = K * sum_.with_pose.transpose();
  if (!is_positive_semidefinite(odometer.white_covariance() - lessened)) return;
  PoseSensitivity sensitivity = odometer.sensitivity() - K * J;
  for (std::size_t j = 0; j < errors.of_sum().size(); ++j)
    sensitivity.col(static_cast<Eigen::Index>(j)) += errors.of_sum()[j].pose_sum * weighed;
  odometer.correct(K * innovation, Matrix3::Identity(), -lessened, sensitivity);
  errors.correct_by_sum(W, K, odometer.pose());
}

Eigen::MatrixX3d ParityFilter::correct(const ReferenceMeasurement& m, const ReferenceMeasurement::Weight& W,
                                       const Matrix3& keep, const SensitivityErrors& errors,
                                       const Pose2& pose) {
  if (sum_.with_pose.cols() == 0) return {};
  const Eigen::MatrixXd HC = m.H * sum_.with_pose;
  const Eigen::MatrixXd K = HC.transpose() * W;
  const Vector3 weighed = m.H.transpose() * (W * m.innovation);
  sum_.moved += K * m.innovation;
  sum_.lessened += K * HC;
  sum_.moved_by_parameters -= K * m.J;
  for (std::size_t j = 0; j < errors.of_sum().size(); ++j)
    sum_.moved_by_parameters.col(static_cast<Eigen::Index>(j)) += errors.of_sum()[j].sum_pose * weighed;
  sum_.with_pose = (keep * sum_.with_pose).eval();
  sum_.from = pose;
  return -K * m.H;
}

}  // namespace trundle::calibration
