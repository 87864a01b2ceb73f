#include "trundle/calibration/validation/conclusion.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "trundle/calibration/validation/run_result.hpp"
#include "trundle/geometry/angle.hpp"
#include "trundle/io/error.hpp"
#include "trundle/io/words.hpp"

namespace trundle::calibration {
namespace {

// Below it more than half of what a run says is left out: a person should know.
constexpr double kOutlyingWeight = 0.5;

/// Indices of the parameters that are estimated, alone or in combination.
std::vector<Eigen::Index> estimated_of(const Estimate& estimate) {
  std::vector<Eigen::Index> indices;
  for (Eigen::Index j = 0; j < estimate.space.scale.size(); ++j)
    if (estimate.space.estimates(static_cast<int>(j))) indices.push_back(j);
  return indices;
}

/// Of the gyro's bias [rad²/s²].
double between_runs(const Estimate& estimate) {
  return estimate.gyro_bias_spread.found_rad_s * estimate.gyro_bias_spread.found_rad_s;
}

/// The covariance of what a further session's parameters will be: noise of the estimate, what is held, spread
/// of sessions about their mean, and the uncertainty of that mean.
Eigen::MatrixXd total_covariance(const Estimate& estimate, const SessionSpread& spread,
                                 std::span<const Parameter> parameters) {
  const Eigen::MatrixXd one_session = estimate.covariance + estimate.held_covariance;
  Eigen::MatrixXd total = one_session;
  if (spread.covariance.size() > 0) total += spread.of_a_further_session();
  for (std::size_t j = 0; j < parameters.size(); ++j) {
    const auto k = static_cast<Eigen::Index>(j);
    if (parameters[j] == kGyroBias && estimate.space.estimates(static_cast<int>(j)))
      total(k, k) = std::max(total(k, k), one_session(k, k) + between_runs(estimate));
  }
  return total;
}

/// From session to session, or from run to run where that is more; nothing: not known.
std::optional<double> spread_of(const Parameter& parameter, Eigen::Index k, const Estimate& estimate,
                                const SessionSpread& spread) {
  std::optional<double> variance;
  if (spread.covariance.size() > 0) variance = spread.covariance(k, k);
  if (parameter == kGyroBias && between_runs(estimate) > 0.0)
    variance = std::max(variance.value_or(0.0), between_runs(estimate));
  return variance ? std::optional(std::sqrt(*variance)) : std::nullopt;
}

std::vector<ParameterEstimate> parameter_estimates(const Estimate& estimate, const SessionSpread& spread,
                                                   std::span<const Parameter> parameters,
                                                   const Robot& nominal, const Robot& calibrated) {
  const Eigen::MatrixXd total = total_covariance(estimate, spread, parameters);
  std::vector<ParameterEstimate> result;
  for (std::size_t j = 0; j < parameters.size(); ++j) {
    const auto k = static_cast<Eigen::Index>(j);
    ParameterEstimate e;
    e.parameter = parameters[j];
    e.name = name_of(parameters[j], nominal);
    e.unit = unit_of(parameters[j]);
    e.nominal = value_of(parameters[j], nominal);
    e.value = value_of(parameters[j], calibrated);
    e.sigma_data = estimate.space.sigma_data[k] * std::sqrt(estimate.dispersion);
    e.sigma_prior = estimate.space.scale[k];
    e.observable = estimate.space.estimates(static_cast<int>(j));
    e.sigma_within = std::sqrt(std::max(estimate.covariance(k, k), 0.0));
    if (e.observable) e.sigma_between = spread_of(parameters[j], k, estimate, spread);
    if (e.observable) e.sigma_total = std::sqrt(std::max(total(k, k), 0.0));
    result.push_back(std::move(e));
  }
  return result;
}

/// `covariance`: of all parameters, estimated or not.
CalibrationRecord record_of(const CalibrationResult& result, Eigen::MatrixXd covariance,
                            const Estimate& estimate) {
  CalibrationRecord record;
  for (const ParameterEstimate& e : result.parameters)
    record.parameters.push_back(
        {e.name, e.unit, e.value, e.nominal, e.sigma_within, e.sigma_between, e.observable});
  record.covariance = std::move(covariance);
  if (estimate.noise.from_runs)
    record.provenance.push_back(
        fmt::format("noise.wheel_per_sqrt_m {:.3g} measured against the references of the runs",
                    estimate.noise.levels.wheel_per_sqrt_m));
  return record;
}

std::string remark_of(const RunEvidence& evidence) {
  std::vector<std::string> remarks;
  if (evidence.weight < kOutlyingWeight)
    remarks.push_back(
        fmt::format("outlying run: pulls the parameters {:.1f} times as hard as noise would, counts {:.0f} %",
                    std::sqrt(evidence.chi2_per_dof), 100.0 * evidence.weight));
  const auto jump = std::ranges::find(evidence.outliers, true, &OutlyingEpoch::jump);
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
        run_result(training[i], result.nominal, result.calibrated, estimate.noise.levels.reference,
                   {.hold_out = false,
                    .gyro_bias = i < estimate.gyro_biases.size() ? estimate.gyro_biases[i] : std::nullopt});
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
    result.runs.push_back(run_result(run, result.nominal, result.calibrated, estimate.noise.levels.reference,
                                     {.hold_out = true}));
}

/// References that are worse than the robot's own odometry spoil what is learned from them.
void warn_if_worse(const ErrorBeforeAfter& error, CalibrationResult& result) {
  constexpr double kWorse = 1.1;  // as large may be chance: an rms of 50 epochs is known to 10 %
  if (error.after > kWorse * error.before)
    result.warnings.push_back(
        fmt::format("{}: {:.3g} {} with the calibrated robot, {:.3g} {} with the one given; do not use it "
                    "before you know why (references too coarse? runs of another floor?)",
                    error.what, error.after, error.unit, error.before, error.unit));
}

void add_errors(CalibrationResult& result) {
  auto& errors = result.calibrated.calibration->errors;
  for (const bool hold_out : {false, true}) {
    const std::vector<ErrorBeforeAfter> of_set = errors_of(result.runs, hold_out);  // rms, worst
    if (!of_set.empty()) warn_if_worse(of_set.front(), result);
    errors.insert(errors.end(), of_set.begin(), of_set.end());
    if (hold_out && of_set.empty() && std::ranges::any_of(result.runs, &RunResult::hold_out))
      result.notes.emplace_back(
          "no error of the runs that were held out: it takes a reference with x, y and heading");
  }
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
    result.warnings.push_back(spread.sessions < 2 ? "± covers one session; variation between sessions unknown"
                                                  : "± covers one session; variation between sessions "
                                                    "unknown: fewer than two of them determine all "
                                                    "parameters");
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
      found.push_back(fmt::format("{} {}{}{} (was {:.6g})", e.name, with_sigma(e.value, e.sigma_total),
                                  e.unit == "1" ? "" : " ", e.unit == "1" ? "" : e.unit, e.nominal));
  return fmt::format("{}{}", fmt::join(found, ", "),
                     result.unobservable.empty() ? "" : "; not everything is observable in these runs");
}

/// What runs said before the search may no longer hold where it ended: then nothing is known of anything. Of
/// runs so short that all residuals vanish the scatter says nothing either.
void require_determined(std::span<const ParameterEstimate> parameters) {
  constexpr double kWorse = 3.0;  // than the prior: by more than the scatter of the runs alone makes it
  for (const ParameterEstimate& e : parameters) {
    const bool has_sigma = std::isfinite(e.sigma_within) && e.sigma_within > 0.0;
    if (!e.observable || (has_sigma && e.sigma_within < kWorse * e.sigma_prior)) continue;
    const std::string unit = e.unit == "1" ? "" : e.unit;
    const std::string found =
        has_sigma ? fmt::format("{:.4g} ± {:.2g} {}, worse than it is known", e.value, e.sigma_within, unit)
                  : fmt::format("{:.4g} {}, of which nothing is sure, where it is known", e.value, unit);
    throw CannotAnswer(fmt::format(
        "{} would be {} without these runs (± {:.2g}): they do not determine it; measure more closely, "
        "or drive more",
        e.name, found, e.sigma_prior));
  }
}

/// A search that still moves by more than its own sigmas has found nothing that they are the sigmas of.
void require_settled(const Descent& descent, std::span<const Parameter> parameters, const Robot& nominal) {
  if (descent.converged || descent.last_step <= 1.0) return;
  const std::string step = std::isfinite(descent.last_step)
                               ? fmt::format("it still moves by {:.2g} σ", descent.last_step)
                               : "it has left all numbers";
  throw CannotAnswer(fmt::format(
      "the search does not settle: after {} steps {}, in {}; these runs do not fit the robot file: check "
      "units, clocks and columns, or --fix it",
      descent.iterations, step, name_of(parameters[static_cast<std::size_t>(descent.parameter)], nominal)));
}

/// A direction that the search has led around whole turns, near where it was given.
void unwind(std::span<const Parameter> parameters, const Robot& nominal, Robot& robot) {
  for (const Parameter& parameter : parameters) {
    if (parameter.kind != ParameterKind::direction) continue;
    const double given = value_of(parameter, nominal), found = value_of(parameter, robot);
    if (std::abs(found - given) > kPi) set_value(parameter, given + wrap_angle(found - given), robot);
  }
}

}  // namespace

void require_something_free(std::span<const Parameter> parameters, std::span<const Recording> training,
                            const Robot& nominal) {
  if (!parameters.empty()) return;
  const auto has_gyro = [](const Recording& recording) { return !recording.gyro.time_s.empty(); };
  if (!nominal.chassis.gyro && std::ranges::any_of(training, has_gyro))
    throw CannotAnswer(
        "no parameter is free: nothing was measured from outside, and the robot file has no [gyro] although "
        "the recording has one: write [gyro] to calibrate with it");
  throw CannotAnswer("no parameter is free: these recordings measure nothing to calibrate with");
}

void require_something_estimated(const Estimate& estimate, std::span<const Parameter> parameters,
                                 const Robot& nominal) {
  if (estimate.space.basis.cols() > 0) return;
  std::vector<HeldWords> reasons;  // each advice once
  for (const HeldCombination& held : estimate.space.held) {
    HeldWords reason = reason_for(held, parameters, nominal, estimate.measures_length);
    const auto same = std::ranges::find(reasons, reason.advice, &HeldWords::advice);
    if (same == reasons.end())
      reasons.push_back(std::move(reason));
    else if (same->names != reason.names)
      same->names += ", " + reason.names;
  }
  std::vector<std::string> words;
  for (const auto& [names, advice] : reasons) words.push_back(names + ": " + advice);
  throw CannotAnswer(fmt::format("nothing can be estimated from these runs: {}", fmt::join(words, "; ")));
}

CalibrationResult result_of(const Estimate& estimate, const SessionSpread& spread,
                            std::span<const Parameter> parameters, const Robot& nominal) {
  require_settled(estimate.descent, parameters, nominal);
  CalibrationResult result;
  result.status =
      estimate.space.held.empty() ? CalibrationStatus::all_estimated : CalibrationStatus::some_held;
  result.nominal = nominal;
  result.calibrated = estimate.robot;
  unwind(parameters, nominal, result.calibrated);
  if (estimate.noise.from_runs && nominal.chassis.wheel_count > 0)
    set_typical_wheel_noise(estimate.noise.levels.wheel_per_sqrt_m, result.calibrated.chassis);
  else if (estimate.noise.from_runs)
    result.calibrated.chassis.noise = with_noise(estimate.robot, estimate.noise.levels).chassis.noise;
  result.parameters = parameter_estimates(estimate, spread, parameters, nominal, result.calibrated);
  require_determined(result.parameters);
  const std::vector<Eigen::Index> estimated = estimated_of(estimate);
  result.covariance_within = estimate.covariance(estimated, estimated);
  Eigen::MatrixXd total = total_covariance(estimate, spread, parameters);
  result.covariance_total = total(estimated, estimated);
  result.directions = estimate.space.directions;
  for (const HeldCombination& held : estimate.space.held) {
    std::string words = words_for(held, parameters, nominal, estimate.measures_length);
    if (std::ranges::find(result.unobservable, words) == result.unobservable.end())
      result.unobservable.push_back(std::move(words));
  }
  if (const Descent& descent = estimate.descent; !descent.converged)
    result.warnings.push_back(fmt::format(
        "optimizer stopped after {} iterations: largest last step {:.2g} σ, in {}", descent.iterations,
        descent.last_step, name_of(parameters[static_cast<std::size_t>(descent.parameter)], nominal)));
  result.calibrated.calibration = record_of(result, std::move(total), estimate);
  return result;
}

void record(const GivenParameters& given, CalibrationResult& result) {
  CalibrationRecord& record = *result.calibrated.calibration;
  for (const Parameter& parameter : given.parameters)
    record.parameters.push_back({.name = name_of(parameter, result.nominal),
                                 .unit = std::string(unit_of(parameter)),
                                 .value = value_of(parameter, result.calibrated),
                                 .nominal = value_of(parameter, result.nominal)});
  const Eigen::MatrixXd &estimated = record.covariance, &cross = given.cross_covariance;
  Eigen::MatrixXd all(estimated.rows() + cross.cols(), estimated.cols() + cross.cols());
  all << estimated, cross, cross.transpose(), given.covariance;
  record.covariance = std::move(all);
}

void note(const std::string& words, CalibrationResult& result) {
  result.notes.push_back(words);
  result.calibrated.calibration->provenance.push_back(words);
}

void conclude(const ConcludedRuns& runs, const Estimate& estimate, const SessionSpread& spread,
              CalibrationResult& result) {
  add_runs(runs.training, runs.hold_out, estimate, result);
  add_errors(result);
  add_session_words(spread, result);
  result.summary = summary_of(result);
}

}  // namespace trundle::calibration
