#include "trundle/calibration/likelihood/likelihood.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "trundle/calibration/likelihood/chassis_likelihood.hpp"
#include "trundle/calibration/likelihood/gyro_bias_spread.hpp"
#include "trundle/calibration/likelihood/reference_measurement.hpp"
#include "trundle/calibration/likelihood/relative_likelihood.hpp"
#include "trundle/calibration/problem/run_gyro_bias.hpp"
#include "trundle/geometry/squared.hpp"
#include "trundle/io/interruption.hpp"

namespace trundle::calibration {
namespace {

// A variance from so many blocks is known to √(2/12): their scatter, a sigma, to a fifth.
constexpr std::size_t kFewestBlocks = 12;
// Of a walk: of its mean square 1 − 6/π² Σ 1/k² = 5 % is left.
constexpr Eigen::Index kMostHarmonics = 12;
// A run's own: the gyro's bias, the reference's clock, and the heading at the start.
constexpr Eigen::Index kMostOwn = 3;
// The prior of that heading: anything.
constexpr double kStartHeadingPrior_rad = kPi;
// Of relative motions before their residuals are looked at: 1 cm and 0.6°, as of a scan matcher.
constexpr double kUsualRelativeVariance = 1e-4;

/// Of so many parameters: it says nothing of those behind its own.
void append(std::vector<Information>& all, Eigen::Index parameters, const std::vector<Information>& more) {
  for (const Information& information : more) {
    if (information.count == 0) continue;
    all.push_back(information);
    const Eigen::Index missing = parameters - information.gradient.size();
    if (missing == 0) continue;
    all.back().matrix.conservativeResizeLike(Eigen::MatrixXd::Zero(parameters, parameters));
    all.back().gradient.conservativeResizeLike(Eigen::VectorXd::Zero(parameters));
    if (Eigen::MatrixXd& of_noise = all.back().of_noise; of_noise.size() > 0)
      of_noise.conservativeResizeLike(Eigen::MatrixXd::Zero(parameters, parameters));
  }
}

/// Which readings belong to a motion, and what they are, is fixed unless an offset of clocks is estimated; of
/// wheels that scrub or grow there is no table.
std::vector<std::optional<RelativeTable>> relative_tables(const CalibrationProblem& problem) {
  std::vector<std::optional<RelativeTable>> tables(problem.runs.size());
  if (contains(problem.parameters, ParameterKind::time_offset) ||
      contains(problem.parameters, ParameterKind::gyro_time_offset) ||
      contains(problem.parameters, ParameterKind::scrub) || problem.nominal.chassis.scrub != 0.0 ||
      contains(problem.parameters, ParameterKind::tyre_growth) ||
      problem.nominal.chassis.tyre_growth_s2_m2 != 0.0)
    return tables;
  std::ranges::transform(problem.runs, tables.begin(),
                         [&](const Run& run) { return relative_table(run, problem.nominal); });
  return tables;
}

/// Of one run: in one fast pass where a table holds the whole problem, else motion by motion.
std::vector<Information> relative_information_of(const Likelihood& likelihood, const Run& run,
                                                 std::size_t index, const Robot& robot,
                                                 std::span<const Parameter> parameters) {
  const Matrix3 W = likelihood.relative_covariance[index].inverse();
  const auto blocks = static_cast<std::size_t>(likelihood.blocks_of_a_run());
  if (likelihood.relative_table[index])
    return relative_information(*likelihood.relative_table[index], robot, parameters, {W, likelihood.gate},
                                blocks);
  std::vector<Information> result;
  result.reserve(blocks);
  for (std::size_t i = 0; i < blocks; ++i)
    result.push_back(Information::zero(static_cast<Eigen::Index>(parameters.size())));
  const RelativeResiduals r = relative_residuals(run, robot, parameters);
  for (std::size_t i = 0; i < r.residual.size(); ++i)
    add_within(result[i * blocks / r.residual.size()], r.jacobian[i], W, r.residual[i], likelihood.gate);
  return result;
}

/// Of the gyro's readings alone: what heading misses beyond that is of clocks and of the reference.
std::optional<double> own_gyro_noise(const CalibrationProblem& problem) {
  const std::optional<Gyro>& gyro = problem.nominal.chassis.gyro;
  return gyro ? std::optional(gyro->noise_rad_s_sqrt_hz) : std::nullopt;
}

/// The clock of its reference is the last parameter, and moves nothing else that was measured.
std::size_t without_clock(std::span<const Parameter> parameters, std::span<const OwnParameter> own) {
  const bool has_clock = std::ranges::any_of(own, [](const OwnParameter& one) {
    return one.parameter && one.parameter->kind == ParameterKind::time_offset;
  });
  return parameters.size() - (has_clock ? 1 : 0);
}

std::size_t place_of_gyro_bias(std::span<const Parameter> parameters) {
  return static_cast<std::size_t>(std::ranges::find(parameters, kGyroBias) - parameters.begin());
}

/// For which there is room among the parameters.
void keep_first_harmonics(CalibrationProblem& problem) {
  const auto parameters = static_cast<Eigen::Index>(problem.parameters.size());
  const Eigen::Index room = std::max<Eigen::Index>(0, kMaxParameters - kMostOwn - parameters);
  for (Run& run : problem.runs) {
    run.gyro_walk.harmonics = std::min({run.gyro_walk.harmonics, kMostHarmonics, room});
    run.gyro_walk_moved.conservativeResize(run.gyro_walk.harmonics);
  }
}

Robot with_levels(const Robot& robot, const NoiseLevels& levels, const Robot& nominal) {
  return with_noise_of_readings(with_noise(robot, levels), nominal.chassis);
}

/// With the noise of its readings alone, where they show it themselves: what a reference misses beyond what
/// readings contradict each other by is of the reference, and of what the robot file says of it. Until the
/// runs show any, that of the robot file. Nothing: it is the robot's.
std::optional<Robot> as_read_in(const Likelihood& likelihood, const Robot& robot,
                                const Robot& contradicting) {
  const Robot& nominal = likelihood.problem.nominal;
  if (!likelihood.noise.from_runs) return with_levels(robot, noise_levels_of(nominal), nominal);
  if (likelihood.contradicting_share == 1.0) return std::nullopt;
  return without_rounding(contradicting);
}

ChassisLikelihoodOptions redundancy_options(const Likelihood& likelihood, std::size_t index) {
  return {.blocks = likelihood.blocks_of_a_run(),
          .variance_factor = likelihood.redundancy_factor,
          .gate = likelihood.gate,
          .with_noise = likelihood.takes_out_noise,
          .sums = likelihood.sums_of(index)};
}

RunInformation information_of(const Likelihood& likelihood, const Run& run, std::size_t index,
                              const Robot& robot) {
  const std::vector<OwnParameter> own = likelihood.own_of(run);
  const std::vector<Parameter> all = with_own(likelihood.problem.parameters, own);
  const Eigen::Index n = likelihood.problem.size() + static_cast<Eigen::Index>(own.size());
  const auto parameters = std::span(all).first(without_clock(all, own));
  const Robot noisy = without_rounding(noisy_robot(robot, likelihood));
  const Robot contradicting = contradicting_robot(robot, likelihood, likelihood.contradicting_share);
  const std::optional<Robot> read = as_read_in(likelihood, robot, contradicting);
  RunInformation result;
  const ChassisLikelihoodOptions redundant = redundancy_options(likelihood, index);
  const LikelihoodOptions options{
      .reference_noise = likelihood.noise.levels.reference,
      .blocks = redundant.blocks,
      .gyro_noise_rad_s_sqrt_hz = own_gyro_noise(likelihood.problem),
      .gate = likelihood.gate,
      .readings = read ? &read->chassis : nullptr,
      .with_noise = likelihood.takes_out_noise,
      .own = {.walking_bias =
                  likelihood.seeks_walk(run) ? std::optional(place_of_gyro_bias(all)) : std::nullopt,
              .start_heading = likelihood.seeks_start_heading(run)},
      .redundant = likelihood.uses_redundancy ? std::optional(RedundantReadings{contradicting, redundant})
                                              : std::nullopt};
  RunLikelihood stream = stream_likelihood(run, noisy, all, options);
  append(result.blocks, n, stream.blocks);
  append(result.blocks, n, partial_likelihood(run, noisy, parameters, options).blocks);
  if (run.epochs.empty() && likelihood.uses_redundancy)
    append(result.blocks, n, chassis_likelihood(run, contradicting, parameters, redundant));
  if (!run.relative_motions.empty())
    append(result.blocks, n, relative_information_of(likelihood, run, index, noisy, parameters));
  if (likelihood.takes_out_noise) keep_what_is_known(result.blocks);
  result.outliers = std::move(stream.outliers);
  return result;
}

/// The run, and what is kept of it with the gyro's stamps elsewhere.
template <class Move>
void move_run(const Move& move, std::size_t index, Likelihood& likelihood) {
  move(likelihood.problem.runs[index]);
  if (!likelihood.clocked.empty()) move(likelihood.clocked[index]);
}

/// All that is kept of a run's readings. `move`: of the run, and of readings that were summed.
template <class Move>
void move_gyro(const Move& move, std::size_t index, Likelihood& likelihood) {
  move_run(move, index, likelihood);
  if (likelihood.relative_table[index])
    likelihood.relative_table[index] =
        relative_table(likelihood.problem.runs[index], likelihood.problem.nominal);
  if (index >= likelihood.window_sums.size() || !likelihood.window_sums[index]) return;
  move(likelihood.window_sums[index]->windows);
  move(likelihood.window_sums[index]->parts);
}

/// What is found of the heading at a run's start goes on from where it was.
void turn_start(double step_rad, const Robot& robot, Run& run) {
  if (!run.start_heading_rad) run.start_heading_rad = course_over_ground(run, 0, robot);
  *run.start_heading_rad += step_rad;
}

}  // namespace

int Likelihood::blocks_of_a_run() const {
  const std::size_t runs = problem.runs.size();
  return runs >= kFewestBlocks ? 1 : static_cast<int>((kFewestBlocks + runs - 1) / runs);
}

const WindowSums* Likelihood::sums_of(std::size_t run) const {
  return run < window_sums.size() && window_sums[run] ? &*window_sums[run] : nullptr;
}

Likelihood likelihood_of(const CalibrationProblem& problem) {
  const std::size_t runs = problem.runs.size();
  Likelihood likelihood{
      .problem = problem,
      .noise = {noise_levels_of(problem.nominal)},
      .relative_covariance = std::vector<Matrix3>(runs, Matrix3::Identity() * kUsualRelativeVariance),
      .run_weight = std::vector<double>(runs, 1.0),
      .gyro_bias_spread_rad_s = given_gyro_bias_spread(problem),
      .relative_table = relative_tables(problem),
      .window_sums = {},
      .clocked = {}};
  keep_first_harmonics(likelihood.problem);
  if (contains(problem.parameters, ParameterKind::gyro_time_offset))
    likelihood.clocked.assign(problem.runs.begin(), problem.runs.end());
  else
    for (const Run& run : problem.runs)
      likelihood.window_sums.push_back(window_sums(run, problem.nominal.chassis, kParityWindow_s));
  return likelihood;
}

bool Likelihood::seeks_walk(const Run& run) const {
  return run.gyro_walk.harmonics > 0 && !run.epochs.empty() &&
         contains(problem.parameters, ParameterKind::gyro_bias);
}

bool Likelihood::seeks_start_heading(const Run& run) const {
  return !run.epochs.empty() && !run.reference.has_headings() &&
         problem.size() + kMostOwn <= static_cast<Eigen::Index>(kMaxParameters);
}

std::vector<OwnParameter> Likelihood::own_of(const Run& run) const {
  std::vector<OwnParameter> own;
  if (gyro_bias_spread_rad_s > 0.0 && run.shows_gyro_bias())
    own.push_back({kGyroBias, gyro_bias_spread_rad_s, run.gyro_bias_moved_rad_s});
  if (seeks_clock(run))
    own.push_back({Parameter{ParameterKind::time_offset, -1}, kClockPrior_s, run.clock_moved_s});
  if (seeks_walk(run))
    for (const double moved : run.gyro_walk_moved) own.push_back({std::nullopt, 1.0, moved});
  if (seeks_start_heading(run)) own.push_back({std::nullopt, kStartHeadingPrior_rad, 0.0});
  return own;
}

void set_own_parameters(const Robot& robot, Likelihood& likelihood) {
  for (Run& run : likelihood.clocked) set_gyro_clock(robot, run);
  for (std::size_t i = 0; i < likelihood.problem.runs.size(); ++i) {
    const std::vector<OwnParameter> own = likelihood.own_of(likelihood.runs()[i]);
    if (own.empty()) continue;
    const auto n = likelihood.problem.size() + static_cast<Eigen::Index>(own.size());
    const OwnStep step = own_step(information_of(likelihood, likelihood.runs()[i], i, robot).total(n), own);
    if (likelihood.seeks_start_heading(likelihood.runs()[i])) {
      const double turned = step.step.tail<1>().value();
      move_run([&](Run& run) { turn_start(turned, robot, run); }, i, likelihood);
    }
    if (const Run& run = likelihood.runs()[i]; likelihood.seeks_walk(run)) {
      const BiasWalk walk = run.gyro_walk;
      const auto first = std::ranges::count_if(own, [](const OwnParameter& one) { return !!one.parameter; });
      const Eigen::VectorXd moved = step.step.segment(first, walk.harmonics);
      move_gyro([&](auto& readings) { move_gyro_walk(walk, moved, readings); }, i, likelihood);
    }
    for (std::size_t j = 0; j < own.size() && own[j].parameter; ++j) {
      const auto k = static_cast<Eigen::Index>(j);
      if (own[j].parameter == kGyroBias) {
        move_gyro([&](auto& readings) { move_gyro_bias(step.step[k], readings); }, i, likelihood);
        continue;
      }
      const ClockStep clock{step.step[k], std::sqrt(step.covariance(k, k))};
      move_run([&](Run& run) { move_clock(clock, robot, run); }, i, likelihood);
    }
  }
}

Robot noisy_robot(const Robot& robot, const Likelihood& likelihood) {
  return with_levels(robot, likelihood.noise.levels, likelihood.problem.nominal);
}

Robot contradicting_robot(const Robot& robot, const Likelihood& likelihood, double share) {
  NoiseLevels levels = likelihood.noise.levels;
  levels.wheel_per_sqrt_m *= std::sqrt(share);
  if (const auto own = own_gyro_noise(likelihood.problem)) {
    const double beyond = squared(levels.gyro_rad_s_sqrt_hz) - squared(*own);
    levels.gyro_rad_s_sqrt_hz = std::sqrt(squared(*own) + share * beyond);
  }
  return with_levels(robot, levels, likelihood.problem.nominal);
}

Information RunInformation::total(Eigen::Index parameters) const {
  Information sum = Information::zero(parameters);
  for (const Information& block : blocks) sum.add(block);
  return sum;
}

RunInformation information_with_own(const Likelihood& likelihood, std::size_t index, const Robot& robot) {
  if (likelihood.clocked.empty()) return information_of(likelihood, likelihood.runs()[index], index, robot);
  Run run = likelihood.runs()[index];
  set_gyro_clock(robot, run);
  return information_of(likelihood, run, index, robot);
}

RunInformation run_information(const Likelihood& likelihood, std::size_t index, const Robot& robot) {
  RunInformation information = information_with_own(likelihood, index, robot);
  information.blocks = without_own(information.blocks, likelihood.own_of(likelihood.runs()[index]));
  return information;
}

Information redundancy_information(const Likelihood& likelihood, std::size_t index, const Robot& robot) {
  const Run& run = likelihood.runs()[index];
  const std::vector<OwnParameter> own = likelihood.own_of(run);
  const std::vector<Parameter> all = with_own(likelihood.problem.parameters, own);
  const Eigen::Index n = likelihood.problem.size() + static_cast<Eigen::Index>(own.size());
  RunInformation result;
  append(result.blocks, n,
         chassis_likelihood(run, contradicting_robot(robot, likelihood, likelihood.contradicting_share),
                            std::span(all).first(without_clock(all, own)),
                            redundancy_options(likelihood, index)));
  return result.total(n);
}

Information total_information(const Likelihood& likelihood, const Robot& robot) {
  Information total = Information::zero(likelihood.problem.size());
  for (std::size_t i = 0; i < likelihood.runs().size(); ++i) {
    check_interruption();
    for (const Information& block : run_information(likelihood, i, robot).blocks)
      total.add(block, likelihood.run_weight[i]);
  }
  return total;
}

}  // namespace trundle::calibration
