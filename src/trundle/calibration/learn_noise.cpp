#include "trundle/calibration/learn_noise.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <Eigen/LU>
#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/odometry/odometer.hpp"

namespace trundle {
namespace {

constexpr std::size_t kFewestPieces = 20;
constexpr int kRounds = 4;
constexpr double kFinestLog = 0.02;
constexpr double kEllipse95 = 5.991465;  // χ² of two degrees of freedom

/// A stretch of a run between two poses of the reference.
struct Piece {
  const Run* run;
  std::size_t first;  ///< increments
  std::size_t last;
  Vector3 motion;  ///< of the body by the reference, in the frame of its start: x, y, heading
};

/// From each place to the last one that is at most a piece later, and on from there.
void add_pieces(const Run& run, const Robot& robot, double piece_s, std::vector<Piece>& pieces) {
  const auto& increments = run.readings.increments;
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
      pieces.push_back({&run, first, last, {moved.x, moved.y, wrap_angle(moved.heading)}});
    }
    start = here;
    end.reset();
    first = n;
    start_s = increments[n - 1].time_s;
  }
}

enum Noise : std::size_t { kWheel, kSideways, kGyro, kPosition, kHeading, kNoises };
using Levels = std::array<double, kNoises>;
struct Bounds {
  double low, high;
};
constexpr std::array<Bounds, kNoises> kBounds = {
    {{1e-5, 3.0}, {1e-5, 3.0}, {1e-6, 1.0}, {1e-4, 1.0}, {1e-4, 0.5}}};

bool skids(const Robot& robot) {
  return std::ranges::any_of(robot.chassis.wheels(),
                             [](const Wheel& w) { return w.kind == WheelKind::skid; });
}

bool has_sideways(const Robot& robot) {
  const Rows rows = rows_of(robot.chassis, false);
  return rows.count() > rows.measured;
}

Robot with_levels(const Robot& robot, const Levels& levels) {
  Robot result = robot;
  ChassisNoise& noise = result.chassis.noise;
  noise.wheel_per_sqrt_m = levels[kWheel];
  (skids(robot) ? noise.skid_per_sqrt_m : noise.lateral_per_sqrt_m) = levels[kSideways];
  if (result.chassis.gyro) result.chassis.gyro->noise_rad_s_sqrt_hz = levels[kGyro];
  return result;
}

/// What odometry misses of a piece, and how likely that is.
struct Miss {
  Vector3 error;
  Matrix3 covariance;
};

/// Odometry's covariance plus that of the reference's poses at both ends; an error of the heading at the
/// start swings the whole motion.
Miss miss_of(const Piece& piece, Odometer odometer, const Levels& levels) {
  for (std::size_t i = piece.first; i < piece.last; ++i) odometer.step(piece.run->readings.increments[i]);
  const Pose2& pose = odometer.pose();
  Miss miss;
  miss.error = piece.motion - Vector3(pose.x, pose.y, pose.heading);
  miss.error.z() = wrap_angle(miss.error.z());
  const Vector3 swing(piece.motion.y(), -piece.motion.x(), -1.0);
  const double heading = levels[kHeading] * levels[kHeading];
  miss.covariance = odometer.white_covariance() + heading * swing * swing.transpose();
  miss.covariance.diagonal() += Vector3(2.0 * levels[kPosition] * levels[kPosition],
                                        2.0 * levels[kPosition] * levels[kPosition], heading);
  return miss;
}

/// −2 log likelihood of all pieces.
double surprise(std::span<const Piece> pieces, const Robot& robot, const Levels& levels) {
  const Odometer odometer(with_levels(robot, levels), {});
  double sum = 0.0;
  for (const Piece& piece : pieces) {
    const Miss miss = miss_of(piece, odometer, levels);
    sum += miss.error.dot(miss.covariance.inverse() * miss.error) + std::log(miss.covariance.determinant());
  }
  return sum;
}

/// Golden section on the logarithm of one level.
void improve(std::span<const Piece> pieces, const Robot& robot, std::size_t which, Levels& levels) {
  constexpr double kGolden = 0.6180339887498949;
  const auto at = [&](double log_level) {
    Levels candidate = levels;
    candidate[which] = std::exp(log_level);
    return surprise(pieces, robot, candidate);
  };
  double low = std::log(kBounds[which].low);
  double high = std::log(kBounds[which].high);
  double left = high - kGolden * (high - low);
  double right = low + kGolden * (high - low);
  double at_left = at(left);
  double at_right = at(right);
  while (high - low > kFinestLog) {
    if (at_left < at_right) {
      high = right;
      right = left;
      at_right = at_left;
      left = high - kGolden * (high - low);
      at_left = at(left);
    } else {
      low = left;
      left = right;
      at_left = at_right;
      right = low + kGolden * (high - low);
      at_right = at(right);
    }
  }
  levels[which] = std::exp(0.5 * (low + high));
}

