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

/// The Kalman update of pose, covariance (Joseph form) and sensitivity. `of_pose`: Hᵀ W H. `revealed`:
/// SensitivityErrors.
void update(Odometer& odometer, SensitivityErrors& errors, std::optional<ParityFilter>& parity,
            const ReferenceMeasurement& m, const Weight& W, const Matrix3& of_pose,
            const PoseSensitivity& revealed) {
  const Matrix3 P = odometer.white_covariance();
  const Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, 8> K = P * m.H.transpose() * W;
  const Vector3 step = K * m.innovation;
  const Matrix3 keep = Matrix3::Identity() - K * m.H;
  const Matrix3 noise = K * m.variance.asDiagonal() * K.transpose();
  if (parity) parity->close(odometer.pose());
  odometer.correct(step, keep, noise, odometer.sensitivity() + revealed - K * m.J);
  Eigen::MatrixX3d sum_by_pose;
  if (parity) sum_by_pose = parity->correct(m, W, keep, errors, odometer.pose());
  errors.correct(of_pose, keep, odometer.pose(), sum_by_pose);
}

/// The sensitivity as the innovation corrects it: eq. 6a.
PoseSensitivity reveal(SensitivityErrors& errors, const Odometer& odometer, const Weight& W,
                       ReferenceMeasurement& m) {
  const PoseSensitivity revealed = errors.revealed(m.H.transpose() * (W * m.innovation), odometer.pose());
  m.J += m.H * revealed;
  return revealed;
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

Information& block_of(RunLikelihood& likelihood, std::size_t epoch, std::size_t epochs) {
  const std::size_t blocks = likelihood.blocks.size();
  return likelihood.blocks[std::min(blocks - 1, epoch * blocks / epochs)];
}

}  // namespace

Information RunLikelihood::total() const {
  assert(!blocks.empty());
  Information sum = Information::zero(blocks.front().gradient.size());
  for (const Information& block : blocks) sum.add(block);
  return sum;
}

RunLikelihood stream_likelihood(const Run& run, const Robot& robot, std::span<const Parameter> parameters,
                                const LikelihoodOptions& options) {
  const auto n = static_cast<Eigen::Index>(parameters.size());
  RunLikelihood result{
      std::vector<Information>(static_cast<std::size_t>(options.blocks), Information::zero(n)), {}, {}};
  if (run.epochs.empty()) return result;
  Odometer odometer = odometer_at_epoch(run, 0, robot, parameters, options.reference_noise);
  const Chassis read = as_run_read(robot.chassis, run, options);
  SensitivityErrors errors(robot, parameters, odometer.pose(), read, options.with_noise);
  std::optional<ParityFilter> parity;
  if (const auto& redundant = options.redundant)
    parity.emplace(run, redundant->robot, parameters, redundant->options);
  const auto skip = [&](std::size_t increments, Information& block) {
    for (std::size_t i = 0; parity && i < increments; ++i) parity->skip(block);
  };
  skip(run.epochs.front(), result.blocks.front());
  bool is_doubted = false;  // the last epoch contradicted it
  const auto start_anew = [&](std::size_t epoch) {
    odometer = odometer_at_epoch(run, epoch, robot, parameters, options.reference_noise);
    errors = {robot, parameters, odometer.pose(), read, options.with_noise};
    if (parity) parity->restart();
    is_doubted = false;
  };
  for (std::size_t epoch = 1; epoch < run.epochs.size(); ++epoch) {
    for (std::size_t i = run.epochs[epoch - 1]; i < run.epochs[epoch]; ++i) {
      const Pose2 from = odometer.pose();
      const Rolling rolling = odometer.state().rolling;
      const Increment increment = step_along(run, i, odometer);
      if (parity)
        parity->follow(increment, from, rolling, odometer, errors,
                       block_of(result, epoch, run.epochs.size()));
      else
        errors.follow(increment, odometer.pose());
    }
    const double time = run.epoch_time(epoch);
    const ReferenceSample sample = sample_reference(run.reference, time - robot.reference_time_offset_s);
    if (std::ranges::binary_search(run.jumps, epoch)) {
      result.outliers.push_back({time, true});
      start_anew(epoch);
      continue;
    }
    if (sample.empty()) continue;
    if (!is_finite(odometer.pose())) {
      result.blocks.front().chi2 = kEverything;
      return result;
    }
    ReferenceMeasurement m = measure(sample, odometer, robot, parameters, options.reference_noise);
    const Weight W = m.weight(odometer.white_covariance());
    const double distance = m.innovation.dot(W * m.innovation);
    const PoseSensitivity revealed = reveal(errors, odometer, W, m);
    if (!add_within(block_of(result, epoch, run.epochs.size()), m.J, W, m.innovation, options.gate)) {
      result.outliers.push_back({time, false});
      // What two in a row contradict is the filter: it would leave out all that follow.
      if (is_doubted)
        start_anew(epoch);
      else
        is_doubted = true;
      continue;
    }
    const Matrix3 of_pose = m.H.transpose() * W * m.H;
    block_of(result, epoch, run.epochs.size()).add_noise(errors.noise_in_information(of_pose));
    is_doubted = false;
    result.innovations.push_back(innovation_of(m, W, time, distance));
    update(odometer, errors, parity, m, W, of_pose, revealed);
  }
  skip(run.readings.increments.size() - run.epochs.back(), result.blocks.back());
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
    errors.follow(increment, odometer.pose());
  }
  if (!is_finite(odometer.pose())) {
    result.blocks.front().chi2 = kEverything;
    return result;
  }
  ReferenceMeasurement m = measure_end(run.partial, odometer, robot, parameters);
  const Weight W = m.weight(odometer.white_covariance());
  reveal(errors, odometer, W, m);
  result.blocks.front().add(m.J, W, m.innovation);
  result.blocks.front().add_noise(errors.noise_in_information(m.H.transpose() * W * m.H));
  return result;
}

}  // namespace trundle::calibration
