#include "trundle/calibration/validation/cross_validation.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include <fmt/format.h>

#include "trundle/calibration/problem/run_gyro_bias.hpp"
#include "trundle/calibration/validation/held_out.hpp"
#include "trundle/calibration/validation/influence.hpp"
#include "trundle/statistics/random.hpp"

namespace trundle::calibration {
namespace {

// Of an error: what a user would notice.
constexpr double kWorse = 1.1;
// Of tests whether something is more than chance: once in a hundred calibrations it is chance.
constexpr double kLevel = 0.01;
// Of a half of a run, to learn from it.
constexpr std::size_t kFewestEpochs = 10;

/// The run from one of its epochs to another.
Run part_of(const Run& run, std::size_t first_epoch, std::size_t last_epoch) {
  const std::size_t from = run.epochs[first_epoch];
  const std::size_t to = run.epochs[last_epoch];
  const auto cut = [](auto& values, std::size_t first, std::size_t last) {
    values.erase(values.begin() + static_cast<std::ptrdiff_t>(last), values.end());
    values.erase(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(first));
  };
  Run part = run;
  part.partial = {};  // of the whole run
  part.relative_motions.clear();
  part.readings.start_s = run.epoch_time(first_epoch);
  part.readings.increments.cut(from, to);
  cut(part.readings.bridged, from, to);
  cut(part.epochs, first_epoch, last_epoch + 1);
  if (first_epoch > 0) part.start_heading_rad.reset();
  for (std::size_t& epoch : part.epochs) epoch -= from;
  std::erase_if(part.jumps, [&](std::size_t jump) { return jump <= first_epoch || jump > last_epoch; });
  for (std::size_t& jump : part.jumps) jump -= first_epoch;
  return part;
}

Robot robot_with(const Robot& robot, std::span<const Parameter> parameters, const Eigen::VectorXd& values) {
  Robot changed = robot;
  for (std::size_t j = 0; j < parameters.size(); ++j)
    set_value(parameters[j], values[static_cast<Eigen::Index>(j)], changed);
  return changed;
}

/// What judges parameters: runs, or the halves of a single one, each by what the others say.
class JudgedParts {
 public:
  /// Nothing where there are no two, or none of the parameters is observable in them.
  static std::optional<JudgedParts> of(const CalibrationProblem& problem, const Estimate& estimate) {
    JudgedParts judged(problem, estimate.noise.levels);
    if (judged.parts_.size() < 2) return std::nullopt;
    const CalibrationProblem of_parts{judged.parts_, problem.nominal, problem.parameters,
                                      judged.shares_gyro_bias()};
    judged.influence_ = influence_of(judged.of_halves() ? estimate_parameters(of_parts) : estimate,
                                     problem.nominal, problem.parameters);
    if (judged.influence_.without.empty()) return std::nullopt;
    return judged;
  }

  JudgedParts(JudgedParts&&) = default;

  [[nodiscard]] const Influence& influence() const { return influence_; }

  /// By the values that each of them is given. Nothing where fewer than two show positions.
  [[nodiscard]] std::optional<CrossValidation> validate(std::span<const Eigen::VectorXd> values) const {
    CrossValidation validation{.of_halves = of_halves()};
    HeldOutErrors sum;
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      const Run& part = parts_[i];
      const Robot calibrated =
          with_noise(robot_with(problem_.nominal, problem_.parameters, values[i]), levels_);
      const auto errors = held_out_errors(as_recorded(part), problem_.nominal, calibrated, levels_.reference,
                                          !shares_gyro_bias() && part.shows_gyro_bias());
      if (!errors) continue;
      sum.add(*errors);
      ++validation.parts;
    }
    if (validation.parts < 2) return std::nullopt;
    const auto n = static_cast<double>(validation.parts);
    validation.given_m = std::sqrt(sum.given_m2 / n);
    validation.calibrated_m = std::sqrt(sum.calibrated_m2 / n);
    if (sum.pull_variance_m4 > 0.0) validation.pull_sigma = sum.pull_m2 / std::sqrt(sum.pull_variance_m4);
    return validation;
  }

 private:
  JudgedParts(const CalibrationProblem& problem, const NoiseLevels& levels)
      : problem_(problem),
        levels_(levels),
        halves_(of_halves() ? halves_of(problem.runs.front()) : std::vector<Run>{}),
        parts_(of_halves() ? std::span(halves_) : problem.runs) {}

  bool of_halves() const { return problem_.runs.size() == 1; }
  bool shares_gyro_bias() const { return of_halves() || problem_.share_gyro_bias; }

