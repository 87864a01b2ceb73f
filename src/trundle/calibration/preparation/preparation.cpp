#include "trundle/calibration/preparation/preparation.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "trundle/calibration/preparation/initial_scale.hpp"
#include "trundle/calibration/preparation/reversed_wheel.hpp"
#include "trundle/calibration/preparation/sense_of_turning.hpp"
#include "trundle/calibration/preparation/sensor_heading.hpp"
#include "trundle/calibration/preparation/velocity_lag.hpp"
#include "trundle/calibration/problem/run_clock.hpp"
#include "trundle/chassis/rows.hpp"
#include "trundle/io/error.hpp"
#include "trundle/io/words.hpp"
#include "trundle/odometry/gyro_noise.hpp"
#include "trundle/recording/time_offset.hpp"
#include "trundle/recording/turns.hpp"
#include "trundle/recording/velocity_lag.hpp"
#include "trundle/statistics/distribution.hpp"

namespace trundle::calibration {
namespace {

// Farther than anybody mounts a sensor askew without knowing.
constexpr double kElsewhere_rad = radians(20.0);
// Of χ²: offsets of one clock scatter more in one case of a hundred.
constexpr double kClocksDiffer = 0.01;

/// What those recordings say that say anything.
std::vector<TimeOffset> offsets_of(const std::vector<SteeringClocks>& clocks,
                                   std::optional<TimeOffset> SteeringClocks::*clock) {
  std::vector<TimeOffset> offsets;
  for (const SteeringClocks& one : clocks)
    if (one.*clock) offsets.push_back(*(one.*clock));
  return offsets;
}

/// Sets a clock by the logs, where they show it wrong. Returns what was done, in words: `key`, and `how`.
std::optional<std::string> set_clock(const std::vector<TimeOffset>& offsets, double given_s,
                                     const std::function<void(double by_s)>& move, std::string_view key,
                                     std::string_view how) {
  const auto mean = mean_of(offsets);
  if (!mean || !is_off(*mean, given_s)) return std::nullopt;
  move(mean->offset_s - given_s);
  return fmt::format("{} {} s (was {}), from {} in {}", key, with_sigma(mean->offset_s, mean->sigma_s),
                     fixed(given_s, 4), how, counted(offsets.size(), "recording"));
}

/// Sets the clocks of the steering and of the gyro.
void set_board_clocks(std::span<const Recording> recordings, Preparation& ready) {
  Robot& robot = ready.start;
  std::vector<SteeringClocks> clocks;
  for (const Recording& recording : recordings) clocks.push_back(steering_clocks(recording, robot));
  ready.steering_clock = set_clock(
      offsets_of(clocks, &SteeringClocks::steering), steering_time_offset_s(robot.chassis),
      [&](double by_s) { move_steering_clock(by_s, robot.chassis); }, "steering_time_offset_s",
      "turns by the steering and turns measured otherwise");
  if (robot.chassis.gyro) {
    std::vector<TimeOffset> offsets = offsets_of(clocks, &SteeringClocks::gyro);
    if (offsets.empty())
      offsets = recording::offsets_of(
          recordings, [&](const Recording& recording) { return gyro_time_offset(recording, robot); });
    double& time_offset_s = robot.chassis.gyro->time_offset_s;
    ready.gyro_clock = set_clock(
        offsets, time_offset_s, [&](double by_s) { time_offset_s += by_s; }, "gyro.time_offset_s",
        observability(rows_of(robot.chassis, false)).rank == 3
            ? "the turns of gyro and wheels"
            : "the turns of gyro and reference, and the ways of wheels and reference");
  }
  const auto apart = mean_of(offsets_of(clocks, &SteeringClocks::apart));
  if (!ready.steering_clock && !ready.gyro_clock && robot.chassis.gyro && apart && is_off(*apart, 0.0))
    ready.clocks_apart = describe({.code = FindingCode::steering_time_offset,
                                   .subjects = {"gyro"},
                                   .payload = payload::Offset{apart->offset_s, apart->sigma_s}});
}

/// Where one offset of the reference's clock is sought for all runs: from what they say in the mean, for the
/// search would find a minimum beside the right one.
void start_reference_clock(std::span<const Recording> recordings, Robot& robot) {
  const std::vector<TimeOffset> offsets = offsets_of(recordings, [&](const Recording& recording) {
    return reference_time_offset(recording.reference, align(recording, robot), robot);
  });
  if (const auto mean = mean_of(offsets)) robot.reference_time_offset_s = mean->offset_s;
}

/// Whether offsets that differ differ by chance.
bool is_one_offset(const std::vector<TimeOffset>& offsets, double mean_s) {
  double chi2 = 0.0;
  for (const TimeOffset& offset : offsets) chi2 += std::pow((offset.offset_s - mean_s) / offset.sigma_s, 2);
  return chi2 <= chi_squared_limit(kClocksDiffer, static_cast<double>(offsets.size()) - 1.0);
}

/// What runs that each tell the clock of their reference say of it together; nothing where they contradict
/// one another, as where somebody laid each run's stamps on those of its reference, to a row. What blurs one
/// of them may blur all alike: the sigma is that of the best.
std::optional<TimeOffset> common_offset(const std::vector<TimeOffset>& offsets) {
  if (offsets.size() < 2) return std::nullopt;
  const double mean_s = mean_of(offsets)->offset_s;
  if (!is_one_offset(offsets, mean_s)) return std::nullopt;
  return TimeOffset{.offset_s = mean_s,
                    .sigma_s = std::ranges::min(offsets, {}, &TimeOffset::sigma_s).sigma_s};
}

/// Where references are late by one and the same: less than a stamp says of one run follows from all of them
/// together, and so is what each is too short for. Set in both robots, for the clock is none of what a robot
/// is judged by. Runs whose clock is clearly off have one of their own. Returns what was done, in words.
std::optional<std::string> set_shared_reference_clock(std::span<const Run> runs, Robot& start,
                                                      Robot& nominal) {
  std::vector<ReferenceLog> logs;
  std::vector<TimeOffset> seen;
  for (const Run& run : runs) {
    if (run.epochs.empty() || run.reference_clock) continue;
    logs.push_back({run.reference, run.readings});
    if (run.seen_reference_clock) seen.push_back(*run.seen_reference_clock);
  }
  if (logs.size() < 2) return std::nullopt;
  const std::optional<TimeOffset> found =
      seen.empty() ? reference_time_offset(logs, start) : common_offset(seen);
  const double given_s = start.reference_time_offset_s;
  if (!found || !is_off(*found, given_s)) return std::nullopt;
  start.reference_time_offset_s = nominal.reference_time_offset_s = found->offset_s;
  return fmt::format(
      "reference.time_offset_s {} s (was {}), from the ways and turns that reference and robot show in {} "
      "together",
      with_sigma(found->offset_s, found->sigma_s), fixed(given_s, 4), counted(logs.size(), "run"));
}

/// Positions alone, as of GPS, show which way the path bends: a gyro that turns against it and the wheels is
/// upside down.
void turn_gyro_by_positions(std::span<const Recording> recordings, ChannelAssignment& channels) {
  Robot& robot = channels.robot;
  const auto has_headings = [](const Recording& r) { return r.reference.has_headings(); };
  const auto contradicts = [&](const Recording& r) {
    return !r.reference.time_s.empty() && turns_contradict(r, robot, align(r, robot));
  };
  if (!robot.chassis.gyro || std::ranges::any_of(recordings, has_headings) ||
      std::ranges::none_of(recordings, contradicts) ||
      !positions_bend_as_wheels_turn(prepare_runs(recordings, robot), robot))
    return;
  robot.chassis.gyro->scale = -robot.chassis.gyro->scale;
  channels.faults.push_back(
      {.code = FindingCode::reversed_gyro, .payload = payload::Amount{robot.chassis.gyro->scale}});
}

/// A fit would make wheels of a sign that is wrong, and diameters of what is none.
void require_no_reversed_wheel(std::span<const Recording> recordings, std::span<const Run> runs,
                               const Robot& robot) {
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const auto turns = comparable_turns(recordings[i], robot, runs[i].readings);
    const auto wheel = turns ? reversed_wheel(*turns, runs[i].readings, robot) : std::nullopt;
    if (wheel)
      throw CannotAnswer(
          fmt::format("run {}: '{}' counts backwards, as the gyro shows: turn the sign of its "
                      "ticks_per_revolution, or its direction_deg",
                      runs[i].name, robot.wheel_names[*wheel]));
  }
}

/// A fit would find a steering's zero on the other side: its angles are mirrored there.
void require_steering_as_the_path_bends(std::span<const Run> runs, const Robot& robot) {
  const auto has_headings = [](const Run& run) { return run.reference.has_headings(); };
  if (is_steered(robot.chassis) && std::ranges::none_of(runs, has_headings) &&
      positions_bend_against_wheels(runs, robot))
    throw CannotAnswer(
        "the references' path bends the other way than the wheels are steered: if the steering is "
        "reversed turn the sign of its steering_scale; if all wheels count backwards that of "
        "ticks_per_revolution: positions alone do not show which");
}

/// A fit would take one of two explanations, and a robot mirrored in its own middle is one of them: what only
/// somebody who looks at the robot can determine is not decided here.
void require_one_sense_of_turning(std::span<const Recording> recordings, std::span<const Run> runs,
                                  const Robot& robot) {
  for (std::size_t i = 0; i < runs.size(); ++i)
    if (turns_contradict(recordings[i], robot, runs[i].readings))
      throw CannotAnswer(fmt::format(
          "run {}: the gyro turns the other way than the wheels, and nothing measured from outside "
          "shows which of them is right: if the gyro is upside down write scale = {:g} under "
          "[gyro] of the robot file; if left and right are swapped swap their columns in "
          "recording.toml, or the wheels in the robot file; if all wheels count backwards turn "
          "the sign of ticks_per_revolution",
          runs[i].name, -robot.chassis.gyro->scale));
}

/// Whether the run measures anything from outside, or its readings check each other.
bool is_informative(const Run& run, const Robot& robot) {
  const bool with_gyro = robot.chassis.gyro.has_value();
  const auto is_complete = [&](const Increment& increment) { return increment.has_gyro || !with_gyro; };
  return run.measures_anything() ||
         (observability(rows_of(robot.chassis, with_gyro)).degrees_of_freedom > 0 &&
          std::ranges::any_of(run.readings.increments, is_complete));
}

/// Runs that tell nothing are no evidence of little scatter: they do not count among those that tell. Returns
/// which, in words; where no run tells anything all stay, to be told what is missing.
std::vector<std::string> leave_out_silent(const Robot& robot, std::vector<Run>& runs) {
  const auto is_silent = [&](const Run& run) { return !is_informative(run, robot); };
  std::vector<std::string> words;
  if (std::ranges::all_of(runs, is_silent)) return words;
  for (const Run& run : runs)
    if (is_silent(run))
      words.push_back(
          fmt::format("run {} shows nothing of what is calibrated: no reference{}; it is left out", run.name,
                      robot.chassis.gyro ? ", no gyro" : ", and no readings that check each other"));
  std::erase_if(runs, is_silent);
  return words;
}

/// A sensor that looks elsewhere than the robot file says would be explained by wheels that are none. Returns
/// what is wrong, in words.
std::string set_sensor_heading(std::span<const Run> runs, Robot& robot) {
  const auto heading = sensor_heading(runs, robot);
  double& given = robot.body_from_reference.heading;
  if (!heading || std::abs(wrap_angle(*heading - given)) < kElsewhere_rad) return {};
  std::string words = fmt::format(
      "the reference sensor looks along {:.0f}° and not {:.0f}° from the robot's front: so it moves while "
      "the wheels roll straight; its pose is estimated (write it under [reference] of the robot file)",
      degrees(*heading), degrees(given));
  given = *heading;
  return words;
}

/// The fit finds the minimum next to where it starts: wheels that are far off by the references start right.
/// Returns what is wrong, in words. Throws CannotAnswer where a unit is.
std::string set_scale(std::span<const Run> runs, Robot& robot) {
  const std::optional<ScaleFault> fault = scale_fault(runs, robot);
  if (!fault) return {};
  std::string words =
      robot.chassis.wheels().empty()
          ? fmt::format(
                "the reference moves {} times as far as velocity.csv with the robot file as given: "
                "check their units, and forward_scale under [velocity]",
                three_digits(fault->ratio.factor))
          : describe({.code = FindingCode::scale, .payload = fault->ratio});
  if (fault->is_of_unit) throw CannotAnswer(words);
  scale_wheels(fault->scale.times, robot);
  return words;
}

}  // namespace

