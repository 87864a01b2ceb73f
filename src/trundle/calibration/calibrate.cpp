#include "trundle/calibration/calibrate.hpp"

#include <algorithm>
#include <array>
#include <iterator>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "trundle/calibration/noise/learn_noise.hpp"
#include "trundle/calibration/preparation/preparation.hpp"
#include "trundle/calibration/preparation/sensor_heading.hpp"
#include "trundle/calibration/preparation/velocity_lag.hpp"
#include "trundle/calibration/problem/defaults.hpp"
#include "trundle/calibration/problem/run_clock.hpp"
#include "trundle/calibration/problem/run_gyro_bias.hpp"
#include "trundle/calibration/validation/conclusion.hpp"
#include "trundle/calibration/validation/cross_validation.hpp"
#include "trundle/calibration/validation/influence.hpp"
#include "trundle/calibration/validation/offer.hpp"
#include "trundle/calibration/validation/previous_calibration.hpp"
#include "trundle/calibration/validation/sessions.hpp"
#include "trundle/io/error.hpp"

namespace trundle::calibration {
namespace {

constexpr std::array kSensorPlace = {"reference.x", "reference.y", "reference.heading"};

/// Where no length was measured: by what all else is told, in words. Empty: nothing is.
std::string scale_taken_as_given(const Robot& robot, std::span<const Parameter> parameters,
                                 const FromOutside& measured) {
  if (measured.length) return {};
  std::vector<std::string> given;
  for (const Parameter& parameter : parameters_of(robot)) {
    const bool is_scale =
        parameter.kind == ParameterKind::diameter || parameter.kind == ParameterKind::gyro_scale;
    if (is_scale && std::ranges::find(parameters, parameter) == parameters.end())
      given.push_back(name_of(parameter, robot));
  }
  if (given.empty()) return {};
  return fmt::format(
      "{}: no length was measured from outside; what was estimated is right in proportion to what the robot "
      "file says of them",
      fmt::join(given, ", "));
}

void add_words(const Preparation& ready, const std::string& given_scale, CalibrationResult& result) {
  result.warnings.insert(result.warnings.end(), ready.silent.begin(), ready.silent.end());
  for (const std::string& words : {ready.sensor_heading, ready.scale})
    if (!words.empty()) result.warnings.push_back(words);
  if (ready.clocks_apart) result.warnings.push_back(*ready.clocks_apart);
  for (const Finding& fault : ready.channels.faults)
    result.warnings.push_back(describe(fault) + "; already compensated in the calibrated robot");
  if (!given_scale.empty()) result.unobservable.push_back(given_scale);
  for (const Finding& pair : ready.channels.ambiguous)
    if (const std::string words = describe(pair);
        std::ranges::find(result.unobservable, words) == result.unobservable.end())
      result.unobservable.push_back(words);
}

/// The parameters that are asked for; of a sensor that looks elsewhere than said, where it sits.
std::vector<std::string> free_besides(const CalibrateOptions& options, const Preparation& ready) {
  std::vector<std::string> names = options.free;
  if (!ready.sensor_heading.empty()) names.insert(names.end(), kSensorPlace.begin(), kSensorPlace.end());
  return names;
}

/// The wheels start as large as the references have them. Where the runs then do not show how large they are,
/// they would stay at a size that nobody gave and nothing measured.
void require_scale_determined(const Preparation& ready, const Estimate& estimate,
                              std::span<const Parameter> parameters) {
  if (ready.scale.empty()) return;
  Eigen::VectorXd common = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(parameters.size()));
  for (std::size_t j = 0; j < parameters.size(); ++j)
    if (parameters[j].kind == ParameterKind::diameter ||
        parameters[j].kind == ParameterKind::velocity_forward_scale)
      common[static_cast<Eigen::Index>(j)] = 1.0;
  const Eigen::MatrixXd& told = estimate.space.basis;  // in prior sigmas: of diameters one share of each
  constexpr double kSame = 1e-6;                       // rounding
  if (!common.isZero() && (common - told * (told.transpose() * common)).norm() <= kSame * common.norm())
    return;
  throw CannotAnswer(ready.scale +
                     "; and beyond that these runs do not show how large the wheels are: is the clock of the "
                     "reference right, and each column that of its wheel?");
}

std::string names_of(std::span<const Parameter> parameters, const Robot& robot) {
  std::vector<std::string> names;
  for (const Parameter& parameter : parameters) names.push_back(name_of(parameter, robot));
  return fmt::format("{}", fmt::join(names, ", "));
}

/// Throws CannotAnswer where what some runs say makes the others worse, whatever is estimated.
void require_something_holds(const ValidatedEstimate& validated, const Robot& nominal) {
  if (!validated.parameters.empty()) return;
  throw CannotAnswer(fmt::format(
      "what these runs say does not hold beyond them ({}): they do not determine {}. Are the references "
      "coarse, are clocks off, or did wheels slip? Drive longer, or more runs",
      validated.before->words(), names_of(validated.refused.parameters, nominal)));
}

/// What of the parameters holds beyond the runs that they were learned from.
void add_validation(const ValidatedEstimate& validated, const Robot& nominal, CalibrationResult& result) {
  if (!validated.refused.parameters.empty()) {
    record(validated.refused, result);
    result.warnings.push_back(fmt::format("{} stays as given: with it, {}",
                                          names_of(validated.refused.parameters, nominal),
                                          validated.before->words()));
  }
  if (!validated.validation) return;
  result.cross_validation = validated.validation;
  result.notes.push_back("judged " + validated.validation->words());
}

void add_offers(const std::vector<ParameterOffer>& offers, CalibrationResult& result) {
  result.offers = offers;
  for (const ParameterOffer& offer : offers) result.notes.push_back(offer.words());
}

/// Whether nobody has said where the references' sensor is: it is taken to be in the robot's middle. Of a
/// robot that is told its velocity what its errors wander by would pass for a sensor that looks askew; of one
/// that skids nobody knows either where it turns about, which shows in the same way.
bool leaves_sensor_open(const Robot& robot, const CalibrateOptions& options) {
  const Pose2& place = robot.body_from_reference;
  const auto is_of_sensor = [](const std::string& name) {
    return std::ranges::find(kSensorPlace, name) != kSensorPlace.end();
  };
  return robot.chassis.wheel_count > 0 && !contains(parameters_of(robot), ParameterKind::icr_x) &&
         place.x == 0.0 && place.y == 0.0 && place.heading == 0.0 &&
         std::ranges::none_of(options.fix, is_of_sensor);
}

/// By how much runs that were left out are off with what holds; nothing: they do not judge it.
std::optional<double> held_out_error_m(const ValidatedEstimate& validated) {
  if (validated.parameters.empty()) return validated.before->given_m;
  return validated.validation ? std::optional(validated.validation->calibrated_m) : std::nullopt;
}

/// Where the references' sensor is by what holds; where nothing does by all that was estimated.
SensorPlace place_by(CalibrationProblem problem, const ValidatedEstimate& validated) {
  if (validated.parameters.empty()) return sensor_place(problem, estimate_parameters(problem));
  problem.parameters = validated.parameters;
  return sensor_place(problem, validated.estimate);
}

/// Of a sensor that nobody has placed, and that the references show elsewhere than in the robot's middle, the
/// place is estimated, too, where that makes runs that were left out come out better: what it misses by would
/// pass for noise of the wheels. Returns where it is by what is estimated then.
SensorPlace place_sensor(CalibrationProblem& problem, ValidatedEstimate& validated) {
  constexpr double kBetter = 1.1;  // as what is refused is worse
  SensorPlace place = place_by(problem, validated);
  const std::optional<double> before_m = held_out_error_m(validated);
  if (place.elsewhere.empty() || !before_m) return place;
  CalibrationProblem wider = with_sensor_pose(problem);
  ValidatedEstimate placed = estimate_what_holds(wider);
  const std::optional<double> after_m = held_out_error_m(placed);
  if (!after_m || !(kBetter * *after_m < *before_m)) return place;
  problem = std::move(wider);
  validated = std::move(placed);
  std::string estimated = place.elsewhere + ", which does not say: it is estimated";
  place = place_by(problem, validated);
  place.estimated = std::move(estimated);
  return place;
}

void add_sensor_place(const SensorPlace& place, CalibrationResult& result) {
  if (!place.elsewhere.empty()) result.warnings.push_back(place.elsewhere + ": " + place.advice);
  if (!place.unobservable.empty()) result.unobservable.push_back(place.unobservable);
  if (!place.estimated.empty()) result.notes.push_back(place.estimated);
}

void add_learned_noise(std::span<const Run> runs, CalibrationResult& result) {
  const LearnedNoise learned = learn_noise(runs, result.calibrated);
  result.calibrated = with_noise(result.calibrated, learned.levels);
  std::erase_if(result.calibrated.calibration->provenance,
                [](const std::string& line) { return line.starts_with("noise."); });
  note(learned.how, result);
}

void add_influence(const Estimate& estimate, const CalibrationProblem& problem, const Robot& nominal,
                   CalibrationResult& result) {
  Influence influence = influence_of(estimate, nominal, problem.parameters);
  result.without_run = std::move(influence.without);
  result.after_run = std::move(influence.after);
  result.sigma_after_run = std::move(influence.sigma_after);
}

}  // namespace

