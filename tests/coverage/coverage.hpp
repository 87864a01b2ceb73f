#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Cholesky>

#include "trundle/chassis/robot.hpp"
#include "trundle/geometry/gaussian.hpp"
#include "trundle/odometry/odometer.hpp"

#include "coverage/drive_oracle.hpp"

/// Whether the end pose of online odometry is unbiased and its covariance honest, cell by cell of a matrix of
/// chassis, sampling rates, wheel noises, counts and motions.
namespace trundle::coverage {
using namespace odometry;

/// One cell of the matrix.
struct Cell {
  std::string_view chassis = "differential";
  double rate_hz = 50.0;
  double k = 0.005;        ///< wheel_per_sqrt_m [m/√m]
  double counts = 1000.0;  ///< of a revolution
  Motion motion = Motion::straight;
  bool learns_gyro_bias =
      false;  ///< from 5 s of rest before the drive; it is 0.003 rad/s, ± 0.02 by the file
};

inline constexpr std::array<std::string_view, 12> kChassis = {
    "differential", "differential_gyro", "skid4",    "skid4_gyro",    "omni3", "omni3_gyro",
    "mecanum",      "pods_gyro",         "tricycle", "tricycle_gyro", "car",   "swerve"};
inline constexpr std::array<double, 4> kRates = {10.0, 50.0, 200.0, 1000.0};
inline constexpr std::array<double, 3> kNoises = {0.001, 0.005, 0.02};
inline constexpr std::array<double, 3> kCounts = {100.0, 1000.0, 100000.0};
inline constexpr std::array<std::string_view, 4> kMotions = {"straight", "turning", "stop_and_go",
                                                             "reversing"};

inline std::string_view name_of(Motion motion) {
  return kMotions.at(static_cast<std::size_t>(motion));
}
inline bool has_gyro(std::string_view chassis) {
  return chassis.ends_with("_gyro");
}
inline bool moves_sideways(std::string_view chassis) {
  return chassis.starts_with("omni3") || chassis == "mecanum" || chassis.starts_with("pods") ||
         chassis == "swerve";
}

/// Wheels of 0.1 m, 0.3 m apart. The gyro's bias is 0.01 rad/s and, unless it is to be learned, known.
inline Robot robot_of(const Cell& cell) {
  const WheelSize size{.diameter_m = 0.1, .ticks_per_revolution = cell.counts};
  Gyro gyro;
  gyro.bias_rad_s = 0.01;
  gyro.bias_sigma_rad_s = cell.learns_gyro_bias ? 0.02 : 1e-9;
  Robot robot;
  robot.name = cell.chassis;
  if (cell.chassis.starts_with("differential")) robot.chassis = differential_drive(size, 0.3);
  if (cell.chassis.starts_with("skid4")) robot.chassis = skid_steer(size, 0.3, 0.3);
  if (cell.chassis.starts_with("omni3")) robot.chassis = omni3(size, 0.15);
  if (cell.chassis == "mecanum") robot.chassis = mecanum(size, 0.3, 0.3);
  if (cell.chassis.starts_with("pods")) {
    robot.chassis = dead_wheels(size, std::array{Pod{0.0, 0.1, 0.0}, Pod{-0.12, 0.0, kPi / 2.0}}, gyro);
  }
  if (cell.chassis.starts_with("tricycle")) robot.chassis = tricycle(size, 0.3);
  if (cell.chassis == "car") robot.chassis = ackermann(size, 0.3, 0.3);
  if (cell.chassis == "swerve") robot.chassis = swerve(size, 0.3, 0.3);
  if (has_gyro(cell.chassis)) robot.chassis.gyro = gyro;
  robot.chassis.noise.wheel_per_sqrt_m = cell.k;
  const std::vector<std::string> names = {"a", "b", "c", "d"};
  robot.passive_names.assign(static_cast<std::size_t>(robot.chassis.passive_count), "passive");
  robot.wheel_names.assign(names.begin(), names.begin() + robot.chassis.wheel_count);
  return robot;
}

/// 20 s are long enough to show a bias; 8 s at 1000 Hz, to save time. So are 8 s where wheels that err by 2 %
/// alone tell the turn: the heading's σ stays below 0.15 rad, beyond which terms of second order show and no
/// covariance of first order can be honest. Speeds differ from seed to seed by up to 10 %, so that no cell is
/// about one special relation of speed, counts and rate.
inline Drive drive_of(const Cell& cell, Random& random) {
  Drive drive;
  drive.motion = cell.motion;
  drive.rest_s = cell.learns_gyro_bias ? 5.0 : 0.0;
  const bool heading_unsure = !has_gyro(cell.chassis) && cell.k > 0.01;
  drive.duration_s = heading_unsure || cell.rate_hz > 500.0 ? 8.0 : 20.0;
  drive.speed_m_s = 0.27 + 0.06 * random.uniform();
  drive.crab_rad = moves_sideways(cell.chassis) ? radians(15.0) : 0.0;
  return drive;
}

inline std::string words(const Cell& cell) {
  std::ostringstream text;
  text << cell.chassis << ", " << cell.rate_hz << " Hz, k " << cell.k << ", " << cell.counts << " counts, "
       << name_of(cell.motion);
  return text.str();
}

/// What became of one drive.
struct Outcome {
  /// Along and across the straight line from start to end [m], positive too far and to the left, and turn
  /// [rad].
  Vector3 error = Vector3::Zero();
  double nees = 0.0;
  double heading_sigma = 0.0;  ///< stated [rad]
};

/// e = Log(truth⁻¹ estimate): for errors that gather along the way it has mean 0 up to their fourth order,
/// where the x and y of a pose that is unsure of its heading fall short. NEES = eᵀ Σ⁻¹ e, Σ in the estimate's
/// frame.
/// 'Along' is the way as it was planned: the true one bends to where the robot skidded, and skids would count
/// as falling short.
inline Outcome judge(const SimulatedDrive& drive, const Pose2& estimate, const Matrix3& world_covariance) {
  const Vector3 e = log(drive.truth().inverse() * estimate).vector();
  const Vector2 way = rotation(-drive.truth().heading) * drive.planned().translation();
  const Vector2 ahead = way.norm() > 1e-6 ? Vector2(way.normalized()) : Vector2(1.0, 0.0);
  Outcome outcome;
  outcome.error = {ahead.dot(e.head<2>()), ahead.x() * e.y() - ahead.y() * e.x(), e.z()};
  outcome.nees = e.dot(body_covariance(estimate, world_covariance).llt().solve(e));
  outcome.heading_sigma = std::sqrt(world_covariance(2, 2));
  return outcome;
}

/// Drives and integrates once.
inline Outcome run_once(const Cell& cell, std::uint64_t seed) {
  Random random(seed);
  const Robot robot = robot_of(cell);
  SimulatedDrive drive(robot.chassis, drive_of(cell, random), cell.rate_hz, Random::splitmix(seed),
                       cell.learns_gyro_bias ? 0.003 : 0.0);
  Odometer::Options options;
  options.learn_gyro_bias = cell.learns_gyro_bias;
  Odometer odometer(robot, options);
  while (!drive.over()) odometer.step(drive.next());
  return judge(drive, odometer.pose(), odometer.white_covariance());
}

/// Sums over the seeds of a cell, or of several.
class Tally {
 public:
  void add(const Outcome& outcome) {
    ++seeds_;
    sum_ += outcome.error;
    squares_ += outcome.error.cwiseAbs2();
    nees_ += outcome.nees;
    heading_sigma_ = std::max(heading_sigma_, outcome.heading_sigma);
  }

