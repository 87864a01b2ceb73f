#include "trundle/calibration/noise_pieces.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "trundle/odometry/odometer.hpp"
#include "trundle/statistics/distribution.hpp"

namespace trundle {
namespace {

/// What no motion explains in a chassis with or without its gyro, from the geometry alone.
struct Redundancy {
  Rows rows;
  Combinations P;
};

Redundancy redundancy_of(const Robot& robot) {
  Redundancy redundancy{rows_of(robot.chassis, robot.chassis.gyro.has_value()), {}};
  redundancy.P = left_null_space(redundancy.rows);
  return redundancy;
}

/// Sums readings, and the ways that their noise grows with.
void add_readings(const Robot& robot, const Redundancy& redundancy, NoisePiece& piece) {
  Increment sum;
  bool complete = true;
  for (std::size_t i = piece.first; i < piece.last; ++i) {
    const Increment& increment = piece.run->readings.increments[i];
    complete = complete && (increment.has_gyro || !robot.chassis.gyro) && !piece.run->readings.bridged[i];
    sum.duration_s += increment.duration_s;
    sum.gyro_rad += increment.gyro_rad;
    for (std::size_t w = 0; w < sum.turned.size(); ++w) {
      sum.turned[w] += increment.turned[w];
      piece.rolled.turned[w] += std::abs(increment.turned[w]);
    }
  }
  piece.rolled.duration_s = sum.duration_s;
  piece.rolling.speed_m_s = mean_travel(robot.chassis, piece.rolled) / piece.rolled.duration_s;
  piece.rolling.octave = RollingGauge(robot.chassis).octave_of(piece.rolling.speed_m_s);
  if (!complete || redundancy.P.cols() == 0) return;
  const RowVector z = readings_of(robot.chassis, redundancy.rows, sum).z;
  piece.contradiction = redundancy.P.transpose() * z.head(redundancy.rows.measured);
}

void add_pieces(const Run& run, const Robot& robot, double piece_s, std::vector<NoisePiece>& pieces) {
  const auto& increments = run.readings.increments;
  const Redundancy redundancy = redundancy_of(robot);
  std::optional<Pose2> start = body_by_reference(run, 0, robot);
  std::optional<Pose2> end;
  std::size_t first = 0, last = 0;
  double start_s = run.readings.start_s;
  for (std::size_t n = 1; n <= increments.size(); ++n) {
    const auto here = body_by_reference(run, n, robot);
    if (here && start) {
      end = here;
      last = n;
    }
    const bool full = increments[n - 1].time_s - start_s >= piece_s - 1e-9 || n == increments.size();
    if (start && !full) continue;
    if (start && end && increments[last - 1].time_s - start_s >= 0.5 * piece_s) {
      const Pose2 moved = start->inverse() * *end;
      NoisePiece& piece = pieces.emplace_back();
      piece.run = &run;
      piece.first = first;
      piece.last = last;
      piece.motion = {moved.x, moved.y, wrap_angle(moved.heading)};
      add_readings(robot, redundancy, piece);
    }
    start = here;
    end.reset();
    first = n;
    start_s = increments[n - 1].time_s;
  }
}

/// What odometry misses of a piece, and how likely that is.
struct Miss {
  Vector3 error;
  Matrix3 covariance;
};

/// Odometry's covariance plus that of the reference's poses at both ends; an error of the heading at the
/// start swings the whole motion.
Miss miss_of(const NoisePiece& piece, Odometer odometer, const NoiseLevels& levels) {
  OdometerState state = odometer.state();
  state.rolling = piece.rolling;
  odometer.resume(state);
  for (std::size_t i = piece.first; i < piece.last; ++i) odometer.step(piece.run->readings.increments[i]);
  const Pose2& pose = odometer.pose();
  Miss miss;
  miss.error = piece.motion - Vector3(pose.x, pose.y, pose.heading);
  miss.error.z() = wrap_angle(miss.error.z());
  const Vector3 swing(piece.motion.y(), -piece.motion.x(), -1.0);
  const double heading = levels.heading * levels.heading;
  const double position = 2.0 * levels.position * levels.position;
  miss.covariance = odometer.white_covariance() + heading * swing * swing.transpose();
  miss.covariance.diagonal() += Vector3(position, position, heading);
  return miss;
}

}  // namespace

std::vector<NoisePiece> noise_pieces(std::span<const Run> runs, const Robot& robot, double piece_s) {
  std::vector<NoisePiece> pieces;
  for (const Run& run : runs) add_pieces(run, robot, piece_s, pieces);
  return pieces;
}

bool has_sideways(const Robot& robot) {
  const Rows rows = rows_of(robot.chassis, false);
  return rows.count() > rows.measured;
}

Robot with_levels(const Robot& robot, const NoiseLevels& levels) {
  Robot result = robot;
  ChassisNoise& noise = result.chassis.noise;
  noise.wheel_per_sqrt_m = levels.wheel;
  const auto wheels = result.chassis.wheels();
  for (std::size_t i = 0; i < wheels.size(); ++i)
    wheels[i].noise_per_sqrt_m = levels.alike() ? Wheel{}.noise_per_sqrt_m : levels.share[i] * levels.wheel;
  (has_skid_wheels(robot.chassis) ? noise.skid_per_sqrt_m : noise.lateral_per_sqrt_m) = levels.sideways;
  if (result.chassis.gyro) result.chassis.gyro->noise_rad_s_sqrt_hz = levels.gyro;
  return result;
}

double surprise_of_misses(std::span<const NoisePiece> pieces, const Robot& robot, const NoiseLevels& levels) {
  const Odometer odometer(with_levels(robot, levels), {});
  double sum = 0.0;
  for (const NoisePiece& piece : pieces) {
    const Miss miss = miss_of(piece, odometer, levels);
    sum += miss.error.dot(miss.covariance.inverse() * miss.error) + std::log(miss.covariance.determinant());
  }
  return sum;
}

double surprise_of_contradictions(std::span<const NoisePiece> pieces, const Robot& robot,
                                  const NoiseLevels& levels) {
  const Redundancy redundancy = redundancy_of(robot);
  const Chassis chassis = with_levels(robot, levels).chassis;
  double squares = 0.0, log_determinants = 0.0, count = 0.0;
  for (const NoisePiece& piece : pieces) {
    if (piece.contradiction.size() == 0) continue;
    // Of the sum: its noise grows with the way, but of the rounding only that of both ends is left.
    const RowVector variance = readings_of(chassis, redundancy.rows, piece.rolled).variance;
    const Eigen::LLT<Eigen::MatrixXd> cholesky(
        redundancy.P.transpose() * variance.head(redundancy.rows.measured).asDiagonal() * redundancy.P);
    squares += cholesky.matrixL().solve(piece.contradiction).squaredNorm();
    log_determinants += 2.0 * cholesky.matrixLLT().diagonal().array().log().sum();
    count += static_cast<double>(piece.contradiction.size());
  }
  if (count == 0.0) return 0.0;
  // All wheels may err alike, which shows nowhere here; but they err at least so much.
  const double share = std::clamp(squares / count, 1e-300, 1.0);
  return log_determinants + count * std::log(share) + squares / share;
}

double share_inside(std::span<const NoisePiece> pieces, const Robot& robot, const NoiseLevels& levels) {
  const Odometer odometer(with_levels(robot, levels), {});
  std::size_t inside = 0;
  for (const NoisePiece& piece : pieces) {
    const Miss miss = miss_of(piece, odometer, levels);
    const Vector2 e = miss.error.head<2>();
    inside += e.dot(miss.covariance.topLeftCorner<2, 2>().inverse() * e) <= kChiSquared2At95 ? 1 : 0;
  }
  return static_cast<double>(inside) / static_cast<double>(pieces.size());
}

}  // namespace trundle
