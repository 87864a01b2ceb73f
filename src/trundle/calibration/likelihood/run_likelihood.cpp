#include "trundle/calibration/likelihood/run_likelihood.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include <Eigen/LU>

#include "trundle/calibration/likelihood/errors_in_variables.hpp"
#include "trundle/calibration/likelihood/parity_filter.hpp"
#include "trundle/calibration/likelihood/reading_noise.hpp"
#include "trundle/calibration/likelihood/reference_measurement.hpp"
#include "trundle/odometry/odometer.hpp"

namespace trundle::calibration {
namespace {

using Weight = ReferenceMeasurement::Weight;

Innovation innovation_of(const ReferenceMeasurement& m, const Weight& W, double time_s, double distance) {
  Innovation innovation{.time_s = time_s,
                        .squared_mahalanobis = distance,
                        .log_determinant = -std::log(W.determinant()),
                        .normalised = Vector3::Zero(),
                        .count = static_cast<int>(m.innovation.size())};
  const Weight S = W.inverse();
  for (Eigen::Index i = 0; i < m.innovation.size(); ++i)
    innovation.normalised[m.component[static_cast<std::size_t>(i)]] = m.innovation[i] / std::sqrt(S(i, i));
  return innovation;
}

/// The sensitivity as the innovation corrects it: eq. 6a.
PoseSensitivity correct_sensitivity(SensitivityErrors& errors, const Odometer& odometer, const Weight& W,
                                    ReferenceMeasurement& m) {
  const PoseSensitivity correction = errors.correction(m.H.transpose() * (W * m.innovation), odometer.pose());
  m.J += m.H * correction;
  return correction;
}

void append_columns(const ReferenceMeasurement::Jacobian& more, ReferenceMeasurement::Jacobian& J) {
  J.conservativeResize(Eigen::NoChange, J.cols() + more.cols());
  J.rightCols(more.cols()) = more;
}

/// The chassis with the noise of the run's readings alone.
Chassis as_run_read(const Chassis& chassis, const Run& run, const LikelihoodOptions& options) {
  const Chassis& noisy = options.readings ? *options.readings : chassis;
  ReadingNoise noise = noise_in_readings(run.readings.increments, noisy);
  noise.gyro_rad_s_sqrt_hz = options.gyro_noise_rad_s_sqrt_hz;
  return as_read(noisy, noise);
}

/// What a robot by which the path is no number leaves unexplained.
constexpr double kEverything = std::numeric_limits<double>::infinity();

bool is_finite(const Pose2& pose) {
  return std::isfinite(pose.x) && std::isfinite(pose.y) && std::isfinite(pose.heading);
}

/// The Kalman filter that follows a run's reference, and what its innovations say of the parameters.
class ReferenceFilter {
 public:
  ReferenceFilter(const Run& run, const Robot& robot, std::span<const Parameter> parameters,
                  const LikelihoodOptions& options, RunLikelihood& result)
      : run_(run),
        robot_(robot),
        parameters_(parameters),
        options_(options),
        result_(result),
        read_(as_run_read(robot.chassis, run, options)),
        odometer_(
            odometer_at_epoch(run, 0, robot, parameters, options.reference_noise, options.own.start_heading)),
        errors_(robot, parameters, odometer_.pose(), read_, options.with_noise),
        own_(run.gyro_walk, options.own) {
    const Vector2 lever = rotation(odometer_.pose().heading) * robot.body_from_reference.translation();
    own_.begin_at_start(odometer_, run.epoch_time(0), lever);
    if (const auto& redundant = options.redundant)
      parity_.emplace(run, redundant->robot, robot.chassis, parameters, redundant->options, own_);
  }

  void run() {
    skip(0, run_.epochs.front(), result_.blocks.front());
    for (std::size_t epoch = 1; epoch < run_.epochs.size(); ++epoch) {
      predict(epoch);
      if (std::ranges::binary_search(run_.jumps, epoch)) {
        result_.outliers.push_back({run_.epoch_time(epoch), true});
        start_anew(epoch);
        continue;
      }
      const ReferenceSample sample =
          sample_reference(run_.reference, run_.epoch_time(epoch) - robot_.reference_time_offset_s);
      if (sample.empty()) continue;
      if (!is_finite(odometer_.pose())) {
        result_.blocks.front().chi2 = kEverything;
        return;
      }
      update(epoch, sample);
    }
    skip(run_.epochs.back(), run_.readings.increments.size(), result_.blocks.back());
  }

 private:
  Information& block_of(std::size_t epoch) {
    const std::size_t blocks = result_.blocks.size();
    return result_.blocks[std::min(blocks - 1, epoch * blocks / run_.epochs.size())];
  }

  /// Increments beside all epochs: no reference follows their motion.
  void skip(std::size_t first, std::size_t last, Information& block) {
    for (std::size_t i = first; parity_ && i < last; ++i)
      parity_->skip(run_.readings.increments.time_s(i), block);
  }

  void start_anew(std::size_t epoch) {
    odometer_ = odometer_at_epoch(run_, epoch, robot_, parameters_, options_.reference_noise);
    errors_ = {robot_, parameters_, odometer_.pose(), read_, options_.with_noise};
    own_.begin(odometer_, run_.epoch_time(epoch));
    if (parity_) parity_->restart();
    is_contradicted_ = false;
  }

