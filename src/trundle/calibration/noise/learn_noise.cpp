#include "trundle/calibration/noise/learn_noise.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "trundle/calibration/noise/displacements.hpp"
#include "trundle/calibration/noise/level_search.hpp"
#include "trundle/geometry/decompositions.hpp"
#include "trundle/io/error.hpp"
#include "trundle/statistics/distribution.hpp"

namespace trundle::calibration {
namespace {

using Displacements = std::span<const Displacement>;

// So few leave the typical level, σ/σ = 1/√(2n), known to 16 %; less is no use beside the robot file's.
constexpr std::size_t kFewestDisplacements = 20;
// Times that every level is sought while the others stay: levels are little correlated, two do.
constexpr int kRounds = 4;
// Wheels are distinguished where that is likelier than one level for all by what chance gives once in so
// many, and so they are taken to err alike.
constexpr double kChance = 1e-3;
constexpr double kLeastWheelNoise = 1e-5;  // [m/√m]
constexpr double kAlikeWithin = 0.7;    // logarithm: wheels of one robot are alike within a factor of 2 (1σ)
constexpr double kLargestRatio = 30.0;  // of two wheels' levels: 5 of those sigmas
// Of a logarithm, for second differences: the deviance is a parabola over it, and many times as large as what
// level_search.cpp leaves.
constexpr double kCurvatureStep = 0.1;

/// The levels that this robot has, and where they are looked for: between what no sensor shows and what would
/// be no sensor.
std::vector<FreeLevel> free_levels(const Robot& robot) {
  using L = NoiseLevels;
  std::vector<FreeLevel> levels = {
      {[](L& l) -> double& { return l.wheel_per_sqrt_m; }, kLeastWheelNoise, 3.0}};
  if (has_sideways(robot))
    levels.push_back({[](L& l) -> double& { return l.sideways_per_sqrt_m; }, 1e-5, 3.0});
  if (robot.chassis.gyro) {  // how they compare shows in what no motion explains, whatever both are
    levels.push_back({[](L& l) -> double& { return l.gyro_rad_s_sqrt_hz; }, 1e-6, 1.0});
    levels.front().along = levels.back().of;
  }
  levels.push_back({[](L& l) -> double& { return l.reference.position_m; }, 1e-4, 1.0});
  levels.push_back({[](L& l) -> double& { return l.reference.heading_rad; }, 1e-4, 0.5});
  return levels;
}

/// What levels are learned from, and what is assumed of it.
struct Evidence {
  Displacements displacements;
  WheelErrors errors;
};

/// By what no motion explains, and by the reference given that.
double deviance(const Evidence& evidence, const Robot& robot, const NoiseLevels& levels) {
  const auto [of_parity, share] = parity_deviance(evidence.displacements, robot, levels, evidence.errors);
  return of_parity + displacement_deviance(evidence.displacements, robot, levels, share);
}

/// Levels, and how likely they are.
struct Levels {
  NoiseLevels levels;
  double deviance = INFINITY;
};

/// All noise may pass for the reference's, or for the robot's: the better of two starts.
Levels most_likely(const Evidence& evidence, const Robot& robot) {
  constexpr std::array<NoiseLevels, 2> kStarts = {
      {{0.05, 0.05, 0.05, {.position_m = 0.002, .heading_rad = 0.002}},
       {0.005, 0.005, 0.0005, {.position_m = 0.02, .heading_rad = 0.02}}}};
  Levels best;
  for (NoiseLevels levels : kStarts) {
    const Deviance at = [&](const NoiseLevels& l) { return deviance(evidence, robot, l); };
    improve(free_levels(robot), kRounds, at, levels);
    const double here = at(levels);
    if (here < best.deviance) best = {levels, here};
  }
  return best;
}

bool have_parity(Displacements displacements) {
  return std::ranges::any_of(displacements, [](const Displacement& d) { return d.parity.size() > 0; });
}

/// Do wheels err alike by more than chance makes it seem? Where they do not, what no motion explains shows
/// all of their noise.
WheelErrors errors_of_wheels(double independent, double partly_alike) {
  return independent - partly_alike > chi_squared_limit(kChance, 1.0) ? WheelErrors::partly_alike
                                                                      : WheelErrors::independent;
}

/// The noise of each wheel as logarithms over a common one.
using LogRatios = Eigen::VectorXd;

NoiseLevels with_ratios(const NoiseLevels& levels, const LogRatios& log_ratio) {
  const double typical = std::sqrt((2.0 * log_ratio).array().exp().mean());
  NoiseLevels result = levels;
  result.wheel_per_sqrt_m = levels.wheel_per_sqrt_m * typical;
  for (Eigen::Index i = 0; i < log_ratio.size(); ++i)
    result.wheel_ratio[static_cast<std::size_t>(i)] = std::exp(log_ratio[i]) / typical;
  return result;
}

/// Without evidence wheels are alike. docs/theory/calibration-noise-displacements.md, eq. 11.
double deviance_of_wheels(const Evidence& evidence, const Robot& robot, const NoiseLevels& levels,
                          const LogRatios& log_ratio) {
  const NoiseLevels candidate = with_ratios(levels, log_ratio);
  const double unlike = (log_ratio.array() - log_ratio.mean()).square().sum() / (kAlikeWithin * kAlikeWithin);
  return deviance(evidence, robot, candidate) + unlike;
}

LogRatios most_likely_ratios(const Evidence& evidence, const Robot& robot, const NoiseLevels& levels) {
  LogRatios ratio = LogRatios::Zero(robot.chassis.wheel_count);
  for (int round = 0; round < kRounds; ++round)
    for (double& own : ratio) {
      LogRatios candidate = ratio;
      double& changed = candidate[&own - ratio.data()];
      own = least_log(1.0 / kLargestRatio, kLargestRatio, [&](double log_ratio) {
        changed = log_ratio;
        return deviance_of_wheels(evidence, robot, levels, candidate);
      });
    }
  return ratio;
}

/// Is a level for each wheel likelier than one for all, beyond what chance gives?
bool distinguishes_wheels(const Evidence& evidence, const Robot& robot, const NoiseLevels& levels,
                          const LogRatios& ratio) {
  const auto least_alike = least_log(1.0 / kLargestRatio, kLargestRatio, [&](double common) {
    return deviance_of_wheels(evidence, robot, levels, LogRatios::Constant(ratio.size(), common));
  });
  const double gain =
      deviance_of_wheels(evidence, robot, levels, LogRatios::Constant(ratio.size(), least_alike)) -
      deviance_of_wheels(evidence, robot, levels, ratio);
  return gain > chi_squared_limit(kChance, static_cast<double>(ratio.size() - 1));
}

/// 1σ of the logarithm of each wheel's noise: from the curvature of the deviance in all of them together.
Eigen::VectorXd sigmas_of(const Evidence& evidence, const Robot& robot, const NoiseLevels& levels,
                          const LogRatios& ratio) {
  const Eigen::Index n = ratio.size();
  const auto at = [&](Eigen::Index i, double a, Eigen::Index j, double b) {
    LogRatios moved = ratio;
    moved[i] += a;
    moved[j] += b;
    return deviance_of_wheels(evidence, robot, levels, moved);
  };
  constexpr double h = kCurvatureStep;
  Eigen::MatrixXd curvature(n, n);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = i; j < n; ++j)
      curvature(i, j) = curvature(j, i) =
          (at(i, h, j, h) - at(i, h, j, -h) - at(i, -h, j, h) + at(i, -h, j, -h)) / (4.0 * h * h);
  return (2.0 * inverse_of(curvature).diagonal()).cwiseMax(0.0).cwiseSqrt();
}

/// Levels and, where wheels are distinguished, the sigmas of the logarithms of theirs.
struct MostLikely {
  NoiseLevels levels;
  Eigen::VectorXd wheel_log_sigma;
};

MostLikely learn(Displacements displacements, const Robot& robot, bool per_wheel) {
  const Levels independent = most_likely({displacements, WheelErrors::independent}, robot);
  // Without redundant readings both are the same.
  const Levels partly_alike = have_parity(displacements)
                                  ? most_likely({displacements, WheelErrors::partly_alike}, robot)
                                  : independent;
  const Evidence evidence{displacements, errors_of_wheels(independent.deviance, partly_alike.deviance)};
  MostLikely learned{evidence.errors == WheelErrors::independent ? independent.levels : partly_alike.levels,
                     {}};
  if (!per_wheel || robot.chassis.wheel_count < 2) return learned;
  const LogRatios ratio = most_likely_ratios(evidence, robot, learned.levels);
  if (!distinguishes_wheels(evidence, robot, learned.levels, ratio)) return learned;
  learned.wheel_log_sigma = sigmas_of(evidence, robot, learned.levels, ratio);
  learned.levels = with_ratios(learned.levels, ratio);
  improve(
      free_levels(robot), kRounds / 2, [&](const NoiseLevels& l) { return deviance(evidence, robot, l); },
      learned.levels);
  return learned;
}

std::string words_of_wheels(const LearnedNoise& learned, const Robot& robot) {
  const double typical = learned.levels.wheel_per_sqrt_m;
  if (learned.wheels.empty())
    return fmt::format("wheel {:.3g} m/√m{}", typical,
                       typical < 2.0 * kLeastWheelNoise
                           ? " (the least that is looked for: the reference's own noise hides it)"
                       : robot.chassis.wheel_count > 1 ? " (no wheel shows one of its own)"
                                                       : "");
  std::string text = "wheels";
  for (std::size_t i = 0; i < learned.wheels.size(); ++i)
    text += fmt::format("{} {} {:.3g} ± {:.1g}", i == 0 ? "" : ",", robot.wheel_names[i],
                        learned.wheels[i].per_sqrt_m, learned.wheels[i].sigma);
  return text + " m/√m";
}

std::string words(const LearnedNoise& learned, const Robot& robot, double stretch_s) {
  const NoiseLevels& levels = learned.levels;
  std::string text = words_of_wheels(learned, robot);
  if (has_sideways(robot))
    text += fmt::format(", {} {:.3g} m/√m", has_skid_wheels(robot.chassis) ? "skid" : "lateral",
                        levels.sideways_per_sqrt_m);
  if (robot.chassis.gyro) text += fmt::format(", gyro {:.3g} rad/s/√Hz", levels.gyro_rad_s_sqrt_hz);
  return fmt::format(
      "noise learned from {} pieces of {:g} s against the reference ({:.3g} m, {:.2g}°): {}; {:.0f} % of the "
      "pieces lie "
      "inside their 95 % ellipse",
      learned.displacements, stretch_s, levels.reference.position_m, degrees(levels.reference.heading_rad),
      text, 100.0 * learned.inside_95);
}

LearnedNoise learned_from(Displacements displacements, const Robot& robot, const LearnNoiseOptions& options) {
  const auto [levels, wheel_log_sigma] = learn(displacements, robot, options.per_wheel);
  LearnedNoise learned{.levels = levels};
  for (Eigen::Index i = 0; i < wheel_log_sigma.size(); ++i) {
    const double own = levels.wheel_per_sqrt_m * levels.wheel_ratio[static_cast<std::size_t>(i)];
    learned.wheels.push_back({own, own * wheel_log_sigma[i]});
  }
  learned.displacements = static_cast<int>(displacements.size());
  learned.inside_95 = share_inside(displacements, robot, levels);
  learned.how = words(learned, robot, options.stretch_s);
  return learned;
}

}  // namespace

std::optional<LearnedNoise> learn_noise_if_possible(std::span<const Run> runs, const Robot& robot,
                                                    const LearnNoiseOptions& options) {
  const std::vector<Displacement> all = displacements(runs, robot, options.stretch_s);
  if (all.size() < kFewestDisplacements) return std::nullopt;
  return learned_from(all, robot, options);
}

LearnedNoise learn_noise(std::span<const Run> runs, const Robot& robot, const LearnNoiseOptions& options) {
  const std::vector<Displacement> all = displacements(runs, robot, options.stretch_s);
  if (all.size() < kFewestDisplacements)
    throw CannotAnswer(
        fmt::format("noise cannot be learned from {} pieces of {:g} s with a reference pose at both ends; "
                    "{} are needed",
                    all.size(), options.stretch_s, kFewestDisplacements));
  return learned_from(all, robot, options);
}

}  // namespace trundle::calibration
