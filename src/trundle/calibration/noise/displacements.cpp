#include "trundle/calibration/noise/displacements.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "trundle/calibration/noise/parity.hpp"
#include "trundle/chassis/rows.hpp"
#include "trundle/geometry/decompositions.hpp"
#include "trundle/geometry/squared.hpp"
#include "trundle/odometry/odometer.hpp"
#include "trundle/statistics/distribution.hpp"
#include "trundle/statistics/minimum.hpp"

namespace trundle::calibration {
namespace {

// Share of the variances that levels make: the least is the square of the least level that is looked for over
// that of the largest. Its logarithm is sought so finely that a deviance of a thousand residuals is off by
// less than 0.001: n δ² / 2.
constexpr double kLeastShare = 1e-12;
constexpr double kFinestLogShare = 1e-3;

/// Sums readings, and the ways that their noise grows with.
void add_readings(const Robot& robot, const Redundancy& redundancy, Displacement& displacement) {
  Increment sum;
  bool complete = true;
  for (std::size_t i = displacement.first; i < displacement.last; ++i) {
    const Increment& increment = displacement.run->readings.increments[i];
    complete =
        complete && (increment.has_gyro || !robot.chassis.gyro) && !displacement.run->readings.bridged[i];
    add_readings(sum, increment);
    for (std::size_t w = 0; w < sum.turned.size(); ++w)
      displacement.rolled.turned[w] += std::abs(increment.turned[w]);
  }
  displacement.rolled.duration_s = sum.duration_s;
  displacement.rolling.speed_m_s =
      mean_travel(robot.chassis, displacement.rolled) / displacement.rolled.duration_s;
  displacement.rolling.octave = RollingGauge(robot.chassis).octave_of(displacement.rolling.speed_m_s);
  if (!complete || redundancy.P.cols() == 0) return;
  const RowVector z = readings_of(robot.chassis, redundancy.rows, sum).z;
  displacement.parity = redundancy.P.transpose() * z.head(redundancy.rows.measured);
}

void add_displacements(const Run& run, const Robot& robot, double stretch_s,
                       std::vector<Displacement>& displacements) {
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
    const bool full = increments.time_s(n - 1) - start_s >= stretch_s - 1e-9 || n == increments.size();
    if (start && !full) continue;
    if (start && end && increments.time_s(last - 1) - start_s >= 0.5 * stretch_s) {
      const Pose2 moved = start->inverse() * *end;
      Displacement& displacement = displacements.emplace_back();
      displacement.run = &run;
      displacement.first = first;
      displacement.last = last;
      displacement.motion = {moved.x, moved.y, wrap_angle(moved.heading)};
      add_readings(robot, redundancy, displacement);
    }
    start = here;
    end.reset();
    first = n;
    start_s = increments.time_s(n - 1);
  }
}

/// What odometry misses of a displacement, and its covariance.
struct DisplacementError {
  Vector3 error;
  Matrix3 covariance;
};

Odometer at_start_of(const Displacement& displacement, Odometer odometer) {
  OdometerState state = odometer.state();
  state.rolling = displacement.rolling;
  odometer.resume(state);
  return odometer;
}

/// Odometry's covariance plus that of the reference's poses at both ends; an error of the heading at the
/// start swings the whole motion.
DisplacementError error_at_end(const Displacement& displacement, const Odometer& odometer,
                               const ReferenceNoise& reference) {
  const Pose2& pose = odometer.pose();
  DisplacementError result;
  result.error = displacement.motion - Vector3(pose.x, pose.y, pose.heading);
  result.error.z() = wrap_angle(result.error.z());
  const Vector3 swing(displacement.motion.y(), -displacement.motion.x(), -1.0);
  const double heading = squared(reference.heading_rad);
  const double position = 2.0 * squared(reference.position_m);
  result.covariance = odometer.white_covariance() + heading * swing * swing.transpose();
  result.covariance.diagonal() += Vector3(position, position, heading);
  return result;
}

DisplacementError error_of(const Displacement& displacement, Odometer odometer,
                           const ReferenceNoise& reference) {
  odometer = at_start_of(displacement, std::move(odometer));
  for (std::size_t i = displacement.first; i < displacement.last; ++i)
    odometer.step(displacement.run->readings.increments[i]);
  return error_at_end(displacement, odometer, reference);
}

/// The levels that show in what no motion explains, where that has such a share of their variances.
NoiseLevels with_share(NoiseLevels levels, double share) {
  levels.wheel_per_sqrt_m *= std::sqrt(share);
  levels.gyro_rad_s_sqrt_hz *= std::sqrt(share);
  return levels;
}

/// Of the readings' sums: their noise grows with the way, but of the rounding only that of both ends is left.
RowVector parity_variance(const Robot& robot, const Redundancy& redundancy,
                          const Displacement& displacement) {
  return readings_of(robot.chassis, redundancy.rows, displacement.rolled).variance;
}

/// What odometry misses of displacements given their parity residuals, in which such a share of the noise
/// shows. Eq. 10a.
class GivenParity {
 public:
  GivenParity(const GivenParity&) = delete;
  GivenParity(const Robot& robot, const NoiseLevels& levels, double share)
      : robot_(with_noise(robot, levels)),
        showing_(with_noise(robot, with_share(levels, share))),
        reference_(levels.reference),
        odometer_(robot_, {}),
        redundancy_(redundancy_of(robot)) {
    if (redundancy_.P.cols() > 0 && !is_steered(robot_.chassis))
      common_.emplace(robot_.chassis, showing_.chassis, redundancy_.rows, redundancy_.P);
  }