  const CalibrationProblem& problem_;
  NoiseLevels levels_;
  std::vector<Run> halves_;
  std::span<Run> parts_;  // of the halves where they stand, too, once they have been moved
  Influence influence_;
};

std::size_t index_of(const Parameter& parameter, std::span<const Parameter> all) {
  return static_cast<std::size_t>(std::ranges::find(all, parameter) - all.begin());
}

std::vector<Eigen::Index> indices_of(std::span<const Parameter> some, std::span<const Parameter> all) {
  std::vector<Eigen::Index> indices;
  for (const Parameter& parameter : some)
    indices.push_back(static_cast<Eigen::Index>(index_of(parameter, all)));
  return indices;
}

/// Those that may be refused for runs that came out worse: all, where that is more than chance; else those of
/// which the runs themselves do not say, by more than chance, that they are not as given.
std::vector<Parameter> refusable(const ValidatedEstimate& found, const Robot& nominal) {
  if (found.validation->is_refuted()) return found.parameters;
  const Eigen::VectorXd variance =
      found.estimate.covariance.diagonal() + found.estimate.held_covariance.diagonal();
  std::vector<Parameter> doubtful;
  for (std::size_t j = 0; j < found.parameters.size(); ++j) {
    const double change =
        value_of(found.parameters[j], found.estimate.robot) - value_of(found.parameters[j], nominal);
    const double sigma = std::sqrt(variance[static_cast<Eigen::Index>(j)]);
    if (std::abs(change) <= normal_quantile(1.0 - kLevel / 2.0) * sigma)
      doubtful.push_back(found.parameters[j]);
  }
  return doubtful;
}

/// The estimate with one parameter less.
ValidatedEstimate without(const Parameter& left_out, const ValidatedEstimate& found,
                          const CalibrationProblem& problem) {
  CalibrationProblem fewer = problem;
  fewer.parameters = found.parameters;
  std::erase(fewer.parameters, left_out);
  ValidatedEstimate result{.estimate = {},
                           .parameters = fewer.parameters,
                           .refused = found.refused,
                           .validation = CrossValidation{},
                           .before = found.before};
  result.refused.parameters.push_back(left_out);
  if (fewer.parameters.empty()) return result;
  result.estimate = estimate_parameters(fewer);
  result.validation = cross_validate(fewer, result.estimate);
  return result;
}

/// That without which runs that are left out come out best, by one Gauss–Newton step; the others are then
/// estimated anew.
ValidatedEstimate best_without_one(std::span<const Parameter> candidates, const ValidatedEstimate& found,
                                   const CalibrationProblem& problem) {
  CalibrationProblem of_found = problem;
  of_found.parameters = found.parameters;
  const auto judged = JudgedParts::of(of_found, found.estimate);
  std::vector<double> error_m(candidates.size(), INFINITY);
  for (std::size_t i = 0; judged && i < candidates.size(); ++i) {
    const std::size_t j = index_of(candidates[i], found.parameters);
    const auto validation =
        judged->validate(without_holding(j, value_of(candidates[i], problem.nominal), judged->influence()));
    if (validation) error_m[i] = validation->calibrated_m;
  }
  const auto best = std::ranges::min_element(error_m) - error_m.begin();
  return without(candidates[static_cast<std::size_t>(best)], found, problem);
}

/// What the errors of refused parameters, which stay as given, add to the covariance of the others. `error`:
/// of the robot as given, of all that the problem sought.
void count_refused(const CalibrationProblem& problem, const Eigen::MatrixXd& error,
                   ValidatedEstimate& found) {
  CalibrationProblem held = problem;
  held.parameters = found.parameters;
  const std::vector<Parameter> refused = found.refused.parameters;
  const std::vector<Eigen::Index> rows = indices_of(refused, problem.parameters);
  const Eigen::MatrixXd D = taken_along(refused, held, found.estimate);
  found.refused = given_beside(refused, error(rows, rows), D, found.estimate);
}

}  // namespace

std::vector<Run> halves_of(const Run& run) {
  const std::size_t middle = run.epochs.size() / 2;
  if (middle < kFewestEpochs) return {};
  return {part_of(run, 0, middle), part_of(run, middle, run.epochs.size() - 1)};
}

bool CrossValidation::is_worse() const {
  return calibrated_m > kWorse * given_m;
}

bool CrossValidation::is_refuted() const {
  return pull_sigma > normal_quantile(1.0 - kLevel);
}

std::string CrossValidation::words() const {
  return fmt::format("{} by the other{}: position error {:.4f} m, {:.4f} m with the robot as given",
                     of_halves ? "each half of the run" : "each run", of_halves ? "" : "s", calibrated_m,
                     given_m);
}

std::optional<CrossValidation> cross_validate(const CalibrationProblem& problem, const Estimate& estimate) {
  const auto judged = JudgedParts::of(problem, estimate);
  return judged ? judged->validate(judged->influence().without) : std::nullopt;
}

ValidatedEstimate estimate_what_holds(const CalibrationProblem& problem) {
  ValidatedEstimate best{.estimate = estimate_parameters(problem),
                         .parameters = problem.parameters,
                         .refused = {},
                         .validation = {},
                         .before = {}};
  if (best.estimate.space.basis.cols() == 0) return best;
  best.validation = cross_validate(problem, best.estimate);
  best.before = best.validation;
  const Eigen::MatrixXd error = error_as_given(problem, best.estimate);
  std::optional<ValidatedEstimate> not_refuted;
  while (best.validation && best.validation->is_worse() && !best.parameters.empty()) {
    if (!not_refuted && !best.validation->is_refuted()) not_refuted = best;
    const std::vector<Parameter> candidates = refusable(best, problem.nominal);
    if (candidates.empty()) {  // and what was refused for no more than a doubt was not what made them worse
      best = std::move(*not_refuted);
      break;
    }
    best = best_without_one(candidates, best, problem);
  }
  if (best.refused.parameters.empty())
    best.before.reset();
  else if (!best.parameters.empty())
    count_refused(problem, error, best);
  return best;
}

}  // namespace trundle::calibration
