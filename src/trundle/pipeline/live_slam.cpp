#include "trundle/pipeline/live_slam.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/pipeline/sound.hpp"

namespace trundle::pipeline {
namespace {

// Unidentified landmarks are numbered from here on, as the names that will come are not known. No world has
// more.
constexpr LandmarkId kFirstUnidentified = 1 << 20;
// Instants of sightings that may wait for a reading of the wheels: memory, and the time of the line that
// brings it, are bounded.
constexpr std::size_t kMostWaiting = 1000;

SlamOptions slam_options(const StepCutter& cutter, const Pose2& start, double window_s) {
  const SystematicErrors& systematic = cutter.systematic();
  return {.method = SlamMethod::smoother,
          .prior = {.start = start, .systematic_sigma = systematic.sigma()},
          .has_bias = systematic.has_bias,
          .window_s = window_s,
          .first_unidentified = kFirstUnidentified};
}

}  // namespace

LiveSlam::LiveSlam(const Robot& robot, const Pose2& start, const LiveSlamOptions& options)
    : late_s_(options.late_s),
      sensor_clock_s_(robot.landmark_sensor->time_offset_s),
      cutter_(robot, {.hide_ids = options.unknown_ids}),
      metre_(metre_of(robot, start)),
      filter_(*robot.landmark_sensor, slam_options(cutter_, start, options.window_s)) {}

void LiveSlam::require_timely(double stamp_s, std::string_view place) const {
  if (last_s_ && stamp_s <= *last_s_)
    throw InputError(place, fmt::format("'sightings' at {} s, after a reading at {} s", stamp_s, *last_s_),
                     "stamps that grow, and all that is seen at one on one line");
  if (started_ && stamp_s + sensor_clock_s_ <= cutter_.now_s())
    throw InputError(place,
                     fmt::format("'sightings' at {} s come {:.3g} s too late", stamp_s,
                                 cutter_.now_s() - sensor_clock_s_ - stamp_s),
                     "them before readings that are later, or a larger --late-s");
  if (instants_.size() >= kMostWaiting)
    throw InputError(place, fmt::format("'sightings' of {} stamps wait for the wheels", instants_.size()),
                     "readings of the wheels in between");
}

void LiveSlam::see(double stamp_s, const std::vector<Sighting>& sightings) {
  last_s_ = stamp_s;
  instants_.push_back(stamp_s + sensor_clock_s_);
  for (Sighting sighting : sightings) {
    sighting.time_s = instants_.back();
    cutter_.add_sighting(sighting);
  }
}

void LiveSlam::start(double time_s) {
  waiting_.push_back({.increment = {.time_s = time_s}, .is_start = true});
}

void LiveSlam::add(const AlignedInterval& interval) {
  waiting_.push_back({.increment = interval.increment, .bridged = interval.bridged});
}

/// Nothing that was seen by its end can come any more.
bool LiveSlam::is_complete(const Interval& interval, double newest_s) const {
  const double end_s = interval.increment.time_s - sensor_clock_s_;
  return newest_s > end_s + late_s_ || (last_s_ && *last_s_ >= end_s);
}

void LiveSlam::advance(double newest_s, std::vector<LiveSighted>& sighted) {
  std::size_t complete = 0;
  for (; complete < waiting_.size() && is_complete(waiting_[complete], newest_s); ++complete)
    count(waiting_[complete], sighted);
  waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(complete));
}

void LiveSlam::finish(std::vector<LiveSighted>& sighted) {
  for (const Interval& interval : std::exchange(waiting_, {})) count(interval, sighted);
  if (!started_) return;
  cutter_.finish();
  count_steps(sighted);
}

void LiveSlam::count(const Interval& interval, std::vector<LiveSighted>& sighted) {
  if (interval.is_start)
    cutter_.start(interval.increment.time_s);
  else
    cutter_.advance(interval.increment, interval.bridged);
  started_ = true;
  std::erase_if(instants_, [&](double time_s) { return time_s <= cutter_.now_s(); });
  count_steps(sighted);
}

void LiveSlam::count_steps(std::vector<LiveSighted>& sighted) {
  for (const SlamStep& step : cutter_.take().steps) {
    const StepReport& report = filter_.step(step);
    if (step.observations.empty()) continue;
    seen_ = true;
    sighted.push_back({step.time_s, slam_pose(filter_.estimate()), {}});
    require_sound({step.time_s, sighted.back().slam.pose}, sighted.back().slam.covariance, "sightings");
    for (std::size_t i = 0; i < step.observations.size(); ++i) {
      const LandmarkId given = step.observations[i].landmark;
      sighted.back().sightings.push_back(
          {name_of(given >= 0 ? given : report.observations[i].landmark), report.observations[i]});
    }
  }
}

std::optional<LiveSlamPose> LiveSlam::estimate() const {
  if (!seen_) return std::nullopt;
  MotionSum ahead = cutter_.motion();
  for (const Interval& interval : waiting_) ahead.add(interval.increment, interval.bridged);
  return slam_pose(filter_.estimate_after(ahead.so_far()));
}

LiveSlamPose LiveSlam::slam_pose(PoseEstimate estimate) const {
  metre_.add_to(estimate);
  return {estimate.pose, estimate.covariance, filter_.landmarks()};
}

std::vector<LandmarkRow> LiveSlam::map() const {
  std::vector<LandmarkRow> rows;
  for (const MappedLandmark& landmark : map_with(filter_.map_covariance(), filter_))
    rows.push_back({.name = name_of(landmark.id),
                    .position = landmark.position,
                    .covariance = landmark.covariance,
                    .sightings = static_cast<double>(landmark.sightings)});
  return rows;
}

/// Landmarks without names are numbered from 1 on, in order of first sight.
std::string LiveSlam::name_of(LandmarkId id) const {
  const std::vector<std::string>& names = cutter_.names();
  if (id < 0) return {};
  if (static_cast<std::size_t>(id) < names.size()) return names[static_cast<std::size_t>(id)];
  std::string number = std::to_string(id - kFirstUnidentified + 1);
  return std::ranges::find(names, number) == names.end() ? number : "#" + number;
}

}  // namespace trundle::pipeline
