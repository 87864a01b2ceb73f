#include "trundle/calibration/learn_noise.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include <Eigen/LU>
#include <fmt/format.h>

#include "trundle/calibration/noise_pieces.hpp"
#include "trundle/io/error.hpp"
#include "trundle/statistics/distribution.hpp"
#include "trundle/statistics/minimum.hpp"

namespace trundle {
namespace {

using Pieces = std::span<const NoisePiece>;
using Level = double NoiseLevels::*;

constexpr std::size_t kFewestPieces = 20;
constexpr int kRounds = 4;
constexpr double kFinestLog = 0.02;
// Wheels are told apart where that is likelier than one level for all by what chance gives once in so many.
constexpr double kChance = 1e-3;
constexpr double kLeastWheelNoise = 1e-5;  // [m/√m]
constexpr double kAlikeWithin = 0.7;  // logarithm: wheels of one robot are alike within a factor of 2 (1σ)
constexpr double kLargestShare = 30.0;
constexpr double kCurvatureStep = 0.1;

struct Bounds {
  double low, high;
};

/// The logarithm at which a function of one level is least.
double least(const Bounds& bounds, const std::function<double(double)>& at) {
  return minimum_within({std::log(bounds.low), std::log(bounds.high), kFinestLog}, at);
}

struct FreeLevel {
  Level level;
  Bounds bounds;
};

/// The levels that this robot has.
std::vector<FreeLevel> free_levels(const Robot& robot) {
  std::vector<FreeLevel> levels = {{&NoiseLevels::wheel, {kLeastWheelNoise, 3.0}}};
  if (has_sideways(robot)) levels.push_back({&NoiseLevels::sideways, {1e-5, 3.0}});
  if (robot.chassis.gyro) levels.push_back({&NoiseLevels::gyro, {1e-6, 1.0}});
  levels.push_back({&NoiseLevels::position, {1e-4, 1.0}});
  levels.push_back({&NoiseLevels::heading, {1e-4, 0.5}});
  return levels;
}

/// By the reference, and by what no motion explains.
double surprise(Pieces pieces, const Robot& robot, const NoiseLevels& levels) {
  return surprise_of_misses(pieces, robot, levels) + surprise_of_contradictions(pieces, robot, levels);
}

/// One level after the other.
void improve(Pieces pieces, const Robot& robot, int rounds, NoiseLevels& levels) {
  for (int round = 0; round < rounds; ++round)
    for (const auto& [level, bounds] : free_levels(robot)) {
      NoiseLevels candidate = levels;
      levels.*level = std::exp(least(bounds, [&](double log_level) {
        candidate.*level = std::exp(log_level);
        return surprise(pieces, robot, candidate);
      }));
    }
}

/// All noise may pass for the reference's, or for the robot's: the better of two starts.
NoiseLevels most_likely(Pieces pieces, const Robot& robot) {
  constexpr std::array<NoiseLevels, 2> kStarts = {
      {{0.05, 0.05, 0.05, 0.002, 0.002}, {0.005, 0.005, 0.0005, 0.02, 0.02}}};
  NoiseLevels best;
  double smallest = INFINITY;
  for (NoiseLevels levels : kStarts) {
    improve(pieces, robot, kRounds, levels);
    const double surprised = surprise(pieces, robot, levels);
    if (surprised < smallest) best = levels;
    smallest = std::min(smallest, surprised);
  }
  return best;
}

/// The noise of each wheel as logarithms over a common one.
using LogShares = Eigen::VectorXd;

NoiseLevels with_shares(const NoiseLevels& levels, const LogShares& log_share) {
  const double typical = std::sqrt((2.0 * log_share).array().exp().mean());
  NoiseLevels result = levels;
  result.wheel = levels.wheel * typical;
  for (Eigen::Index i = 0; i < log_share.size(); ++i)
    result.share[static_cast<std::size_t>(i)] = std::exp(log_share[i]) / typical;
  return result;
}

/// Without evidence wheels are alike. docs/theory/calibration-noise.md, eq. 11.
double surprise_of_wheels(Pieces pieces, const Robot& robot, const NoiseLevels& levels,
                          const LogShares& log_share) {
  const NoiseLevels candidate = with_shares(levels, log_share);
  const double unlike = (log_share.array() - log_share.mean()).square().sum() / (kAlikeWithin * kAlikeWithin);
  return surprise(pieces, robot, candidate) + unlike;
}

LogShares most_likely_shares(Pieces pieces, const Robot& robot, const NoiseLevels& levels) {
  LogShares share = LogShares::Zero(robot.chassis.wheel_count);
  for (int round = 0; round < kRounds; ++round)
    for (double& own : share) {
      LogShares candidate = share;
      double& changed = candidate[&own - share.data()];
      own = least({1.0 / kLargestShare, kLargestShare}, [&](double log_share) {
        changed = log_share;
        return surprise_of_wheels(pieces, robot, levels, candidate);
      });
    }
  return share;
}

/// Is a level for each wheel likelier than one for all, beyond what chance gives?
bool tells_wheels_apart(Pieces pieces, const Robot& robot, const NoiseLevels& levels,
                        const LogShares& share) {
  const auto least_alike = least({1.0 / kLargestShare, kLargestShare}, [&](double common) {
    return surprise_of_wheels(pieces, robot, levels, LogShares::Constant(share.size(), common));
  });
  const double gain =
      surprise_of_wheels(pieces, robot, levels, LogShares::Constant(share.size(), least_alike)) -
      surprise_of_wheels(pieces, robot, levels, share);
  return gain > chi_squared_limit(kChance, static_cast<double>(share.size() - 1));
}

/// 1σ of the logarithm of each wheel's noise: from the curvature of the surprise in all of them together.
Eigen::VectorXd sigmas_of(Pieces pieces, const Robot& robot, const NoiseLevels& levels,
                          const LogShares& share) {
  const Eigen::Index n = share.size();
  const auto at = [&](Eigen::Index i, double a, Eigen::Index j, double b) {
    LogShares moved = share;
    moved[i] += a;
    moved[j] += b;
    return surprise_of_wheels(pieces, robot, levels, moved);
  };
  constexpr double h = kCurvatureStep;
  Eigen::MatrixXd curvature(n, n);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = i; j < n; ++j)
      curvature(i, j) = curvature(j, i) =
          (at(i, h, j, h) - at(i, h, j, -h) - at(i, -h, j, h) + at(i, -h, j, -h)) / (4.0 * h * h);
  return (2.0 * curvature.inverse().diagonal()).cwiseMax(0.0).cwiseSqrt();
}

/// Levels and, where wheels are told apart, the sigmas of the logarithms of theirs.
struct Learned {
  NoiseLevels levels;
  Eigen::VectorXd wheel_sigma;
};

Learned learn(Pieces pieces, const Robot& robot, bool per_wheel) {
  Learned learned{most_likely(pieces, robot), {}};
  if (!per_wheel || robot.chassis.wheel_count < 2) return learned;
  const LogShares share = most_likely_shares(pieces, robot, learned.levels);
  if (!tells_wheels_apart(pieces, robot, learned.levels, share)) return learned;
  learned.wheel_sigma = sigmas_of(pieces, robot, learned.levels, share);
  learned.levels = with_shares(learned.levels, share);
  improve(pieces, robot, kRounds / 2, learned.levels);
  return learned;
}

std::string words_of_wheels(const LearnedNoise& learned, const Robot& robot) {
  if (learned.wheels.empty())
    return fmt::format("wheel {:.3g} m/√m{}", learned.noise.wheel_per_sqrt_m,
                       learned.noise.wheel_per_sqrt_m < 2.0 * kLeastWheelNoise
                           ? " (the least that is looked for: the reference's own noise hides it)"
                       : robot.chassis.wheel_count > 1 ? " (no wheel is told to differ)"
                                                       : "");
  std::string text = "wheels";
  for (std::size_t i = 0; i < learned.wheels.size(); ++i)
    text += fmt::format("{} {} {:.3g} ± {:.1g}", i == 0 ? "" : ",", robot.wheel_names[i],
                        learned.wheels[i].per_sqrt_m, learned.wheels[i].sigma);
  return text + " m/√m";
}

std::string words(const LearnedNoise& learned, const Robot& robot, double piece_s) {
  std::string text = words_of_wheels(learned, robot);
  if (has_sideways(robot))
    text += has_skid_wheels(robot.chassis)
                ? fmt::format(", skid {:.3g} m/√m", learned.noise.skid_per_sqrt_m)
                : fmt::format(", lateral {:.3g} m/√m", learned.noise.lateral_per_sqrt_m);
  if (learned.gyro_rad_s_sqrt_hz) text += fmt::format(", gyro {:.3g} rad/s/√Hz", *learned.gyro_rad_s_sqrt_hz);
  return fmt::format(
      "noise learned from {} pieces of {:g} s against the reference ({:.3g} m, {:.2g}°): {}; {:.0f} % of the "
      "pieces lie "
      "inside their 95 % ellipse",
      learned.pieces, piece_s, learned.reference_position_m, degrees(learned.reference_heading_rad), text,
      100.0 * learned.inside_95);
}

LearnedNoise learned_from(Pieces pieces, const Robot& robot, const LearnNoiseOptions& options) {
  const auto [levels, wheel_sigma] = learn(pieces, robot, options.per_wheel);
  LearnedNoise learned;
  learned.noise = with_levels(robot, levels).chassis.noise;
  for (Eigen::Index i = 0; i < wheel_sigma.size(); ++i) {
    const double own = levels.wheel * levels.share[static_cast<std::size_t>(i)];
    learned.wheels.push_back({own, own * wheel_sigma[i]});
  }
  if (robot.chassis.gyro) learned.gyro_rad_s_sqrt_hz = levels.gyro;
  learned.reference_position_m = levels.position;
  learned.reference_heading_rad = levels.heading;
  learned.pieces = static_cast<int>(pieces.size());
  learned.inside_95 = share_inside(pieces, robot, levels);
  learned.how = words(learned, robot, options.piece_s);
  return learned;
}

}  // namespace

std::optional<LearnedNoise> learn_noise_if_possible(std::span<const Run> runs, const Robot& robot,
                                                    const LearnNoiseOptions& options) {
  const std::vector<NoisePiece> pieces = noise_pieces(runs, robot, options.piece_s);
  if (pieces.size() < kFewestPieces) return std::nullopt;
  return learned_from(pieces, robot, options);
}

LearnedNoise learn_noise(std::span<const Run> runs, const Robot& robot, const LearnNoiseOptions& options) {
  const std::vector<NoisePiece> pieces = noise_pieces(runs, robot, options.piece_s);
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
  const auto wheels = result.chassis.wheels();
  for (std::size_t i = 0; i < wheels.size(); ++i)
    wheels[i].noise_per_sqrt_m =
        learned.wheels.empty() ? Wheel{}.noise_per_sqrt_m : learned.wheels[i].per_sqrt_m;
  if (result.chassis.gyro) result.chassis.gyro->noise_rad_s_sqrt_hz = *learned.gyro_rad_s_sqrt_hz;
  return result;
}

}  // namespace trundle