CalibrationResult calibrate(std::span<const Recording> training, std::span<const Recording> hold_out,
                            const Robot& given, const CalibrateOptions& options) {
  const bool frees_reference_clock =
      std::ranges::find(options.free, "reference.time_offset") != options.free.end();
  Preparation ready =
      prepare(training, given,
              {.frees_reference_clock = frees_reference_clock, .keeps_lag = fixes_velocity(options.fix)});
  const Robot& nominal = ready.channels.robot;
  const FromOutside measured = from_outside(ready.runs);
  CalibrationProblem problem{ready.runs, ready.start,
                             choose_parameters(nominal, measured, free_besides(options, ready), options.fix)};
  problem.share_gyro_bias = !contains(problem.parameters, ParameterKind::gyro_bias);
  require_something_free(problem.parameters, training, nominal);
  ValidatedEstimate validated = estimate_what_holds(problem);
  std::optional<SensorPlace> place;
  if (leaves_sensor_open(nominal, options)) place = place_sensor(problem, validated);
  require_something_holds(validated, nominal);
  problem.parameters = validated.parameters;
  const Estimate& estimate = validated.estimate;
  require_something_estimated(estimate, problem.parameters, nominal);
  require_scale_determined(ready, estimate, problem.parameters);
  const SessionSpread spread = session_spread(problem, estimate.space);

  CalibrationResult result = result_of(estimate, spread, problem.parameters, nominal);
  result.method = "ml";
  add_words(ready, scale_taken_as_given(nominal, problem.parameters, measured), result);
  std::ranges::copy(changed_since(given, result.parameters), std::back_inserter(result.warnings));
  add_validation(validated, nominal, result);
  add_sensor_place(place ? *place : sensor_place(problem, estimate), result);
  add_offers(offers_of(problem, offered_parameters(nominal, problem.parameters, options.fix)), result);
  if (const auto& gyro = estimate.robot.chassis.gyro)
    ready.start.chassis.gyro->time_offset_s = gyro->time_offset_s;
  for (Run& run : ready.runs) set_gyro_clock(ready.start, run);
  if (options.learn_noise) add_learned_noise(ready.runs, result);
  result.steering_clock = ready.steering_clock;
  result.gyro_clock = ready.gyro_clock;
  result.reference_clocks = words_of_clocks(ready.runs, ready.reference_clock);
  result.velocity_lag = ready.velocity_lag;
  for (const auto& words : {result.velocity_lag, result.steering_clock, result.gyro_clock, ready.gyro_noise,
                            result.reference_clocks})
    if (words) note(*words, result);
  result.gyro_biases = words_of_biases(ready.runs, estimate.gyro_biases);
  if (result.gyro_biases) note(*result.gyro_biases, result);
  std::vector<Run> held_out = prepare_runs(hold_out, ready.start);
  if (frees_reference_clock) let_clocks_move(ready.start, held_out);
  conclude({ready.runs, held_out}, estimate, spread, result);
  add_influence(estimate, problem, nominal, result);
  return result;
}

}  // namespace trundle::calibration
