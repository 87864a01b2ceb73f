#include "trundle/slam/smoothing/landmark_calibration.hpp"

#include <algorithm>
#include <map>
#include <optional>

#include <fmt/format.h>

#include "trundle/calibration/preparation/preparation.hpp"
#include "trundle/calibration/preparation/velocity_lag.hpp"
#include "trundle/calibration/problem/defaults.hpp"
#include "trundle/calibration/problem/run_gyro_bias.hpp"
#include "trundle/calibration/validation/conclusion.hpp"
#include "trundle/io/error.hpp"
#include "trundle/io/words.hpp"
#include "trundle/recording/velocity_lag.hpp"
#include "trundle/slam/consistency_checks.hpp"
#include "trundle/slam/models/sensor_clock.hpp"
#include "trundle/slam/smoothing/calibration/landmark_noise.hpp"
#include "trundle/slam/smoothing/calibration/range_scale.hpp"
#include "trundle/slam/smoothing/calibration/reference_positions.hpp"
#include "trundle/slam/smoothing/smoother.hpp"

namespace trundle::slam {
namespace {

// How often landmarks without names are associated, and how many sigmas no parameter moves by once that
// stays.
constexpr int kMostAssociations = 10;
// Far within the error bars.
constexpr double kSameRobot = 0.1;
// How often noise and robot are found in turn, and how many sigmas no noise moves by once that stays.
constexpr int kMostNoiseRounds = 10;
constexpr double kSameNoise = 0.1;  // sigmas
// Sightings or odometry scatter by so much more, or less, than their sigmas that a person should know.
constexpr double kScattersMore = 1.5;

// Where the sensor's clock is sought, sightings so close to either end of the odometry are left out [s]: they
// could leave it on the way. Twice the prior's sigma.
constexpr double kClockMargin_s = 1.0;
// Where the offset of its ranges is sought, readings so short are left out [m]: nothing could be left of
// them. Twice the prior's sigma.
constexpr double kRangeMargin_m = 0.2;

/// Which sightings are left out, since a parameter on its way could make them be no reading.
struct Margins {
  double time_s = 0.0;
  double range_m = 0.0;
};
Margins margins_of(std::span<const Parameter> parameters) {
  Margins margins;
  if (contains(parameters, ParameterKind::sensor_time_offset)) margins.time_s = kClockMargin_s;
  if (contains(parameters, ParameterKind::sensor_range_offset)) margins.range_m = kRangeMargin_m;
  return margins;
}

/// By each sighting, in the order of time, which landmark it shows.
std::vector<LandmarkId> by_sighting(const Recording& recording, const SlamInput& input,
                                    const ShownObservations& shown, const Margins& margins) {
  std::vector<LandmarkId> landmarks(recording.sightings.size(), kUnknownLandmark);
  const double end_s = input.steps.empty() ? input.start_s : input.steps.back().time_s;
  std::size_t next = 0;
  for (std::size_t k = 0; k < shown.size(); ++k)
    for (const Observation& observation : shown[k]) {
      const std::size_t number = input.sighting_numbers[next++];
      const double time_s = input.steps[k].time_s;
      if (time_s >= input.start_s + margins.time_s && time_s <= end_s - margins.time_s &&
          recording.sightings[number].range_m >= margins.range_m)
        landmarks[number] = observation.landmark;
    }
  return landmarks;
}

/// What is to be found, and from what.
struct LandmarkQuestion {
  std::span<const Recording> recordings;
  std::span<const Parameter> parameters;
  bool with_reference = false;  ///< from its positions too
};

/// Landmarks without names are associated by the filter, and once more along the whole path.
AssociatedRecording associated(const Recording& recording, const Robot& robot, const Margins& margins) {
  AlignedReadings readings = align(recording, robot);
  const SlamInput input = slam_input(recording, readings, robot, {.shares = true});
  Run run = prepare_run(recording, robot, std::move(readings));
  const bool has_unidentified = input.has_unidentified();
  const SlamResult filtered = slam(input, *robot.landmark_sensor,
                                   {.method = SlamMethod::ekf,
                                    .prior = {.systematic_sigma = input.systematic.sigma(kUsualShareSigma)},
                                    .first_unidentified = input.first_unidentified()});
  if (!has_unidentified || filtered.map.empty())
    return {recording, std::move(run), has_unidentified,
            by_sighting(recording, input, shown_observations(input, filtered), margins), filtered.online};
  SmoothedSlam smoothed = smooth(input, *robot.landmark_sensor, filtered);
  return {recording, std::move(run), has_unidentified, by_sighting(recording, input, smoothed.shown, margins),
          std::move(smoothed.trajectory)};
}

/// Lays its path into the reference's frame, where that has one.
void lay_into_reference(const Robot& robot, AssociatedRecording& one) {
  const auto start = start_by_reference(one.run, one.path, robot);
  one.in_reference = start.has_value();
  for (StampedPose& stamped : one.path.poses)
    if (start) stamped.pose = *start * stamped.pose;
}

std::vector<AssociatedRecording> associated(const LandmarkQuestion& question, const Robot& robot) {
  std::vector<AssociatedRecording> all;
  for (const Recording& recording : question.recordings) {
    all.push_back(associated(recording, robot, margins_of(question.parameters)));
    if (question.with_reference) lay_into_reference(robot, all.back());
  }
  if (question.with_reference && std::ranges::none_of(all, &AssociatedRecording::in_reference))
    throw CannotAnswer(
        "no recording has a reference with positions along its way: leave out --with-reference");
  return all;
}

/// What the logs say of the sensor's clock together.
std::optional<TimeOffset> sensor_clock_of(std::span<const Recording> recordings, const Robot& robot) {
  if (!robot.landmark_sensor) return std::nullopt;
  return mean_of(offsets_of(recordings, [&](const Recording& recording) {
    return sighting_time_offset(recording.sightings, align(recording, robot), robot);
  }));
}

/// Sets the sensor's clock where the logs show it wrong, and where it is a parameter: a start beside it may
/// end in another minimum. Returns what was done, in words; nothing: it stays as it is, or is sought.
std::optional<std::string> prepare_sensor_clock(std::span<const Recording> recordings,
                                                std::span<const Parameter> parameters, Robot& robot) {
  const std::optional<TimeOffset> found = sensor_clock_of(recordings, robot);
  if (!contains(parameters, ParameterKind::sensor_time_offset)) return set_sensor_clock(found, robot);
  if (found) robot.landmark_sensor->time_offset_s = found->offset_s;
  return std::nullopt;
}

/// Associated recordings, and the robot that was found from them.
struct AssociatedFit {
  std::vector<AssociatedRecording> all;
  LandmarkFit fit;
  double unsettled = 0.0;  ///< by so many sigmas a parameter moved when landmarks were last associated

