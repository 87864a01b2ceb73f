#include "trundle/calibration/run_likelihood.hpp"

#include <algorithm>
#include <array>
#include <cassert>

#include <Eigen/LU>

#include "trundle/calibration/errors_in_variables.hpp"
#include "trundle/odometry/odometer.hpp"

namespace trundle {
namespace {

using Residual = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 8, 1>;
using Selection = Eigen::Matrix<double, Eigen::Dynamic, 3, 0, 8, 3>;
using Jacobian = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 8, kMaxParameters>;
using Weight = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 8, 8>;

// Without a measured heading at the start, it is found from the course over the first knots.
constexpr double kUnknownHeadingSigma_rad = 1.0;

/// Column of a parameter kind among the estimated ones, or −1.
int column_of(std::span<const Parameter> parameters, ParameterKind kind) {
  const auto it = std::ranges::find(parameters, kind, &Parameter::kind);
  return it == parameters.end() ? -1 : static_cast<int>(it - parameters.begin());
}

Vector2 perpendicular(const Vector2& v) {
  return {-v.y(), v.x()};
}

/// Adds ∂(world_from_reference)/∂(body_from_reference) · sign to the columns of the sensor's pose.
void add_sensor_columns(const Pose2& pose, const Vector2& lever_in_world, double sign,
                        std::span<const Parameter> parameters, PoseSensitivity& J) {
  const Matrix2 R = rotation(pose.heading);
  if (const int x = column_of(parameters, ParameterKind::reference_x); x >= 0)
    J.col(x).head<2>() += sign * R.col(0);
  if (const int y = column_of(parameters, ParameterKind::reference_y); y >= 0)
    J.col(y).head<2>() += sign * R.col(1);
  if (const int h = column_of(parameters, ParameterKind::reference_heading); h >= 0) {
    J(2, h) += sign;
    if (sign < 0.0) J.col(h).head<2>() += perpendicular(lever_in_world);
  }
}

void add_time_column(const Vector3& rate, double sign, std::span<const Parameter> parameters,
                     PoseSensitivity& J) {
  if (const int t = column_of(parameters, ParameterKind::time_offset); t >= 0)
    J.col(t) += sign * rate.array().isFinite().select(rate, 0.0).matrix();
}

struct Start {
  Pose2 pose;
  Matrix3 covariance;
  PoseSensitivity sensitivity;
};

/// Where the body stands when the reference sensor is at `sensor`: world_from_sensor * sensor_from_body.
Start start_from(const Pose2& sensor, const Matrix3& sensor_covariance, const Vector3& rate,
                 const Robot& robot, std::span<const Parameter> parameters) {
  const Pose2& mount = robot.body_from_reference;
  Start start;
  start.pose = sensor * mount.inverse();
  const Vector2 lever = rotation(start.pose.heading) * mount.translation();
  start.sensitivity = PoseSensitivity::Zero(3, static_cast<Eigen::Index>(parameters.size()));
  add_sensor_columns(start.pose, lever, -1.0, parameters, start.sensitivity);
  add_time_column(rate, -1.0, parameters, start.sensitivity);
  Matrix3 F = Matrix3::Identity();
  F.topRightCorner<2, 1>() = -perpendicular(lever);
  start.covariance = F * sensor_covariance * F.transpose();
  return start;
}

void set_state(Odometer& odometer, const Pose2& pose, const Matrix3& covariance,
               const PoseSensitivity& sensitivity) {
  OdometerState state = odometer.state();
  state.pose = pose;
  state.white = symmetric_of(covariance);
  state.bias = {};
  for (Eigen::Index j = 0; j < sensitivity.cols(); ++j)
    for (Eigen::Index i = 0; i < 3; ++i)
      state.sensitivity[static_cast<std::size_t>(j)][static_cast<std::size_t>(i)] = sensitivity(i, j);
  odometer.resume(state);
}

Odometer odometer_at(const Start& start, const Robot& robot, std::span<const Parameter> parameters) {
  Odometer odometer(robot, {.parameters = {parameters.begin(), parameters.end()}});
  set_state(odometer, start.pose, start.covariance, start.sensitivity);
  return odometer;
}

/// The course over the ground from the first knots, for references without heading.
double heading_from_course(const Run& run, const Robot& robot, std::size_t first_knot) {
  Odometer odometer(robot, {});
  const double offset = robot.reference_time_offset_s;
  const Vector2 origin = sample_reference(run.reference, run.knot_time(first_knot) - offset).value.head<2>();
  std::size_t done = run.knots[first_knot];
  // Σ odometry × reference and Σ odometry · reference give the rotation that aligns the two courses best.
  double sine = 0.0;
  double cosine = 0.0;
  for (std::size_t knot = first_knot + 1; knot < std::min(run.knots.size(), first_knot + 30); ++knot) {
    for (; done < run.knots[knot]; ++done) odometer.step(run.readings.increments[done]);
    const ReferenceSample sample = sample_reference(run.reference, run.knot_time(knot) - offset);
    if (!sample.has_position()) continue;
    const Vector2 seen = sample.value.head<2>() - origin;
    const Vector2 driven = odometer.pose().translation();
    sine += driven.x() * seen.y() - driven.y() * seen.x();
    cosine += driven.dot(seen);
  }
  return std::atan2(sine, cosine);
}

/// Whether no sensor on board saw any motion in the interval that follows a place in the log.
bool stands_still(const Run& run, std::size_t increment) {
  const auto& increments = run.readings.increments;
  return increment < increments.size() && !any_turns(increments[increment]);
}

/// Where the reference is at a knot: its mean over the time that the robot stands there.
struct Standing {
  ReferenceSample mean;
  double samples = 0.0;
};

Standing standing_at(const Run& run, std::size_t knot, const Robot& robot) {
  Standing standing;
  standing.mean = sample_reference(run.reference, run.knot_time(knot) - robot.reference_time_offset_s);
  standing.samples = 1.0;
  Vector3 sum = Vector3::Zero();
  for (std::size_t i = run.knots[knot]; stands_still(run, i); ++i) {
    const ReferenceSample sample =
        sample_reference(run.reference, run.readings.increments[i].time_s - robot.reference_time_offset_s);
    Vector3 step = sample.value - standing.mean.value;
    step.z() = wrap_angle(step.z());
    if (sample.has_position() != standing.mean.has_position() ||
        sample.has_heading() != standing.mean.has_heading())
      break;
    sum += step;
    standing.samples += 1.0;
  }
  standing.mean.value += sum / standing.samples;
  return standing;
}

/// Starts, or starts again after a jump, where the reference is at a knot.
Odometer anchor(const Run& run, std::size_t knot, const Robot& robot, std::span<const Parameter> parameters,
                const ReferenceNoise& noise) {
  const auto [sample, samples] = standing_at(run, knot, robot);
  Vector3 sigma = noise.sigma() / std::sqrt(samples);
  Pose2 sensor;
  if (sample.has_position()) sensor = {sample.value.x(), sample.value.y(), 0.0};
  if (sample.has_heading()) {
    sensor.heading = sample.value.z();
  } else {
    sensor.heading = heading_from_course(run, robot, knot) + robot.body_from_reference.heading;
    sigma.z() = kUnknownHeadingSigma_rad;
  }
  const Matrix3 covariance = sigma.cwiseAbs2().asDiagonal();
  return odometer_at(start_from(sensor, covariance, sample.rate, robot, parameters), robot, parameters);
}

/// One linearised measurement z = h(pose, p) + noise of the present pose.
struct Measurement {
  Residual innovation;
  Selection H;  ///< ∂h/∂pose
  Jacobian J;   ///< ∂h/∂p − ∂z/∂p, with the sensitivity of the pose included
  Residual variance;
  std::array<int, 8> component{};  ///< of (x, y, heading) in each row
};

Measurement measure(const ReferenceSample& sample, const Odometer& odometer, const Robot& robot,
                    std::span<const Parameter> parameters, const ReferenceNoise& noise) {
  const Pose2 sensor = odometer.pose() * robot.body_from_reference;
  const Vector2 lever = sensor.translation() - odometer.pose().translation();
  Matrix3 H = Matrix3::Identity();
  H.topRightCorner<2, 1>() = perpendicular(lever);
  PoseSensitivity J = H * odometer.sensitivity();
  add_sensor_columns(odometer.pose(), lever, 1.0, parameters, J);
  add_time_column(sample.rate, 1.0, parameters, J);
  const Vector3 innovation(sample.value.x() - sensor.x, sample.value.y() - sensor.y,
                           wrap_angle(sample.value.z() - sensor.heading));
  const Vector3 sigma = noise.sigma_at_knots();
  Measurement measurement;
  for (int i = 0; i < 3; ++i) {
    if (!std::isfinite(innovation[i])) continue;
    const auto n = measurement.innovation.size();
    measurement.innovation.conservativeResize(n + 1);
    measurement.variance.conservativeResize(n + 1);
    measurement.H.conservativeResize(n + 1, 3);
    measurement.J.conservativeResize(n + 1, J.cols());
    measurement.innovation[n] = innovation[i];
    measurement.variance[n] = sigma[i] * sigma[i];
    measurement.H.row(n) = H.row(i);
    measurement.J.row(n) = J.row(i);
    measurement.component[static_cast<std::size_t>(n)] = i;
  }
  return measurement;
}

Weight weight_of(const Measurement& measurement, const Matrix3& P) {
  Weight S = measurement.H * P * measurement.H.transpose();
  S.diagonal() += measurement.variance;
  return S.inverse();
}

Innovation innovation_of(const Measurement& m, const Weight& W, double time_s, double distance) {
  Innovation innovation{.time_s = time_s,
                        .squared_mahalanobis = distance,
                        .normalised = Vector3::Zero(),
                        .count = static_cast<int>(m.innovation.size())};
  const Weight S = W.inverse();
  for (Eigen::Index i = 0; i < m.innovation.size(); ++i)
    innovation.normalised[m.component[static_cast<std::size_t>(i)]] = m.innovation[i] / std::sqrt(S(i, i));
  return innovation;
}

/// The Kalman update of pose, covariance (Joseph form) and sensitivity. `revealed`: SensitivityErrors.
void update(Odometer& odometer, SensitivityErrors& errors, const Measurement& m, const Weight& W,
            const PoseSensitivity& revealed) {
  const Matrix3 P = odometer.white_covariance();
  const Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, 8> K = P * m.H.transpose() * W;
  const Vector3 step = K * m.innovation;
  const Matrix3 keep = Matrix3::Identity() - K * m.H;
  const Matrix3 noise = K * m.variance.asDiagonal() * K.transpose();
  odometer.correct(step, keep, noise, odometer.sensitivity() + revealed - K * m.J);
  errors.correct(keep, odometer.pose());
}

/// The sensitivity as the innovation corrects it: eq. 6a.
PoseSensitivity reveal(SensitivityErrors& errors, const Odometer& odometer, const Weight& W, Measurement& m) {
  const PoseSensitivity revealed = errors.revealed(m.H.transpose() * (W * m.innovation), odometer.pose());
  m.J += m.H * revealed;
  return revealed;
}

Information& piece_of(RunLikelihood& likelihood, std::size_t knot, std::size_t knots) {
  const std::size_t pieces = likelihood.pieces.size();
  return likelihood.pieces[std::min(pieces - 1, knot * pieces / knots)];
}

/// What the run as a whole was measured to be, as residuals of its end pose relative to its start.
Measurement measure_end(const PartialReference& partial, const Odometer& odometer, const Robot& robot,
                        std::span<const Parameter> parameters) {
  const ReferenceSample unused{.value = Vector3::Zero(), .rate = Vector3::Zero()};
  // Borrow pose, H and J of the reference sensor; the residuals below are functions of that pose.
  const Measurement sensor = measure(unused, odometer, robot, parameters, {});
  const Pose2 end = odometer.pose() * robot.body_from_reference;
  Measurement m;
  const auto add = [&](double innovation, const Vector3& gradient, double sigma) {
    const auto n = m.innovation.size();
    m.innovation.conservativeResize(n + 1);
    m.variance.conservativeResize(n + 1);
    m.H.conservativeResize(n + 1, 3);
    m.J.conservativeResize(n + 1, sensor.J.cols());
    m.innovation[n] = innovation;
    m.variance[n] = sigma * sigma;
    m.H.row(n) = gradient.transpose() * sensor.H;
    m.J.row(n) = gradient.transpose() * sensor.J;
  };
  if (partial.closed) {
    add(-end.x, Vector3::UnitX(), partial.closed->sigma);
    add(-end.y, Vector3::UnitY(), partial.closed->sigma);
  }
  if (partial.closed_heading) add(wrap_angle(-end.heading), Vector3::UnitZ(), partial.closed_heading->sigma);
  if (partial.distance_m) {
    const double distance = std::max(std::hypot(end.x, end.y), 1e-12);
    add(partial.distance_m->value - distance, {end.x / distance, end.y / distance, 0.0},
        partial.distance_m->sigma);
  }
  if (partial.turns)
    add(2.0 * kPi * partial.turns->value - end.heading, Vector3::UnitZ(), 2.0 * kPi * partial.turns->sigma);
  if (partial.end_x_m) add(partial.end_x_m->value - end.x, Vector3::UnitX(), partial.end_x_m->sigma);
  if (partial.end_y_m) add(partial.end_y_m->value - end.y, Vector3::UnitY(), partial.end_y_m->sigma);
  if (partial.end_heading_rad)
    add(wrap_angle(partial.end_heading_rad->value - end.heading), Vector3::UnitZ(),
        partial.end_heading_rad->sigma);
  return m;
}

}  // namespace

Information RunLikelihood::total() const {
  assert(!pieces.empty());
  Information sum = Information::zero(pieces.front().gradient.size());
  for (const Information& piece : pieces) sum.add(piece);
  return sum;
}

RunLikelihood stream_likelihood(const Run& run, const Robot& robot, std::span<const Parameter> parameters,
                                const LikelihoodOptions& options) {
  const auto n = static_cast<Eigen::Index>(parameters.size());
  RunLikelihood result{
      std::vector<Information>(static_cast<std::size_t>(options.pieces), Information::zero(n)), {}, {}};
  if (run.knots.empty()) return result;
  Odometer odometer = anchor(run, 0, robot, parameters, options.reference_noise);
  SensitivityErrors errors(robot, parameters, odometer.pose(), options.gyro_factor);
  for (std::size_t knot = 1; knot < run.knots.size(); ++knot) {
    for (std::size_t i = run.knots[knot - 1]; i < run.knots[knot]; ++i) {
      odometer.step(run.readings.increments[i]);
      errors.follow(run.readings.increments[i], odometer.pose());
    }
    const double time = run.knot_time(knot);
    const ReferenceSample sample = sample_reference(run.reference, time - robot.reference_time_offset_s);
    if (std::ranges::binary_search(run.jumps, knot)) {
      result.outliers.push_back({time, true});
      odometer = anchor(run, knot, robot, parameters, options.reference_noise);
      errors = {robot, parameters, odometer.pose(), options.gyro_factor};
      continue;
    }
    if (sample.empty()) continue;
    Measurement m = measure(sample, odometer, robot, parameters, options.reference_noise);
    const Weight W = weight_of(m, odometer.white_covariance());
    const double distance = m.innovation.dot(W * m.innovation);
    const PoseSensitivity revealed = reveal(errors, odometer, W, m);
    if (!add_within(piece_of(result, knot, run.knots.size()), m.J, W, m.innovation, options.gate)) {
      result.outliers.push_back({time, false});
      continue;
    }
    result.innovations.push_back(innovation_of(m, W, time, distance));
    update(odometer, errors, m, W, revealed);
  }
  return result;
}

Pose2 body_at_start(const Run& run, const Robot& robot) {
  return anchor(run, 0, robot, {}, {}).pose();
}

RunLikelihood partial_likelihood(const Run& run, const Robot& robot, std::span<const Parameter> parameters,
                                 double gyro_factor) {
  const auto n = static_cast<Eigen::Index>(parameters.size());
  RunLikelihood result{{Information::zero(n)}, {}, {}};
  if (run.partial.empty()) return result;
  Odometer odometer = odometer_at(start_from(Pose2{}, Matrix3::Zero(), Vector3::Zero(), robot, parameters),
                                  robot, parameters);
  SensitivityErrors errors(robot, parameters, odometer.pose(), gyro_factor);
  for (const Increment& increment : run.readings.increments) {
    odometer.step(increment);
    errors.follow(increment, odometer.pose());
  }
  Measurement m = measure_end(run.partial, odometer, robot, parameters);
  const Weight W = weight_of(m, odometer.white_covariance());
  reveal(errors, odometer, W, m);
  result.pieces.front().add(m.J, W, m.innovation);
  return result;
}

}  // namespace trundle