  DisplacementError of(const Displacement& displacement) const {
    if (displacement.parity.size() == 0 || !common_) return error_of(displacement, odometer_, reference_);
    Odometer odometer = at_start_of(displacement, odometer_);
    // What odometry errs by is missed of the displacement: with the other sign.
    const CommonError common = -common_error_along(*common_, displacement, odometer);
    DisplacementError result = error_at_end(displacement, odometer, reference_);
    const Combinations S =
        combined_covariance(redundancy_.P, parity_variance(showing_, redundancy_, displacement));
    const CommonError gain = S.ldlt().solve(common.transpose()).transpose();
    result.error -= gain * displacement.parity;
    result.covariance -= gain * common.transpose();
    return result;
  }

 private:
  Robot robot_;
  Robot showing_;  ///< with the noise that parity residuals show
  ReferenceNoise reference_;
  Odometer odometer_;
  Redundancy redundancy_;
  std::optional<CommonErrors> common_;
};

/// Of the error of a displacement with that of the next, which starts from the pose where it ends: what the
/// reference errs by there makes one longer and the other shorter.
Matrix3 covariance_with_next(const Displacement& displacement, const Displacement& next,
                             const ReferenceNoise& reference) {
  Matrix3 common = Matrix3::Zero();
  common.topLeftCorner<2, 2>() = -squared(reference.position_m) * rotation(displacement.motion.z());
  common.row(2) =
      squared(reference.heading_rad) * Vector3(next.motion.y(), -next.motion.x(), -1.0).transpose();
  return common;
}

/// -2 log likelihood of the parity residuals of a robot of that noise.
double deviance_of_parity(std::span<const Displacement> displacements, const Robot& robot,
                          const Redundancy& redundancy) {
  double sum = 0.0;
  for (const Displacement& displacement : displacements) {
    if (displacement.parity.size() == 0) continue;
    const RowVector variance = parity_variance(robot, redundancy, displacement);
    const auto misfit = gaussian_misfit(displacement.parity, combined_covariance(redundancy.P, variance));
    if (!misfit) return std::numeric_limits<double>::infinity();
    sum += misfit->squared_mahalanobis + misfit->log_determinant;
  }
  return sum;
}

}  // namespace

std::vector<Displacement> displacements(std::span<const Run> runs, const Robot& robot, double stretch_s) {
  std::vector<Displacement> all;
  for (const Run& run : runs) add_displacements(run, robot, stretch_s, all);
  return all;
}

// Displacement by displacement, each given those before it: of a chain only neighbours share a pose.
double displacement_deviance(std::span<const Displacement> displacements, const Robot& robot,
                             const NoiseLevels& levels, double share) {
  const GivenParity errors(robot, levels, share);
  const Displacement* before = nullptr;
  DisplacementError last;
  double sum = 0.0;
  for (const Displacement& displacement : displacements) {
    DisplacementError e = errors.of(displacement);
    if (before && before->run == displacement.run && before->last == displacement.first) {
      const Matrix3 common = covariance_with_next(*before, displacement, levels.reference);
      const Matrix3 gain = common.transpose() * last.covariance.inverse();
      e.error -= gain * last.error;
      e.covariance -= gain * common;
    }
    const auto misfit = gaussian_misfit(e.error, e.covariance);
    if (!misfit) return std::numeric_limits<double>::infinity();
    sum += misfit->squared_mahalanobis + misfit->log_determinant;
    before = &displacement;
    last = e;
  }
  return sum;
}

ParityDeviance parity_deviance(std::span<const Displacement> displacements, const Robot& robot,
                               const NoiseLevels& levels, WheelErrors errors) {
  const Redundancy redundancy = redundancy_of(robot);
  const auto at = [&](double log_share) {
    return deviance_of_parity(displacements, with_noise(robot, with_share(levels, std::exp(log_share))),
                              redundancy);
  };
  const ParityDeviance whole{at(0.0), 1.0};
  if (errors == WheelErrors::independent) return whole;
  const double log_share = statistics::minimum_within({std::log(kLeastShare), 0.0, kFinestLogShare}, at);
  const ParityDeviance part{at(log_share), std::exp(log_share)};
  return part.deviance < whole.deviance ? part : whole;
}

double share_inside(std::span<const Displacement> displacements, const Robot& robot,
                    const NoiseLevels& levels) {
  const Odometer odometer(with_noise(robot, levels), {});
  std::size_t inside = 0;
  for (const Displacement& displacement : displacements) {
    const DisplacementError of = error_of(displacement, odometer, levels.reference);
    const Vector2 e = of.error.head<2>();
    inside += e.dot(of.covariance.topLeftCorner<2, 2>().inverse() * e) <= kChiSquared2At95 ? 1 : 0;
  }
  return static_cast<double>(inside) / static_cast<double>(displacements.size());
}

}  // namespace trundle::calibration