  bool has_unidentified() const { return std::ranges::any_of(all, &AssociatedRecording::has_unidentified); }
};

/// The most that a parameter differs by, in its sigmas.
double largest_shift(const Estimate& before, const Estimate& after, std::span<const Parameter> parameters) {
  double largest = 0.0;
  for (std::size_t j = 0; j < parameters.size(); ++j) {
    const auto row = static_cast<Eigen::Index>(j);
    const double shift = value_of(parameters[j], after.robot) - value_of(parameters[j], before.robot);
    if (const double variance = after.covariance(row, row); variance > 0.0)
      largest = std::max(largest, std::abs(shift) / std::sqrt(variance));
  }
  return largest;
}

/// A wrong robot takes landmarks for one another, and what was taken wrongly makes the robot wrong: both are
/// found in turn, until the robot stays.
AssociatedFit fit_in_turn(const LandmarkQuestion& question, const Robot& nominal) {
  const std::span<const Parameter> parameters = question.parameters;
  AssociatedFit result{associated(question, nominal), {}};
  result.fit = fit_landmarks(result.all, nominal, parameters);
  if (!result.has_unidentified()) return result;
  for (int times = 1; times < kMostAssociations; ++times) {
    const Estimate before = result.fit.estimate;
    result.all = associated(question, before.robot);
    result.fit = fit_landmarks(result.all, nominal, parameters);
    result.unsettled = largest_shift(before, result.fit.estimate, parameters);
    if (result.unsettled < kSameRobot) break;
  }
  return result;
}

/// Of two rounds: the most that a noise differs by, in its sigmas.
double largest_shift(const LandmarkNoise& before, const LandmarkNoise& after) {
  double largest = 0.0;
  for (std::size_t i = 0; i < after.levels.size(); ++i)
    if (const NoiseLevel& now = after.levels[i]; now.is_determined)
      largest = std::max(largest, std::abs(now.value - before.levels[i].value) / now.sigma);
  return largest;
}

/// Noise weighs what the robot is found from, and the robot found shows what is noise: in turn, until the
/// noise stays. `found` becomes the fit with it, and `robot` the given one with it.
LandmarkNoise learn_noise_in_turn(const LandmarkQuestion& question, Robot& robot, AssociatedFit& found) {
  const Robot given = robot;
  std::optional<LandmarkNoise> before;
  for (int round = 0;; ++round) {
    LandmarkNoise noise = learn_landmark_noise(found.all, found.fit, given);
    const bool stays = before && largest_shift(*before, noise) < kSameNoise;
    robot = with_noise_of(noise.robot, robot);
    if (found.has_unidentified())
      found = fit_in_turn(question, robot);
    else
      found.fit = fit_landmarks(found.all, robot, question.parameters);
    if (stays || round + 1 == kMostNoiseRounds) return noise;
    before = std::move(noise);
  }
}

SessionSpread session_spread(std::span<const AssociatedRecording> all, const Robot& nominal,
                             std::span<const Parameter> parameters, const EstimableSpace& space) {
  std::map<std::string, std::vector<AssociatedRecording>> sessions;
  for (const AssociatedRecording& one : all)
    sessions.try_emplace(one.recording.session).first->second.push_back(one);
  std::vector<Estimate> estimates;
  if (sessions.size() > 1)
    for (const auto& [name, own] : sessions)
      estimates.push_back(fit_landmarks(own, nominal, parameters).estimate);
  return spread_of(estimates, parameters, space);
}

/// The scale of ranges, which sightings do not tell and nobody said to be right: it stays as given, and all
/// lengths that were found are off with it. Nothing: it is sought, or known.
std::optional<GivenParameters> open_range_scale(const AssociatedFit& found, const Robot& nominal,
                                                const CalibrateOptions& options, Estimate& estimate) {
  const FreeColumns& free = found.fit.free;
  if (free.parameters.empty() || contains(free.parameters, kRangeScale.kind) ||
      std::ranges::find(options.fix, name_of(kRangeScale, nominal)) != options.fix.end())
    return std::nullopt;
  return calibration::given_beside({&kRangeScale, 1},
                                   calibration::prior_covariance({&kRangeScale, 1}, nominal),
                                   taken_along_by_range_scale(found.all, found.fit), estimate);
}

/// Positions of a reference show how long a metre is, and so whether ranges are right in proportion.
std::vector<Parameter> sought_parameters(const Robot& nominal, const CalibrateOptions& options) {
  std::vector<std::string> free = options.free;
  if (options.with_reference) free.push_back(name_of(kRangeScale, nominal));
  return choose_parameters(nominal, {.length = true, .anything = true}, free, options.fix);
}

bool estimates_range_scale(const CalibrationResult& result) {
  return std::ranges::any_of(result.parameters, [](const ParameterEstimate& e) {
    return e.parameter == kRangeScale && e.observable;
  });
}

/// What lengths rest on.
std::string words_of_metre(const AssociatedFit& found, std::size_t sightings,
                           const std::optional<GivenParameters>& range_scale,
                           const CalibrationResult& result) {
  if (std::ranges::any_of(found.all, &AssociatedRecording::in_reference))
    return fmt::format("from {} sightings, and positions of the reference that err by {:.2g} m{}", sightings,
                       found.fit.free.position_sigma_m,
                       estimates_range_scale(result) ? ": lengths are the reference's" : "");
  const std::string counted =
      range_scale ? fmt::format("; ± allows for {:.2g} % of that (--fix sensor.range_scale: it is right)",
                                100.0 * std::sqrt(range_scale->covariance(0, 0)))
                  : "";
  return fmt::format(
      "from {} sightings, without any reference: lengths are those of the landmark sensor, a "
      "common error of its ranges is one of {}{}",
      sightings, result.nominal.chassis.wheel_count == 0 ? "velocity.forward_scale" : "all diameters",
      counted);
}

void add_words(const AssociatedFit& found, const std::optional<GivenParameters>& range_scale,
               CalibrationResult& result) {
  const double scatter = found.fit.scatter;
  std::size_t sightings = 0;
  for (const AssociatedRecording& one : found.all) sightings += one.recording.sightings.size();
  result.notes.push_back(words_of_metre(found, sightings, range_scale, result));
  if (found.unsettled >= kSameRobot)
    result.warnings.push_back(
        fmt::format("data association did not settle: repeated {} times, a parameter "
                    "still moved by {:.1f} of its sigmas; the error bars do not allow for it",
                    kMostAssociations, found.unsettled));
  for (const Finding& error : common_errors(found.fit.sensor, scatter, sightings))
    result.warnings.push_back(describe(error));
  if (scatter > kScattersMore)
    result.warnings.push_back(
        fmt::format("sightings and odometry scatter {:.1f} times as much as the robot file says; the error "
                    "bars allow for it",
                    std::sqrt(scatter)));
  if (scatter < 1.0 / kScattersMore)
    result.notes.push_back(
        fmt::format("sightings and odometry scatter {:.2f} times as much as the robot file says; the error "
                    "bars are those of the robot file",
                    std::sqrt(scatter)));
}

std::string words_of(const NoiseLevel& level) {
  if (level.is_determined)
    return fmt::format("{} {} (was {:.4g}), from the smoother's residuals", level.name,
                       with_sigma(level.value, level.sigma), level.given);
  return fmt::format("{} stays {:.4g}: these sightings leave it open by more than half of itself", level.name,
                     level.given);
}

/// The noises, and what they do not stand for.
void add_noise(const LandmarkNoise& noise, CalibrationResult& result) {
  for (const NoiseLevel& level : noise.levels) note(words_of(level), result);
  for (const LastingError& lasting : noise.lasting)
    result.warnings.push_back(fmt::format(
        "errors of {} last: neighbours, {:.2g} s apart, correlate by {:.2f}, so that what many of "
        "them say together is {:.1f} times as uncertain as the noise of one lets expect",
        lasting.of, lasting.spacing_s, lasting.correlation, lasting.of_means()));
}

}  // namespace

CalibrationResult calibrate_from_landmarks(std::span<const Recording> training,
                                           std::span<const Recording> hold_out, const Robot& nominal,
                                           const CalibrateOptions& options) {
  const std::vector<Parameter> parameters = sought_parameters(nominal, options);
  const LandmarkQuestion question{training, parameters, options.with_reference};
  const bool only_noise = parameters.empty() && options.learn_noise;
  if (!only_noise) require_something_free(parameters, training, nominal);
  Robot start = nominal;
  std::optional<std::string> lag;
  if (!calibration::fixes_velocity(options.fix))
    lag = calibration::set_velocity_lag(training, recording::velocity_lag_by_sightings,
                                        "how bearings change as the robot moves", start);
  const std::optional<std::string> sensor_clock = prepare_sensor_clock(training, parameters, start);
  const std::optional<std::string> gyro_noise = set_gyro_noise(training, start);
  AssociatedFit found = fit_in_turn(question, start);
  if (!only_noise) require_something_estimated(found.fit.estimate, parameters, nominal);
  Robot noisy = start;
  std::optional<LandmarkNoise> noise;
  if (options.learn_noise) noise = learn_noise_in_turn(question, noisy, found);
  Estimate estimate = found.fit.estimate;
  const std::optional<GivenParameters> range_scale = open_range_scale(found, nominal, options, estimate);
  const SessionSpread spread = session_spread(found.all, noisy, parameters, estimate.space);
  CalibrationResult result = result_of(estimate, spread, parameters, nominal);
  if (range_scale) record(*range_scale, result);
  result.method = "landmarks";
  const std::vector<Run> runs = prepare_runs(training, start);
  add_words(found, range_scale, result);
  result.sensor_clock = sensor_clock;
  result.velocity_lag = lag;
  for (const auto& words : {lag, sensor_clock, gyro_noise})
    if (words) note(*words, result);
  result.gyro_biases = words_of_biases(runs, estimate.gyro_biases);
  if (result.gyro_biases) note(*result.gyro_biases, result);
  if (noise) add_noise(*noise, result);
  conclude({runs, prepare_runs(hold_out, start)}, estimate, spread, result);
  if (only_noise) result.summary = "noise alone is learned";
  return result;
}

}  // namespace trundle::slam