  /// To an epoch, from the one before.
  void predict(std::size_t epoch) {
    for (std::size_t i = run_.epochs[epoch - 1]; i < run_.epochs[epoch]; ++i) {
      const Pose2 from = odometer_.pose();
      const Rolling rolling = odometer_.state().rolling;
      const Increment increment = step_along(run_, i, odometer_);
      if (parity_)
        parity_->propagate(increment, from, rolling, odometer_, errors_, block_of(epoch));
      else
        errors_.propagate(increment, odometer_.pose());
    }
  }

  void update(std::size_t epoch, const ReferenceSample& sample) {
    ReferenceMeasurement m = measure(sample, odometer_, robot_, parameters_, options_.reference_noise);
    const Weight W = m.weight(odometer_.white_covariance());
    const double distance = m.innovation.dot(W * m.innovation);
    const PoseSensitivity correction = correct_sensitivity(errors_, odometer_, W, m);
    own_.advance(odometer_, run_.epoch_time(epoch));
    append_columns(m.H * own_.of_pose(), m.J);
    if (!add_within(block_of(epoch), m.J, W, m.innovation, options_.gate)) return reject(epoch);
    const Matrix3 of_pose = m.H.transpose() * W * m.H;
    block_of(epoch).add_noise(errors_.noise_in_information(of_pose));
    is_contradicted_ = false;
    result_.innovations.push_back(innovation_of(m, W, run_.epoch_time(epoch), distance));
    correct(m, W, of_pose, correction);
  }

  /// What two in a row contradict is the filter: it would leave out all that follow.
  void reject(std::size_t epoch) {
    result_.outliers.push_back({run_.epoch_time(epoch), false});
    if (is_contradicted_)
      start_anew(epoch);
    else
      is_contradicted_ = true;
  }

  /// Pose, covariance (Joseph form) and sensitivity. `of_pose`: Hᵀ W H.
  void correct(const ReferenceMeasurement& m, const Weight& W, const Matrix3& of_pose,
               const PoseSensitivity& correction) {
    const Matrix3 P = odometer_.white_covariance();
    const Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, 8> K = P * m.H.transpose() * W;
    const Vector3 step = K * m.innovation;
    const Matrix3 keep = Matrix3::Identity() - K * m.H;
    const Matrix3 noise = K * m.variance.asDiagonal() * K.transpose();
    if (parity_) parity_->end_arc(odometer_.pose());
    const Eigen::Matrix3Xd KJ = K * m.J;
    const auto n = static_cast<Eigen::Index>(parameters_.size());
    odometer_.correct(step, keep, noise, odometer_.sensitivity() + correction - KJ.leftCols(n));
    own_.correct(KJ.rightCols(own_.columns()), odometer_);
    Eigen::MatrixX3d parity_by_pose;
    if (parity_) parity_by_pose = parity_->correct(m, W, keep, errors_, odometer_.pose());
    errors_.correct(of_pose, keep, odometer_.pose(), parity_by_pose);
  }

  const Run& run_;
  const Robot& robot_;
  std::span<const Parameter> parameters_;
  const LikelihoodOptions& options_;
  RunLikelihood& result_;
  Chassis read_;
  Odometer odometer_;
  SensitivityErrors errors_;
  OwnSensitivity own_;
  std::optional<ParityFilter> parity_;
  bool is_contradicted_ = false;  ///< by the last epoch
};

}  // namespace

Information RunLikelihood::total() const {
  assert(!blocks.empty());
  Information sum = Information::zero(blocks.front().gradient.size());
  for (const Information& block : blocks) sum.add(block);
  return sum;
}

RunLikelihood stream_likelihood(const Run& run, const Robot& robot, std::span<const Parameter> parameters,
                                const LikelihoodOptions& options) {
  const Eigen::Index n =
      static_cast<Eigen::Index>(parameters.size()) + OwnSensitivity(run.gyro_walk, options.own).columns();
  RunLikelihood result{
      std::vector<Information>(static_cast<std::size_t>(options.blocks), Information::zero(n)), {}, {}};
  if (!run.epochs.empty()) ReferenceFilter(run, robot, parameters, options, result).run();
  return result;
}

Pose2 body_at(const Run& run, std::size_t epoch, const Robot& robot) {
  return odometer_at_epoch(run, epoch, robot, {}, {}).pose();
}

RunLikelihood partial_likelihood(const Run& run, const Robot& robot, std::span<const Parameter> parameters,
                                 const LikelihoodOptions& options) {
  const auto n = static_cast<Eigen::Index>(parameters.size());
  RunLikelihood result{{Information::zero(n)}, {}, {}};
  if (run.partial.empty()) return result;
  Odometer odometer = odometer_at_origin(robot, parameters);
  SensitivityErrors errors(robot, parameters, odometer.pose(), as_run_read(robot.chassis, run, options),
                           options.with_noise);
  for (std::size_t i = 0; i < run.readings.increments.size(); ++i) {
    const Increment increment = step_along(run, i, odometer);
    errors.propagate(increment, odometer.pose());
  }
  if (!is_finite(odometer.pose())) {
    result.blocks.front().chi2 = kEverything;
    return result;
  }
  ReferenceMeasurement m = measure_end(run.partial, odometer, robot, parameters);
  const Weight W = m.weight(odometer.white_covariance());
  correct_sensitivity(errors, odometer, W, m);
  result.blocks.front().add(m.J, W, m.innovation);
  result.blocks.front().add_noise(errors.noise_in_information(m.H.transpose() * W * m.H));
  return result;
}

}  // namespace trundle::calibration
