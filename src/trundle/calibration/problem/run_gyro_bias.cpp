#include "trundle/calibration/problem/run_gyro_bias.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "trundle/io/words.hpp"
#include "trundle/odometry/odometer.hpp"
#include "trundle/statistics/distribution.hpp"

namespace trundle::calibration {
namespace {

// Of χ²: equal biases scatter more in one case of a hundred.
constexpr double kBiasesDiffer = 0.01;
// A line of the terminal; of more runs the least and the largest are named.
constexpr std::size_t kMostInWords = 6;

struct NamedBias {
  std::string name;
  GyroBias bias;

  std::string words() const {
    return fmt::format("{} {}", name, with_sigma(bias.rad_s, std::sqrt(bias.variance)));
  }
};

bool differ(const std::vector<NamedBias>& biases) {
  double weight = 0.0, sum = 0.0, chi2 = 0.0;
  for (const auto& [name, bias] : biases) {
    weight += 1.0 / bias.variance;
    sum += bias.rad_s / bias.variance;
  }
  for (const auto& [name, bias] : biases) chi2 += std::pow(bias.rad_s - sum / weight, 2) / bias.variance;
  return chi2 > chi_squared_limit(kBiasesDiffer, static_cast<double>(biases.size()) - 1.0);
}

}  // namespace

bool have_own_gyro_bias(const CalibrationProblem& problem) {
  return !problem.share_gyro_bias && problem.nominal.chassis.gyro &&
         problem.parameters.size() + 1 < kMaxParameters &&
         std::ranges::count_if(problem.runs, &Run::shows_gyro_bias) > 1;
}

void move_gyro_bias(double step_rad_s, Increments& increments) {
  for (std::size_t i = 0; i < increments.size(); ++i) {
    Increment increment = increments[i];
    if (!increment.has_gyro) continue;
    increment.gyro_rad -= step_rad_s * increment.duration_s;
    increments.set(i, increment);
  }
}

void move_gyro_bias(double step_rad_s, Run& run) {
  for (double& rate_rad_s : run.gyro.yaw_rate_rad_s) rate_rad_s -= step_rad_s;
  move_gyro_bias(step_rad_s, run.readings.increments);
  run.gyro_bias_moved_rad_s += step_rad_s;
}

void move_gyro_walk(const BiasWalk& walk, const Eigen::VectorXd& step, Increments& increments) {
  for (std::size_t i = 0; i < increments.size(); ++i) {
    Increment increment = increments[i];
    if (!increment.has_gyro) continue;
    const double middle_s = increment.time_s - 0.5 * increment.duration_s;
    increment.gyro_rad -= walk.at(middle_s).dot(step) * increment.duration_s;
    increments.set(i, increment);
  }
}

void move_gyro_walk(const BiasWalk& walk, const Eigen::VectorXd& step, Run& run) {
  for (std::size_t i = 0; i < run.gyro.time_s.size(); ++i)
    run.gyro.yaw_rate_rad_s[i] -= walk.at(run.gyro.time_s[i]).dot(step);
  move_gyro_walk(walk, step, run.readings.increments);
  run.gyro_walk_moved += step;
}

Run as_recorded(Run run) {
  if (run.gyro_bias_moved_rad_s != 0.0) move_gyro_bias(-run.gyro_bias_moved_rad_s, run);
  if (run.gyro_walk_moved.size() > 0 && !run.gyro_walk_moved.isZero(0.0))
    move_gyro_walk(run.gyro_walk, (-run.gyro_walk_moved).eval(), run);
  return run;
}

std::optional<std::string> words_of_biases(std::span<const Run> runs,
                                           std::span<const std::optional<GyroBias>> biases) {
  std::vector<NamedBias> named;
  for (std::size_t i = 0; i < biases.size(); ++i)
    if (biases[i] && biases[i]->variance > 0.0) named.push_back({runs[i].name, *biases[i]});
  if (named.size() < 2 || !differ(named)) return std::nullopt;
  if (named.size() > kMostInWords) {
    const auto [least, most] =
        std::ranges::minmax(named, {}, [](const NamedBias& one) { return one.bias.rad_s; });
    named = {least, most};
  }
  std::vector<std::string> words;
  for (const NamedBias& one : named) words.push_back(one.words());
  return fmt::format("gyro.bias is another one in each run ({} rad/s{}); each run is used with its own",
                     fmt::join(words, ", "),
                     words.size() < runs.size() ? fmt::format(", of {}", counted(runs.size(), "run")) : "");
}

}  // namespace trundle::calibration
