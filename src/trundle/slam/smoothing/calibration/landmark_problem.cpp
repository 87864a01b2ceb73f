#include "trundle/slam/smoothing/calibration/landmark_problem.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include "trundle/calibration/likelihood/chassis_likelihood.hpp"
#include "trundle/calibration/problem/noise_levels.hpp"
#include "trundle/odometry/integrate.hpp"
#include "trundle/slam/smoothing/calibration/reference_positions.hpp"
#include "trundle/slam/smoothing/smoother.hpp"

namespace trundle::slam {
namespace {

using calibration::ReadingErrors;

// A window of readings whose parity residual chance makes once in 10⁶ is slip.
constexpr double kParityGate = 30.0;
// To either side of a sighting, over which the twist there is taken: the rounding of counts at 60 a
// revolution, 0.5 m/s from one row to the next of 100 Hz, is 1 cm/s of it.
constexpr double kHalfTwistWindow_s = 0.25;

/// Those that the motion depends on, and where they are among all.
struct MotionParameters {
  std::vector<Parameter> parameters;
  std::vector<Eigen::Index> rows;
};
MotionParameters of_motion(std::span<const Parameter> all) {
  MotionParameters moving;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (is_of_landmark_sensor(all[i].kind)) continue;
    moving.parameters.push_back(all[i]);
    moving.rows.push_back(static_cast<Eigen::Index>(i));
  }
  return moving;
}

/// Of by_parameters · columns.
ReadingErrors combined(const ReadingErrors& errors, const Eigen::MatrixXd& columns) {
  ReadingErrors result{Eigen::Matrix3Xd::Zero(3, 3 * columns.cols()), errors.covariance, {}};
  for (Eigen::Index q = 0; q < columns.cols(); ++q)
    for (Eigen::Index j = 0; j < columns.rows(); ++j)
      result.sensitivity.middleCols<3>(3 * q) += columns(j, q) * errors.sensitivity.middleCols<3>(3 * j);
  if (errors.scatter.size() == 0) return result;
  Eigen::MatrixXd mix = Eigen::MatrixXd::Zero(3 * columns.rows(), 3 * columns.cols());
  for (Eigen::Index q = 0; q < columns.cols(); ++q)
    for (Eigen::Index j = 0; j < columns.rows(); ++j)
      mix.block<3, 3>(3 * j, 3 * q).diagonal().setConstant(columns(j, q));
  result.scatter = mix.transpose() * errors.scatter * mix;
  return result;
}

/// By each parameter, the errors of readings that it makes. Eq. 13a.
SensorErrorsBy sensor_errors_of(const LandmarkSensor& sensor, std::span<const Parameter> parameters) {
  constexpr std::array kErrors = {ParameterKind::sensor_range_offset,
                                  ParameterKind::sensor_range_scale,
                                  ParameterKind::sensor_bearing_offset,
                                  ParameterKind::sensor_x,
                                  ParameterKind::sensor_y,
                                  ParameterKind::sensor_depth_share};
  const auto n = static_cast<Eigen::Index>(parameters.size());
  SensorErrorsBy errors = SensorErrorsBy::Zero(6, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    const auto at = std::ranges::find(kErrors, parameters[static_cast<std::size_t>(j)].kind);
    if (at == kErrors.end()) continue;
    const Eigen::Index row = at - kErrors.begin();
    errors(row, j) = row < 2 ? 1.0 / sensor.range_scale : 1.0;  // of a range whose scale is taken out
  }
  return errors;
}

/// What each observation of the steps shows.
ShownObservations shown_in(const SlamInput& input, std::span<const LandmarkId> by_sighting) {
  ShownObservations shown;
  std::size_t next = 0;
  for (const SlamStep& step : input.steps) {
    shown.push_back(step.observations);
    for (Observation& observation : shown.back())
      observation.landmark = by_sighting[input.sighting_numbers[next++]];
  }
  return shown;
}

/// By all that is sought, what moves of the parameters that all recordings share.
Eigen::MatrixXd common_columns(const FreeColumns& free) {
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(free.columns.rows(), free.count());
  columns.leftCols(free.columns.cols()) = free.columns;
  return columns;
}

/// The same of a recording's parameters at a time: its gyro's bias is its own, and walks.
Eigen::MatrixXd columns_at(double time_s, const FreeColumns& free, std::size_t recording) {
  Eigen::MatrixXd columns = common_columns(free);
  if (const auto place = free.own.place_of(recording))
    columns(free.row_of_gyro_bias(), free.columns.cols() + *place) = free.own.unit_rad_s;
  if (const BiasWalk walk = free.walk_of(recording); walk.harmonics > 0)
    columns.row(free.row_of_gyro_bias()).segment(free.first_harmonic(recording), walk.harmonics) =
        walk.at(time_s);
  return columns;
}

/// With its own bias.
Robot robot_in(const Robot& robot, const FreeColumns& free, std::size_t recording) {
  Robot own = robot;
  if (own.chassis.gyro) own.chassis.gyro->bias_rad_s += free.own.of(recording);
  return own;
}

/// The twist [m/s, m/s, rad/s] about a time. By one row it would be that of the rounding of counts, which
/// would pass for information; and noise before and after that time, half of it in the motion that ends
/// there and half in the one that begins, moves a clock to neither side. Eq. 13b.
Vector3 twist_about(const Trajectory& odometry, double time_s) {
  constexpr double kAnyGap_s = std::numeric_limits<double>::infinity();
  const double reach_s = std::min(
      {kHalfTwistWindow_s, time_s - odometry.poses.front().time_s, odometry.poses.back().time_s - time_s});
  if (!(reach_s > 0.0)) return Vector3::Zero();
  const auto before = pose_at(odometry, time_s - reach_s, kAnyGap_s);
  const auto after = pose_at(odometry, time_s + reach_s, kAnyGap_s);
  if (!before || !after) return Vector3::Zero();
  return log(before->inverse() * *after).vector() / (2.0 * reach_s);
}

/// By the sensor's clock, the motion of each step: with it move those ends at which something was seen.
std::vector<Vector3> by_sensor_clock(const AssociatedRecording& one, const SlamInput& input,
                                     const Robot& robot) {
  const Trajectory odometry =
      odometry::integrate(one.run.readings, robot, {.with_covariance = false}).trajectory;
  std::vector<Vector3> by_clock;
  Vector3 at_start = Vector3::Zero();
  for (const SlamStep& step : input.steps) {
    const Vector3 at_end = step.observations.empty() ? Vector3::Zero() : twist_about(odometry, step.time_s);
    by_clock.push_back(at_end - adjoint(step.motion.mean.inverse()) * at_start);
    at_start = at_end;
  }
  return by_clock;
}

TrackInput track_input(const AssociatedRecording& one, std::size_t recording, const Robot& robot,
                       const FreeColumns& free, bool with_scatter) {
  const MotionParameters moving = of_motion(free.parameters);
  const SlamInput input =
      slam_input(one.recording, robot, {.parameters = moving.parameters, .with_scatter = with_scatter});
  const auto clock = std::ranges::find(free.parameters, ParameterKind::sensor_time_offset, &Parameter::kind);
  const auto n = static_cast<Eigen::Index>(free.parameters.size());
  std::vector<Vector3> by_clock;
  if (clock != free.parameters.end()) by_clock = by_sensor_clock(one, input, robot);
  TrackInput track{.observations = shown_in(input, one.shown)};
  if (one.in_reference) {
    if (!one.path.poses.empty()) track.start.pose = one.path.poses.front().pose;
    track.start_covariance = free_start_covariance();
  }
  double before_s = input.start_s;
  for (std::size_t k = 0; k < input.steps.size(); ++k) {
    const Motion& motion = input.steps[k].motion;
    const double time_s = input.steps[k].time_s;
    const Eigen::MatrixXd columns = columns_at(0.5 * (before_s + time_s), free, recording);
    before_s = time_s;
    Eigen::Matrix3Xd by_parameters = Eigen::Matrix3Xd::Zero(3, n);
    if (!moving.rows.empty()) by_parameters(Eigen::all, moving.rows) = input.by_parameters[k];
    if (clock != free.parameters.end()) by_parameters.col(clock - free.parameters.begin()) = by_clock[k];
    track.time_s.push_back(time_s);
    FreeMotion free_motion{motion.mean, motion.covariance, by_parameters * columns};
    if (!input.reading_errors.empty())
      free_motion.reading_errors =
          combined(input.reading_errors[k], columns(moving.rows, Eigen::seqN(0, free.first_harmonic(0))));
    track.motions.push_back(std::move(free_motion));
  }
  return track;
}

/// What wheels and gyro say of each other: with a gyro the motion hardly depends on the track, and what no
/// motion explains shows it.
void add_redundancy(const AssociatedRecording& one, std::size_t recording, const Robot& robot,
                    const FreeColumns& free, Information& sum) {
  // No harmonic goes on by more than an eighth of its period in one.
  const auto blocks = std::max<Eigen::Index>(1, 4 * free.walk_of(recording).harmonics);
  std::vector<Information> shown =
      chassis_likelihood(one.run, robot, free.parameters,
                         {.blocks = static_cast<int>(blocks), .gate = kParityGate, .with_noise = true});
  keep_what_is_known(shown);
  const recording::Increments& increments = one.run.readings.increments;
  for (std::size_t i = 0; i < shown.size(); ++i) {
    const std::size_t middle = (2 * i + 1) * increments.size() / (2 * shown.size());
    const double time_s = increments.empty() ? 0.0 : increments[middle].time_s;
    const Eigen::MatrixXd columns = columns_at(time_s, free, recording);
    sum.add({columns.transpose() * shown[i].matrix * columns, columns.transpose() * shown[i].gradient,
             shown[i].chi2, shown[i].count});
  }
}

Information redundancy_of(std::span<const AssociatedRecording> all, const Robot& robot,
                          const FreeColumns& free) {
  Information sum = Information::zero(free.count());
  const Robot noisy = with_noise_of_readings(robot, free.nominal);
  for (std::size_t i = 0; i < all.size(); ++i) add_redundancy(all[i], i, robot_in(noisy, free, i), free, sum);
  return sum;
}

Eigen::VectorXd information_of(const FreeColumns& free) {
  Eigen::VectorXd information = Eigen::VectorXd::Constant(free.count(), free.walk_information);
  information.head(free.columns.cols()) = free.information;
  information.segment(free.columns.cols(), free.own.count()).setConstant(free.own.information);
  return information;
}

/// Of the priors: what is sought is about 0, so are biases, and they are sought from where they are.
Eigen::VectorXd mean_of(const FreeColumns& free) {
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(free.count());
  mean.segment(free.columns.cols(), free.own.count()) = -free.own.values();
  return mean;
}

}  // namespace

