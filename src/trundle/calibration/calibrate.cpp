#include "trundle/calibration/calibrate.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "trundle/calibration/defaults.hpp"
#include "trundle/calibration/influence.hpp"
#include "trundle/calibration/learn_noise.hpp"
#include "trundle/calibration/run_result.hpp"
#include "trundle/calibration/sessions.hpp"
#include "trundle/calibration/wiring.hpp"
#include "trundle/io/error.hpp"
#include "trundle/recording/time_offset.hpp"

namespace trundle {
namespace {

constexpr double kOutlyingWeight = 0.5;
constexpr double kSmallOffset_s = 0.005;  // of the gyro's clock: does no harm

/// What the logs say of the gyro's clock.
struct ClockOffset {
  double offset_s = 0.0;
  double sigma_s = 0.0;
  int recordings = 0;
};

std::optional<ClockOffset> clock_offset(std::span<const Recording> recordings, const Robot& robot) {
  double weights = 0.0;
  double sum = 0.0;
  ClockOffset clock;
  for (const Recording& recording : recordings) {
    const auto offset = gyro_time_offset(recording, robot);
    if (!offset) continue;
    const double weight = 1.0 / (offset->sigma_s * offset->sigma_s);
    weights += weight;
    sum += weight * offset->offset_s;
    ++clock.recordings;
  }
  if (clock.recordings == 0) return std::nullopt;
  clock.offset_s = sum / weights;
  clock.sigma_s = 1.0 / std::sqrt(weights);
  return clock;
}

/// Sets the gyro's clock by the logs, where they show it wrong. Returns what was done, in words.
std::string set_clock(std::span<const Recording> recordings, Robot& robot) {
  const auto clock = clock_offset(recordings, robot);
  if (!clock) return {};
  double& time_offset_s = robot.chassis.gyro->time_offset_s;
  const double given_s = time_offset_s;
  if (std::abs(clock->offset_s - given_s) < std::max(kSmallOffset_s, 3.0 * clock->sigma_s)) return {};
  time_offset_s = clock->offset_s;
  return fmt::format(
      "gyro.time_offset_s {:.4f} ± {:.4f} s (was {:.4f}), from the turns of gyro and wheels in {} "
      "recording{}",
      clock->offset_s, clock->sigma_s, given_s, clock->recordings, clock->recordings == 1 ? "" : "s");
}

std::vector<Run> prepare_runs(std::span<const Recording> recordings, const Robot& robot) {
  std::vector<Run> runs;
  for (const Recording& recording : recordings) runs.push_back(prepare_run(recording, robot));
  return runs;
}

/// Indices of the parameters that are estimated, alone or in combination.
std::vector<Eigen::Index> estimated_of(const Estimate& estimate) {
  std::vector<Eigen::Index> indices;
  for (Eigen::Index j = 0; j < estimate.space.scale.size(); ++j)
    if (estimate.space.estimates(static_cast<int>(j))) indices.push_back(j);
  return indices;
}

void refuse_nothing_estimated(const Estimate& estimate, std::span<const Parameter> parameters,
                              const Robot& nominal) {
  std::string reasons;
  for (const HeldCombination& held : estimate.space.held)
    reasons += (reasons.empty() ? "" : "; ") + words_for(held, parameters, nominal);
  throw CannotAnswer("nothing can be estimated from these runs: " + reasons);
}

std::vector<ParameterEstimate> parameter_estimates(const Estimate& estimate, const SessionSpread& spread,
                                                   std::span<const Parameter> parameters,
                                                   const Robot& nominal) {
  std::vector<ParameterEstimate> result;
  for (std::size_t j = 0; j < parameters.size(); ++j) {
    const auto k = static_cast<Eigen::Index>(j);
    ParameterEstimate e;
    e.parameter = parameters[j];
    e.name = name_of(parameters[j], nominal);
    e.unit = unit_of(parameters[j]);
    e.nominal = value_of(parameters[j], nominal);
    e.value = value_of(parameters[j], estimate.robot);
    e.sigma_data = estimate.space.sigma_data[k] * std::sqrt(estimate.dispersion);
    e.sigma_prior = estimate.space.scale[k];
    e.observable = estimate.space.estimates(static_cast<int>(j));
    e.sigma_within = std::sqrt(std::max(estimate.covariance(k, k), 0.0));
    if (e.observable && spread.covariance.size() > 0) e.sigma_between = std::sqrt(spread.covariance(k, k));
    result.push_back(std::move(e));
  }
  return result;
}

/// The covariance of what a further session's parameters will be: noise of the estimate, spread of sessions
/// about their mean, and the uncertainty of that mean.
Eigen::MatrixXd total_covariance(const Estimate& estimate, const SessionSpread& spread) {
  if (spread.covariance.size() == 0) return estimate.covariance;
  return estimate.covariance + spread.covariance * (1.0 + 1.0 / spread.calibrated);
}

CalibrationRecord record_of(const CalibrationResult& result, const Estimate& estimate) {
  CalibrationRecord record;
  for (const ParameterEstimate& e : result.parameters)
    record.parameters.push_back(
        {e.name, e.unit, e.value, e.nominal, e.sigma_within, e.sigma_between, e.observable});
  record.covariance = result.covariance_total;
  if (estimate.noise.from_runs)
    record.provenance.push_back(
        fmt::format("noise.wheel_per_sqrt_m {:.3g} measured from the growth of heading errors along the runs",
                    estimate.noise.wheel_per_sqrt_m));
  return record;
}

std::string remark_of(const RunEvidence& evidence) {
  std::vector<std::string> remarks;
  if (evidence.weight < kOutlyingWeight)
    remarks.push_back(
        fmt::format("outlying run: pulls the parameters {:.1f} times as hard as noise would, counts {:.0f} %",
                    std::sqrt(evidence.chi2_per_dof), 100.0 * evidence.weight));
  const auto jump = std::ranges::find(evidence.outliers, true, &OutlyingKnot::jump);
  if (jump != evidence.outliers.end())
    remarks.push_back(fmt::format("the reference jumps at {:.2f} s", jump->time_s));
  if (!evidence.outliers.empty())
    remarks.push_back(fmt::format("reference left out at {} places, first at {:.2f} s",
                                  evidence.outliers.size(), evidence.outliers.front().time_s));
  return fmt::format("{}", fmt::join(remarks, "; "));
}

void add_runs(std::span<const Run> training, std::span<const Run> hold_out, const Estimate& estimate,
              CalibrationResult& result) {
  for (std::size_t i = 0; i < training.size(); ++i) {
    RunResult run =
        run_result(training[i], result.nominal, result.calibrated, estimate.noise.reference, false);
    run.weight = estimate.runs[i].weight;
    run.chi2_per_dof = estimate.runs[i].chi2_per_dof;
    const std::string remark = remark_of(estimate.runs[i]);
    if (!remark.empty()) {
      run.remark = run.remark.empty() ? remark : run.remark + "; " + remark;
      if (run.weight < kOutlyingWeight)
        result.warnings.push_back(fmt::format("run {}: {}", run.name, remark));
    }
    result.runs.push_back(std::move(run));
  }
  for (const Run& run : hold_out)
    result.runs.push_back(run_result(run, result.nominal, result.calibrated, estimate.noise.reference, true));
}

void add_errors(CalibrationResult& result) {
  auto& errors = result.calibrated.calibration->errors;
  for (const bool hold_out : {false, true})
    for (ErrorBeforeAfter& error : errors_of(result.runs, hold_out)) errors.push_back(std::move(error));
  if (const auto e_max = maximum_error_of(result.runs)) {
    result.e_max_before_m = e_max->before_m;
    result.e_max_after_m = e_max->after_m;
    result.after_meaning = "reprocessed";
    errors.push_back({"E_max,syst (reprocessed)", e_max->before_m, e_max->after_m, "m"});
  }
}

void add_session_words(const SessionSpread& spread, CalibrationResult& result) {
  result.sessions = spread.sessions;
  if (spread.covariance.size() == 0) {
    result.warnings.push_back(
        spread.sessions < 2
            ? "spread between sessions unknown: one session only"
            : "spread between sessions unknown: fewer than two sessions can tell all parameters");
    return;
  }
  if (spread.trials > 0)
    result.notes.push_back(
        fmt::format("each session predicted from the others: {} of {} parameters inside their 95 % intervals",
                    spread.hits, spread.trials));
}

std::string summary_of(const CalibrationResult& result) {
  std::vector<std::string> found;
  for (const ParameterEstimate& e : result.parameters)
    if (e.observable)
      found.push_back(
          fmt::format("{} {:.6g} {} (was {:.6g})", e.name, e.value, e.unit == "1" ? "" : e.unit, e.nominal));
  return fmt::format("{}{}", fmt::join(found, ", "),
                     result.cannot_tell.empty() ? "" : "; some parameters cannot be told from these runs");
}

}  // namespace

CalibrationResult calibrate(std::span<const Recording> training, std::span<const Recording> hold_out,
                            const Robot& given, const CalibrateOptions& options) {
  const Wiring wiring = check_wiring(training, given);
  const Robot& nominal = wiring.robot;
  Robot start = nominal;
  const std::string clock = set_clock(training, start);
  std::vector<Run> runs = prepare_runs(training, start);
  const std::vector<Parameter> parameters = choose_parameters(nominal, runs, options.free, options.fix);
  if (parameters.empty())
    throw CannotAnswer("no parameter is free: these recordings measure nothing to calibrate with");
  const Estimate estimate = estimate_parameters(runs, start, parameters);
  if (estimate.space.basis.cols() == 0) refuse_nothing_estimated(estimate, parameters, nominal);
  const SessionSpread spread = session_spread(runs, start, parameters, estimate.space);

  CalibrationResult result;
  result.method = "ml";
  for (const std::string& fault : wiring.faults)
    result.warnings.push_back(fault + "; corrected before calibrating, check the robot");
  result.cannot_tell = wiring.untold;
  result.status =
      estimate.space.held.empty() ? CalibrationStatus::all_estimated : CalibrationStatus::some_held;
  result.nominal = nominal;
  result.calibrated = estimate.robot;
  if (start.chassis.gyro) start.chassis.gyro->time_offset_s = estimate.robot.chassis.gyro->time_offset_s;
  for (Run& run : runs) set_gyro_clock(start, run);
  if (estimate.noise.from_runs)
    set_typical_wheel_noise(estimate.noise.wheel_per_sqrt_m, result.calibrated.chassis);
  result.parameters = parameter_estimates(estimate, spread, parameters, nominal);
  const std::vector<Eigen::Index> estimated = estimated_of(estimate);
  result.covariance_within = estimate.covariance(estimated, estimated);
  result.covariance_total = total_covariance(estimate, spread)(estimated, estimated);
  result.directions = estimate.space.directions;
  for (const HeldCombination& held : estimate.space.held) {
    std::string words = words_for(held, parameters, nominal);
    if (std::ranges::find(result.cannot_tell, words) == result.cannot_tell.end())
      result.cannot_tell.push_back(std::move(words));
  }
  if (!estimate.converged) result.warnings.push_back("the fit did not converge: treat the numbers with care");
  result.calibrated.calibration = record_of(result, estimate);
  if (options.learn_noise) {
    const LearnedNoise learned = learn_noise(runs, result.calibrated);
    result.calibrated = with_learned_noise(result.calibrated, learned);
    std::erase_if(result.calibrated.calibration->provenance,
                  [](const std::string& line) { return line.starts_with("noise."); });
    result.calibrated.calibration->provenance.push_back(learned.how);
    result.notes.push_back(learned.how);
  }
  if (!clock.empty()) {
    result.notes.push_back(clock);
    result.calibrated.calibration->provenance.push_back(clock);
  }
  add_runs(runs, prepare_runs(hold_out, start), estimate, result);
  const Influence influence = influence_of(estimate, nominal, parameters);
  result.without_run = influence.without;
  result.after_run = influence.after;
  result.sigma_after_run = influence.sigma_after;
  add_errors(result);
  add_session_words(spread, result);
  result.summary = summary_of(result);
  return result;
}

}  // namespace trundle