  int seeds() const { return seeds_; }
  /// Mean error in units of the errors' own standard deviation: its standard error is 1/√seeds.
  Vector3 bias() const {
    const Vector3 mean = sum_ / seeds_;
    const Vector3 variance = squares_ / seeds_ - mean.cwiseAbs2();
    return mean.cwiseQuotient(variance.cwiseMax(1e-300).cwiseSqrt());
  }
  Vector3 sigma() const {
    return (squares_ / seeds_ - (sum_ / seeds_).cwiseAbs2()).cwiseMax(0.0).cwiseSqrt();
  }
  double nees() const { return nees_ / seeds_; }
  double largest_heading_sigma() const { return heading_sigma_; }

 private:
  int seeds_ = 0;
  Vector3 sum_ = Vector3::Zero();
  Vector3 squares_ = Vector3::Zero();
  double nees_ = 0.0;
  double heading_sigma_ = 0.0;
};

/// Cells have seeds of their own, so that sums over several of them are of independent drives.
inline std::uint64_t seed_of(const Cell& cell, int number) {
  auto seed = static_cast<std::uint64_t>(std::ranges::find(kChassis, cell.chassis) - kChassis.begin());
  for (const double part : {cell.rate_hz, cell.k, cell.counts, static_cast<double>(cell.motion),
                            cell.learns_gyro_bias ? 1.0 : 0.0, static_cast<double>(number)}) {
    seed ^= std::bit_cast<std::uint64_t>(part);
    seed = Random::splitmix(seed);
  }
  return seed;
}

inline Tally run_cell(const Cell& cell, int seeds) {
  Tally tally;
  for (int i = 0; i < seeds; ++i) tally.add(run_once(cell, seed_of(cell, i)));
  return tally;
}

/// z with P(N(0, 1) > z) = probability, by halving.
inline double normal_quantile_above(double probability) {
  double low = 0.0;
  double high = 40.0;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (0.5 * std::erfc(middle / std::sqrt(2.0)) > probability ? low : high) = middle;
  }
  return low;
}

/// Limits that a whole matrix of honest cells stays within but for one time in a thousand.
struct Limits {
  double bias = 0.0;  ///< [σ] 0.1 and what chance adds
  double nees_low = 0.0;
  double nees_high = 0.0;
};

/// A tenth of σ, and the chance of so many seeds, on both sides of three components; and of the mean of so
/// many χ² of three degrees of freedom, by Wilson and Hilferty. Divided by the number of cells (Bonferroni).
inline Limits limits(int seeds, std::size_t cells) {
  const double share = 0.001 / (2.0 * static_cast<double>(cells));
  const double z = normal_quantile_above(share);
  const double spread = 2.0 / (9.0 * 3.0 * seeds);
  const auto quantile = [&](double sign) {
    return 3.0 * std::pow(1.0 - spread + sign * z * std::sqrt(spread), 3);
  };
  return {0.1 + normal_quantile_above(share / 3.0) / std::sqrt(seeds), quantile(-1.0), quantile(1.0)};
}

inline bool unbiased(const Tally& tally, const Limits& limits) {
  return tally.bias().cwiseAbs().maxCoeff() < limits.bias;
}
inline bool honest(const Tally& tally, const Limits& limits) {
  return limits.nees_low < tally.nees() && tally.nees() < limits.nees_high;
}

}  // namespace trundle::coverage
