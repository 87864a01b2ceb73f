#include "trundle/calibration/likelihood/reference_measurement.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

namespace trundle::calibration {
namespace {

// 1σ of a start heading that only the course over the ground shows: anything, until the epochs show it.
constexpr double kUnknownHeadingSigma_rad = 1.0;
// Of the epochs that show that course: half a minute.
constexpr std::size_t kEpochsOfCourse = 30;

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
  Odometer odometer(robot, {.parameters = {parameters.begin(), parameters.end()}, .rates_change = true});
  set_state(odometer, start.pose, start.covariance, start.sensitivity);
  return odometer;
}

/// Whether no sensor on board saw any motion in the interval that follows a place in the log.
bool stands_still(const Run& run, std::size_t increment) {
  const auto& increments = run.readings.increments;
  return increment < increments.size() && !any_turns(increments[increment]);
}

/// Where the reference is at a epoch: its mean over the time that the robot stands there.
struct Standing {
  ReferenceSample mean;
  double samples = 0.0;
};

Standing standing_at(const Run& run, std::size_t epoch, const Robot& robot) {
  Standing standing;
  standing.mean = sample_reference(run.reference, run.epoch_time(epoch) - robot.reference_time_offset_s);
  standing.samples = 1.0;
  Vector3 sum = Vector3::Zero();
  for (std::size_t i = run.epochs[epoch]; stands_still(run, i); ++i) {
    const double time_s = run.readings.increments.time_s(i) - robot.reference_time_offset_s;
    if (!is_seen(run.reference, time_s, run.readings.increments.duration_s(i))) continue;
    const ReferenceSample sample = sample_reference(run.reference, time_s);
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

/// One row more.
template <class ByPose, class ByParameters>
void append(ReferenceMeasurement& m, double innovation, const ByPose& by_pose,
            const ByParameters& by_parameters, double sigma) {
  const auto n = m.innovation.size();
  m.innovation.conservativeResize(n + 1);
  m.variance.conservativeResize(n + 1);
  m.H.conservativeResize(n + 1, 3);
  m.J.conservativeResize(n + 1, by_parameters.cols());
  m.innovation[n] = innovation;
  m.variance[n] = sigma * sigma;
  m.H.row(n) = by_pose;
  m.J.row(n) = by_parameters;
}

}  // namespace

double course_over_ground(const Run& run, std::size_t first_epoch, const Robot& robot) {
  Odometer odometer(robot, {});
  const Pose2& mount = robot.body_from_reference;
  const double offset = robot.reference_time_offset_s;
  const Vector2 origin =
      sample_reference(run.reference, run.epoch_time(first_epoch) - offset).value.head<2>();
  std::size_t done = run.epochs[first_epoch];
  // Σ odometry × reference and Σ odometry · reference give the rotation that aligns the two courses best.
  double sine = 0.0;
  double cosine = 0.0;
  for (std::size_t epoch = first_epoch + 1;
       epoch < std::min(run.epochs.size(), first_epoch + kEpochsOfCourse); ++epoch) {
    for (; done < run.epochs[epoch]; ++done) step_along(run, done, odometer);
    const ReferenceSample sample = sample_reference(run.reference, run.epoch_time(epoch) - offset);
    if (!sample.has_position()) continue;
    const Vector2 seen = sample.value.head<2>() - origin;
    const Vector2 driven = (odometer.pose() * mount).translation() - mount.translation();
    sine += driven.x() * seen.y() - driven.y() * seen.x();
    cosine += driven.dot(seen);
  }
  return std::atan2(sine, cosine);
}

Odometer odometer_at_epoch(const Run& run, std::size_t epoch, const Robot& robot,
                           std::span<const Parameter> parameters, const ReferenceNoise& noise,
                           bool knows_heading) {
  const auto [sample, samples] = standing_at(run, epoch, robot);
  Vector3 sigma = noise.sigma() / std::sqrt(samples);
  Pose2 sensor;
  if (sample.has_position()) sensor = {sample.value.x(), sample.value.y(), 0.0};
  if (sample.has_heading()) {
    sensor.heading = sample.value.z();
  } else {
    const bool is_sought = epoch == 0 && run.start_heading_rad;
    sensor.heading = (is_sought ? *run.start_heading_rad : course_over_ground(run, epoch, robot)) +
                     robot.body_from_reference.heading;
    sigma.z() = knows_heading ? 0.0 : kUnknownHeadingSigma_rad;
  }
  const Matrix3 covariance = sigma.cwiseAbs2().asDiagonal();
  return odometer_at(start_from(sensor, covariance, sample.rate, robot, parameters), robot, parameters);
}

Odometer odometer_at_origin(const Robot& robot, std::span<const Parameter> parameters) {
  return odometer_at(start_from(Pose2{}, Matrix3::Zero(), Vector3::Zero(), robot, parameters), robot,
                     parameters);
}

ReferenceMeasurement measure(const ReferenceSample& sample, const Odometer& odometer, const Robot& robot,
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
  const Vector3 sigma = noise.sigma_at_epochs();
  ReferenceMeasurement measurement;
  for (int i = 0; i < 3; ++i) {
    if (!std::isfinite(innovation[i])) continue;
    append(measurement, innovation[i], H.row(i), J.row(i), sigma[i]);
    measurement.component[static_cast<std::size_t>(measurement.innovation.size() - 1)] = i;
  }
  return measurement;
}

ReferenceMeasurement::Weight ReferenceMeasurement::weight(const Matrix3& P) const {
  Weight S = H * P * H.transpose();
  S.diagonal() += variance;
  return S.inverse();
}

/// What the run as a whole was measured to be, as residuals of its end pose relative to its start.
ReferenceMeasurement measure_end(const PartialReference& partial, const Odometer& odometer,
                                 const Robot& robot, std::span<const Parameter> parameters) {
  const ReferenceSample unused{.value = Vector3::Zero(), .rate = Vector3::Zero()};
  // Borrow pose, H and J of the reference sensor; the residuals below are functions of that pose.
  const ReferenceMeasurement sensor = measure(unused, odometer, robot, parameters, {});
  const Pose2 end = odometer.pose() * robot.body_from_reference;
  ReferenceMeasurement m;
  const auto add = [&](double innovation, const Vector3& gradient, double sigma) {
    append(m, innovation, gradient.transpose() * sensor.H, gradient.transpose() * sensor.J, sigma);
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

}  // namespace trundle::calibration
