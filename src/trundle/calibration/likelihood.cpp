#include "trundle/calibration/likelihood.hpp"

#include <algorithm>

#include <Eigen/LU>

#include "trundle/calibration/chassis_likelihood.hpp"
#include "trundle/calibration/relative_likelihood.hpp"
#include "trundle/io/interruption.hpp"

namespace trundle::calibration {
namespace {

// A variance from so many blocks is known to √(2/12): their scatter, a sigma, to a fifth.
constexpr std::size_t kFewestBlocks = 12;
// Of relative motions before their residuals are looked at: 1 cm and 0.6°, as of a scan matcher.
constexpr double kUsualRelativeVariance = 1e-4;

void append(std::vector<Information>& all, const std::vector<Information>& more) {
  for (const Information& information : more)
    if (information.count > 0) all.push_back(information);
}

/// Which readings belong to a motion, and what they are, is fixed unless an offset of clocks is estimated.
std::vector<std::optional<RelativeTable>> relative_tables(const CalibrationProblem& problem) {
  std::vector<std::optional<RelativeTable>> tables(problem.runs.size());
  if (contains(problem.parameters, ParameterKind::time_offset) ||
      contains(problem.parameters, ParameterKind::gyro_time_offset))
    return tables;
  std::ranges::transform(problem.runs, tables.begin(),
                         [&](const Run& run) { return relative_table(run, problem.nominal); });
  return tables;
}

/// Of one run: in one fast pass where a table holds the whole problem, else motion by motion.
std::vector<Information> relative_information_of(const Likelihood& likelihood, const Run& run,
                                                 std::size_t index, const Robot& robot) {
  const Matrix3 W = likelihood.relative_covariance[index].inverse();
  const std::vector<Parameter>& parameters = likelihood.problem.parameters;
  const auto blocks = static_cast<std::size_t>(likelihood.blocks_of_a_run());
  if (likelihood.relative_table[index])
    return relative_information(*likelihood.relative_table[index], robot, parameters, {W, likelihood.gate},
                                blocks);
  std::vector<Information> result;
  result.reserve(blocks);
  for (std::size_t i = 0; i < blocks; ++i) result.push_back(Information::zero(likelihood.problem.size()));
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

/// Of the reference's poses; the run's own clock is the last parameter, where it has one.
RunLikelihood stream_of(const Likelihood& likelihood, const Run& run, const Robot& noisy) {
  const std::vector<Parameter>& parameters = likelihood.problem.parameters;
  return stream_likelihood(run, noisy, likelihood.seeks_clock(run) ? with_clock(parameters) : parameters,
                           {.reference_noise = likelihood.noise.levels.reference,
                            .blocks = likelihood.blocks_of_a_run(),
                            .gyro_noise_rad_s_sqrt_hz = own_gyro_noise(likelihood.problem),
                            .gate = likelihood.gate});
}

RunInformation information_of(const Likelihood& likelihood, const Run& run, std::size_t index,
                              const Robot& robot) {
  const CalibrationProblem& problem = likelihood.problem;
  const Robot noisy = noisy_robot(robot, likelihood);
  const int blocks = likelihood.blocks_of_a_run();
  const std::optional<double> gyro_noise = own_gyro_noise(problem);
  RunInformation result;
  RunLikelihood stream = stream_of(likelihood, run, noisy);
  append(result.blocks,
         likelihood.seeks_clock(run) ? without_clock(stream.blocks, run.clock_moved_s) : stream.blocks);
  append(result.blocks, partial_likelihood(run, noisy, problem.parameters, gyro_noise).blocks);
  append(result.blocks, chassis_likelihood(run, noisy, problem.parameters,
                                           {.blocks = blocks,
                                            .variance_factor = likelihood.redundancy_factor,
                                            .gate = likelihood.gate,
                                            .sums = likelihood.sums_of(index)}));
  if (!run.relative_motions.empty())
    append(result.blocks, relative_information_of(likelihood, run, index, noisy));
  result.outliers = std::move(stream.outliers);
  return result;
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
      .relative_table = relative_tables(problem),
      .window_sums = {},
      .clocked = {}};
  if (contains(problem.parameters, ParameterKind::gyro_time_offset))
    likelihood.clocked.assign(problem.runs.begin(), problem.runs.end());
  else
    for (const Run& run : problem.runs)
      likelihood.window_sums.push_back(
          window_sums(run, problem.nominal.chassis, ChassisLikelihoodOptions{}.window_s));
  return likelihood;
}

void set_clocks(const Robot& robot, Likelihood& likelihood) {
  for (Run& run : likelihood.clocked) set_gyro_clock(robot, run);
  const Robot noisy = noisy_robot(robot, likelihood);
  for (std::size_t i = 0; i < likelihood.problem.runs.size(); ++i) {
    const Run& run = likelihood.runs()[i];
    if (!likelihood.seeks_clock(run)) continue;
    const ClockStep step = clock_step(stream_of(likelihood, run, noisy).total(), run.clock_moved_s);
    move_clock(step, robot, likelihood.problem.runs[i]);
    if (!likelihood.clocked.empty()) move_clock(step, robot, likelihood.clocked[i]);
  }
}

Robot noisy_robot(const Robot& robot, const Likelihood& likelihood) {
  return with_noise_of_readings(without_rounding(with_noise(robot, likelihood.noise.levels)),
                                likelihood.problem.nominal.chassis);
}

Information RunInformation::total(Eigen::Index parameters) const {
  Information sum = Information::zero(parameters);
  for (const Information& block : blocks) sum.add(block);
  return sum;
}

RunInformation run_information(const Likelihood& likelihood, std::size_t index, const Robot& robot) {
  if (likelihood.clocked.empty()) return information_of(likelihood, likelihood.runs()[index], index, robot);
  Run run = likelihood.runs()[index];
  set_gyro_clock(robot, run);
  return information_of(likelihood, run, index, robot);
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