std::optional<std::string> set_gyro_noise(std::span<const Recording> recordings, Robot& robot) {
  if (!robot.chassis.gyro) return std::nullopt;
  std::vector<GyroNoise> at_rest;
  for (const Recording& recording : recordings)
    if (const auto noise = gyro_noise(recording, robot.chassis)) at_rest.push_back(*noise);
  if (at_rest.empty()) return std::nullopt;
  const GyroNoise seen = pooled(at_rest);
  double& density = robot.chassis.gyro->noise_rad_s_sqrt_hz;
  if (!is_louder(seen, density)) return std::nullopt;
  const double given = std::exchange(density, seen.noise_rad_s_sqrt_hz);
  return fmt::format("gyro.noise_rad_s_sqrt_hz {} (was {:.3g}), from {:.0f} s at rest in {}",
                     with_sigma(density, seen.noise_sigma), given, seen.rest_s,
                     counted(at_rest.size(), "recording"));
}

std::vector<Run> prepare_runs(std::span<const Recording> recordings, const Robot& robot) {
  std::vector<Run> runs;
  for (const Recording& recording : recordings) runs.push_back(prepare_run(recording, robot));
  return runs;
}

Preparation prepare(std::span<const Recording> recordings, const Robot& given,
                    const PrepareOptions& options) {
  Preparation ready{.channels = check_channels(recordings, given),
                    .start = {},
                    .runs = {},
                    .velocity_lag = {},
                    .steering_clock = {},
                    .gyro_clock = {},
                    .clocks_apart = {},
                    .gyro_noise = {},
                    .reference_clock = {},
                    .sensor_heading = {},
                    .scale = {},
                    .silent = {}};
  turn_gyro_by_positions(recordings, ready.channels);
  ready.start = ready.channels.robot;
  if (!options.keeps_lag)
    ready.velocity_lag = set_velocity_lag(recordings, velocity_lag_by_reference,
                                          "the ways and turns that the reference shows", ready.start);
  set_board_clocks(recordings, ready);
  ready.gyro_noise = set_gyro_noise(recordings, ready.start);
  if (options.frees_reference_clock) start_reference_clock(recordings, ready.start);
  ready.runs = prepare_runs(recordings, ready.start);
  if (!options.frees_reference_clock)
    ready.reference_clock = set_shared_reference_clock(ready.runs, ready.start, ready.channels.robot);
  if (ready.reference_clock) ready.runs = prepare_runs(recordings, ready.start);
  require_no_reversed_wheel(recordings, ready.runs, ready.start);
  require_steering_as_the_path_bends(ready.runs, ready.start);
  require_one_sense_of_turning(recordings, ready.runs, ready.start);
  ready.silent = leave_out_silent(ready.start, ready.runs);
  ready.sensor_heading = set_sensor_heading(ready.runs, ready.start);
  ready.scale = set_scale(ready.runs, ready.start);
  if (!ready.scale.empty()) {
    ready.runs = prepare_runs(recordings, ready.start);
    leave_out_silent(ready.start, ready.runs);
  }
  if (options.frees_reference_clock) let_clocks_move(ready.start, ready.runs);
  return ready;
}

}  // namespace trundle::calibration