/// One level after the other. All noise may pass for the reference's, or for the robot's: the better of two
/// starts.
Levels most_likely(std::span<const Piece> pieces, const Robot& robot) {
  constexpr std::array<Levels, 2> kStarts = {
      {{0.05, 0.05, 0.05, 0.002, 0.002}, {0.005, 0.005, 0.0005, 0.02, 0.02}}};
  Levels best{};
  double smallest = INFINITY;
  for (Levels levels : kStarts) {
    for (int round = 0; round < kRounds; ++round)
      for (std::size_t which = 0; which < kNoises; ++which) {
        if ((which == kSideways && !has_sideways(robot)) || (which == kGyro && !robot.chassis.gyro)) continue;
        improve(pieces, robot, which, levels);
      }
    const double surprised = surprise(pieces, robot, levels);
    if (surprised < smallest) best = levels;
    smallest = std::min(smallest, surprised);
  }
  return best;
}

double share_inside(std::span<const Piece> pieces, const Robot& robot, const Levels& levels) {
  const Odometer odometer(with_levels(robot, levels), {});
  std::size_t inside = 0;
  for (const Piece& piece : pieces) {
    const Miss miss = miss_of(piece, odometer, levels);
    const Vector2 e = miss.error.head<2>();
    inside += e.dot(miss.covariance.topLeftCorner<2, 2>().inverse() * e) <= kEllipse95 ? 1 : 0;
  }
  return static_cast<double>(inside) / static_cast<double>(pieces.size());
}

std::string words(const LearnedNoise& learned, const Robot& robot, double piece_s) {
  std::string text = fmt::format("wheel {:.3g} m/√m", learned.noise.wheel_per_sqrt_m);
  if (has_sideways(robot))
    text += skids(robot) ? fmt::format(", skid {:.3g} m/√m", learned.noise.skid_per_sqrt_m)
                         : fmt::format(", lateral {:.3g} m/√m", learned.noise.lateral_per_sqrt_m);
  if (learned.gyro_rad_s_sqrt_hz) text += fmt::format(", gyro {:.3g} rad/s/√Hz", *learned.gyro_rad_s_sqrt_hz);
  return fmt::format(
      "noise learned from {} pieces of {:g} s against the reference ({:.3g} m, {:.2g}°): {}; {:.0f} % of the "
      "pieces lie "
      "inside their 95 % ellipse",
      learned.pieces, piece_s, learned.reference_position_m, degrees(learned.reference_heading_rad), text,
      100.0 * learned.inside_95);
}

std::vector<Piece> pieces_of(std::span<const Run> runs, const Robot& robot,
                             const LearnNoiseOptions& options) {
  std::vector<Piece> pieces;
  for (const Run& run : runs) add_pieces(run, robot, options.piece_s, pieces);
  return pieces;
}

LearnedNoise learned_from(std::span<const Piece> pieces, const Robot& robot,
                          const LearnNoiseOptions& options) {
  const Levels levels = most_likely(pieces, robot);
  LearnedNoise learned;
  learned.noise = with_levels(robot, levels).chassis.noise;
  if (robot.chassis.gyro) learned.gyro_rad_s_sqrt_hz = levels[kGyro];
  learned.reference_position_m = levels[kPosition];
  learned.reference_heading_rad = levels[kHeading];
  learned.pieces = static_cast<int>(pieces.size());
  learned.inside_95 = share_inside(pieces, robot, levels);
  learned.how = words(learned, robot, options.piece_s);
  return learned;
}

}  // namespace

std::optional<LearnedNoise> learn_noise_if_possible(std::span<const Run> runs, const Robot& robot,
                                                    const LearnNoiseOptions& options) {
  const std::vector<Piece> pieces = pieces_of(runs, robot, options);
  if (pieces.size() < kFewestPieces) return std::nullopt;
  return learned_from(pieces, robot, options);
}

LearnedNoise learn_noise(std::span<const Run> runs, const Robot& robot, const LearnNoiseOptions& options) {
  const std::vector<Piece> pieces = pieces_of(runs, robot, options);
  if (pieces.size() < kFewestPieces)
    throw CannotAnswer(
        fmt::format("noise cannot be learned from {} pieces of {:g} s with a reference pose at both ends; "
                    "{} are needed",
                    pieces.size(), options.piece_s, kFewestPieces));
  return learned_from(pieces, robot, options);
}

Robot with_learned_noise(const Robot& robot, const LearnedNoise& learned) {
  Robot result = robot;
  result.chassis.noise = learned.noise;
  if (result.chassis.gyro) result.chassis.gyro->noise_rad_s_sqrt_hz = *learned.gyro_rad_s_sqrt_hz;
  return result;
}

}  // namespace trundle
