#include "trundle/pipeline/live.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "trundle/io/archive.hpp"
#include "trundle/io/checkpoint.hpp"
#include "trundle/io/error.hpp"
#include "trundle/slip/parity.hpp"

namespace trundle::pipeline {
namespace {

struct UnitEnding {
  WheelUnit unit;
  std::string_view ending;
};
/// As in wheels.csv, in order of precedence; a bare name is a count.
constexpr std::array kUnitEndings = {UnitEnding{WheelUnit::ticks, "_ticks"}, UnitEnding{WheelUnit::ticks, ""},
                                     UnitEnding{WheelUnit::radians, "_rad"},
                                     UnitEnding{WheelUnit::metres, "_m"},
                                     UnitEnding{WheelUnit::rate, "_rad_s"}};

struct Reading {
  WheelUnit unit = WheelUnit::ticks;
  double value = 0.0;
};

Reading reading_of(const std::string& wheel, const LiveLine& line, std::string_view place) {
  for (const UnitEnding& known : kUnitEndings) {
    const std::string column = wheel + std::string(known.ending);
    const auto at = std::ranges::find(line.wheels, column, &std::pair<std::string, double>::first);
    if (at != line.wheels.end()) return {known.unit, at->second};
  }
  throw InputError(place, fmt::format("'wheels' has no reading of '{}'", wheel),
                   fmt::format("'{}_ticks'", wheel));
}

Odometer::Options odometer_options(const Robot& robot, const UncertainParameters& uncertain,
                                   const Pose2& start) {
  return {
      .start = start, .parameters = uncertain.parameters, .learn_gyro_bias = robot.chassis.gyro.has_value()};
}

/// None where no reading goes beyond those that the motion needs.
std::optional<SlipOdometer> slip_odometer_of(const Robot& robot, const SlipOdometer::Options& options) {
  if (!can_show_slip(robot.chassis, true)) return std::nullopt;
  return SlipOdometer(robot, options);
}

void require_later(std::string_view sensor, double time_s, const std::optional<double>& last_s,
                   std::string_view place) {
  if (last_s && time_s <= *last_s)
    throw InputError(place, fmt::format("'{}' at {} s, after a reading at {} s", sensor, time_s, *last_s),
                     "stamps that grow");
}

std::optional<LiveSlam> live_slam_of(const Robot& robot, const LiveOptions& options) {
  if (!robot.landmark_sensor) return std::nullopt;
  return LiveSlam(robot, options.start, options.slam);
}

constexpr std::string_view kLiveState = "live";
constexpr double kLongestSilence_s = 86400.0;  // of a log that goes on

}  // namespace

LiveOdometer::LiveOdometer(const Robot& robot, const LiveOptions& options)
    : robot_(robot),
      options_(options),
      aligner_(robot, options.alignment),
      uncertain_(uncertain_parameters(robot, true)),
      odometer_(robot, odometer_options(robot, uncertain_, options.start)),
      slip_(slip_odometer_of(
          robot, {.odometry = odometer_options(robot, uncertain_, options.start), .slip = options.slip})),
      slam_(live_slam_of(robot, options)) {}

void LiveOdometer::take(const LiveLine& line, std::string_view place, std::vector<LiveEstimate>& estimates) {
  if (!has_reading(line)) return;
  require_near(line.time_s, place);
  require_suitable(line, place);
  sighted_.clear();  // of the line before
  const double before_s = last_s().value_or(line.time_s);
  if (!line.wheels.empty()) take_wheels(line, place);
  if (slam_ && !line.sightings.empty()) slam_->see(line.time_s, line.sightings);
  if (line.wants_map) map_s_ = line.time_s;
  if (line.yaw_rate_rad_s) {
    aligner_.add(GyroReading{line.time_s, *line.yaw_rate_rad_s});
    gyro_s_ = line.time_s;
  }
  moves_on_ = moves_on_ || line.time_s > before_s;
  take_intervals(estimates);
  advance_slam();
}

void LiveOdometer::require_suitable(const LiveLine& line, std::string_view place) const {
  if (!line.wheels.empty() && robot_.wheel_names.empty())
    throw InputError(place, "'wheels' of a robot without any", "a robot file with [[wheel]]");
  if (line.yaw_rate_rad_s) require_later("gyro", line.time_s, gyro_s_, place);
  if (!line.wheels.empty()) require_later("wheels", line.time_s, wheels_s_, place);
  if (line.wants_map && !robot_.landmark_sensor)
    throw InputError(place, "'map' of a robot without a landmark sensor",
                     "a robot file with [landmark_sensor]");
  if (line.wants_map) require_later("map", line.time_s, map_s_, place);
  if (slam_ && !line.sightings.empty()) slam_->require_timely(line.time_s, place);
}

std::optional<double> LiveOdometer::last_s() const {
  const std::optional<double> last_s = std::max({wheels_s_, gyro_s_, map_s_});
  return slam_ ? std::max(last_s, slam_->last_s()) : last_s;
}

/// Where that fails the odometry goes on.
void LiveOdometer::advance_slam() {
  if (!slam_ || !last_s()) return;
  try {
    slam_->advance(*last_s(), sighted_);
  } catch (const CannotAnswer&) {
    slam_.reset();
    throw;
  }
}

// A garbled stamp that were believed would make all later ones too early.
void LiveOdometer::require_near(double time_s, std::string_view place) {
  const std::optional<double> last_s = this->last_s();
  const bool is_far = last_s && std::abs(time_s - *last_s) > kLongestSilence_s;
  const bool is_confirmed = suspect_s_ && std::abs(time_s - *suspect_s_) <= kLongestSilence_s;
  suspect_s_ = is_far && !is_confirmed ? std::optional(time_s) : std::nullopt;
  if (suspect_s_)
    throw InputError(place, fmt::format("a stamp of {} s, after a reading at {} s", time_s, *last_s),
                     "one within a day, or a second one there");
  if (is_far && time_s < *last_s && !moves_on_) *this = LiveOdometer(robot_, options_);
}

bool LiveOdometer::has_reading(const LiveLine& line) const {
  return !line.wheels.empty() || line.yaw_rate_rad_s || line.wants_map || (slam_ && !line.sightings.empty());
}

bool LiveOdometer::is_known(const LiveLine& line) const {
  if (!has_reading(line)) return true;
  const bool old_map = line.wants_map && map_s_ && line.time_s <= *map_s_;
  const bool old_sightings =
      slam_ && !line.sightings.empty() && slam_->last_s() && line.time_s <= *slam_->last_s();
  const bool old_gyro = line.yaw_rate_rad_s && gyro_s_ && line.time_s <= *gyro_s_;
  const bool old_wheels = !line.wheels.empty() && wheels_s_ && line.time_s <= *wheels_s_;
  return old_gyro || old_wheels || old_sightings || old_map;
}

void LiveOdometer::finish(std::vector<LiveEstimate>& estimates) {
  sighted_.clear();
  aligner_.finish();
  take_intervals(estimates);
  if (slam_) slam_->finish(sighted_);
}

std::vector<LandmarkRow> LiveOdometer::map() const {
  return slam_ ? slam_->map() : std::vector<LandmarkRow>{};
}

void LiveOdometer::take_wheels(const LiveLine& line, std::string_view place) {
  WheelReadings readings{.time_s = line.time_s};
  WheelUnits units{};
  for (std::size_t i = 0; i < robot_.wheel_names.size(); ++i) {
    const Reading reading = reading_of(robot_.wheel_names[i], line, place);
    readings.value[i] = reading.value;
    units[i] = reading.unit;
  }
  WheelUnits steering_units{};
  for (std::size_t i = 0; i < robot_.chassis.all_wheels().size(); ++i) {
    if (!robot_.chassis.all_wheels()[i].steering) continue;
    const Reading reading = reading_of(wheel_name(robot_, i) + "_steering", line, place);
    if (reading.unit != WheelUnit::ticks && reading.unit != WheelUnit::radians)
      throw InputError(place, fmt::format("the steering of '{}' is no angle", wheel_name(robot_, i)),
                       fmt::format("'{}_steering_rad'", wheel_name(robot_, i)));
    readings.steering[i] = reading.value;
    steering_units[i] = reading.unit;
  }
  if (wheels_s_ && (units != units_ || steering_units != steering_units_))
    throw InputError(place, "gives the wheels in other units", "those of the first line");
  if (!wheels_s_) aligner_.set_units(units, steering_units);
  aligner_.add(readings);
  units_ = units;
  steering_units_ = steering_units;
  wheels_s_ = line.time_s;
}

void LiveOdometer::take_intervals(std::vector<LiveEstimate>& estimates) {
  std::optional<AlignedInterval> interval = aligner_.next();
  if (!started_ && aligner_.start_s()) {
    if (slam_) slam_->start(*aligner_.start_s());
    advance_slam();
    estimates.push_back(estimate_at(*aligner_.start_s()));
    started_ = true;
  }
  for (; interval; interval = aligner_.next()) estimates.push_back(step(*interval));
}

LiveEstimate LiveOdometer::step(const AlignedInterval& interval) {
  const Increment& increment = interval.increment;
  bool at_rest = false;
  std::optional<SlipVerdict> verdict;
  if (interval.bridged) {
    odometer_.step_across_gap(increment);
    if (slip_) verdict = slip_->step_across_gap(increment);
  } else {
    at_rest = odometer_.step(increment).at_rest();
    if (slip_) verdict = slip_->step(increment);
  }
  if (verdict) slipping_ = verdict->slipping;
  if (slam_) slam_->add(interval);
  advance_slam();
  LiveEstimate estimate = estimate_at(increment.time_s);
  estimate.at_rest = at_rest;
  if (slip_) estimate.slip->verdict = verdict;
  return estimate;
}

LiveEstimate LiveOdometer::estimate_at(double time_s) const {
  LiveEstimate estimate{.time_s = time_s,
                        .pose = odometer_.pose(),
                        .covariance = total_covariance(odometer_, uncertain_.covariance),
                        .gyro_bias = {},
                        .slip = {},
                        .slam = slam_ ? slam_->estimate() : std::nullopt};
  if (robot_.chassis.gyro) estimate.gyro_bias = odometer_.gyro_bias();
  if (slip_)
    estimate.slip = {.pose = slip_->odometer().pose(),
                     .covariance = total_covariance(slip_->odometer(), uncertain_.covariance),
                     .slipping = slipping_,
                     .verdict = {}};
  return estimate;
}

void write_live_checkpoint(const std::filesystem::path& path, const std::string& settings,
                           const LiveOdometer& odometer) {
  StateWriter writer;
  writer(settings, odometer);
  write_checkpoint(path, kLiveState, writer.take());
}

void read_live_checkpoint(const std::filesystem::path& path, const std::string& settings,
                          LiveOdometer& odometer) {
  const std::string state = read_checkpoint(path, kLiveState);
  StateReader reader(state);
  std::string its_settings;
  try {
    reader(its_settings);
    if (its_settings != settings)
      throw InputError(path.string(), "was made with other options or another robot file",
                       "the same robot file, start and options");
    reader(odometer);
    reader.finish();
  } catch (const DamagedState&) {
    throw InputError(path.string(), "is not the state of such a robot", "a file that --checkpoint wrote");
  }
}

}  // namespace trundle::pipeline