Eigen::Index FreeColumns::first_harmonic(std::size_t recording) const {
  Eigen::Index before = columns.cols() + own.count();
  for (std::size_t i = 0; i < std::min(recording, walks.size()); ++i) before += walks[i].harmonics;
  return before;
}

Eigen::VectorXd FreeColumns::parameters_from_here(const Eigen::VectorXd& found) const {
  const Eigen::Index harmonics = count() - first_harmonic(0);
  Eigen::VectorXd here = Eigen::VectorXd::Zero(count());
  here.tail(harmonics) = found.tail(harmonics);
  return here;
}

Eigen::Index FreeColumns::row_of_gyro_bias() const {
  return std::ranges::find(parameters, kGyroBias) - parameters.begin();
}

JointProblem joint_problem(std::span<const AssociatedRecording> all, const Robot& robot,
                           const FreeColumns& free, bool with_scatter) {
  JointProblem joint{{.sensors = {*robot.landmark_sensor},
                      .motions = {},
                      .sightings = {},
                      .parameter_information = information_of(free),
                      .parameter_mean = mean_of(free),
                      .parameter_evidence = redundancy_of(all, robot, free),
                      .gate = kDefaultGate},
                     {}};
  if (std::ranges::any_of(free.parameters,
                          [](const Parameter& p) { return is_of_landmark_sensor(p.kind); })) {
    joint.problem.sensor_errors = {sensor_errors_of(*robot.landmark_sensor, free.parameters) *
                                   common_columns(free)};
  }
  for (std::size_t i = 0; i < all.size(); ++i) {
    LandmarkNumbers own;  // each recording has its own map
    joint.tracks.emplace_back(track_input(all[i], i, robot_in(robot, free, i), free, with_scatter),
                              joint.problem, own);
    if (!all[i].in_reference) continue;
    ++joint.problem.free_starts;
    add_positions(all[i].run, joint.tracks.back(), robot, free.position_sigma_m, joint.problem);
  }
  return joint;
}

Trajectory poses_at_keyframes(const JointProblem& joint, std::span<const AssociatedRecording> all) {
  Trajectory keyframes;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Trajectory own = joint.tracks[i].at_keyframes(all[i].path);
    keyframes.poses.insert(keyframes.poses.end(), own.poses.begin(), own.poses.end());
  }
  return keyframes;
}

}  // namespace trundle::slam
