#include "trundle/slam/steps.hpp"

#include <algorithm>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/slam/motion_sum.hpp"

namespace trundle::slam {
namespace {

/// Sightings on the odometry's clock, in time order, those of one instant as they were recorded.
std::vector<Sighting> timely_sightings(const Recording& recording, const LandmarkSensor& sensor) {
  std::vector<Sighting> sightings = recording.sightings;
  for (Sighting& sighting : sightings) sighting.time_s += sensor.time_offset_s;
  std::ranges::stable_sort(sightings, {}, &Sighting::time_s);
  return sightings;
}

/// Numbers for names, in order of first sight.
class Names {
 public:
  explicit Names(const std::vector<std::string>& first) {
    for (const std::string& name : first) id_of(name);
  }
  LandmarkId id_of(const std::string& name) {
    const auto [at, is_new] = ids_.try_emplace(name, static_cast<LandmarkId>(names_.size()));
    if (is_new) names_.push_back(name);
    return at->second;
  }
  std::vector<std::string> list() { return std::move(names_); }

 private:
  std::map<std::string, LandmarkId> ids_;
  std::vector<std::string> names_;
};

/// The share u of an interval of constant twist.
Increment share_of(Increment increment, double u) {
  increment.duration_s *= u;
  increment.gyro_rad *= u;
  for (double& turned : increment.turned) turned *= u;
  for (double& variance : increment.slip_variance) variance *= u;
  return increment;
}

/// Goes through increments and sightings side by side.
class Cutter {
 public:
  Cutter(const Robot& robot, const SlamInputOptions& options, std::vector<Sighting> sightings)
      : options_(options),
        sensor_(*robot.landmark_sensor),
        systematic_(systematic_errors_of(robot, options.shares)),
        motion_(robot, options, systematic_),
        sightings_(std::move(sightings)),
        names_(options.names) {}

  SlamInput cut(const AlignedReadings& readings) {
    input_.start_s = now_s_ = last_step_s_ = readings.start_s;
    skip_sightings_before(readings.start_s);
    while (stop_until(readings.start_s)) ++next_stop_;
    look();
    for (std::size_t i = 0; i < readings.increments.size(); ++i) {
      const bool bridged = i < readings.bridged.size() && readings.bridged[i];
      advance_through(readings.increments[i], bridged);
    }
    if (now_s_ > last_step_s_) finish_step();
    report_left_out();
    report_unidentified();
    input_.landmarks = names_.list();
    input_.rest_s = motion_.rest_s();
    input_.systematic = systematic_;
    return std::move(input_);
  }

 private:
  bool sighting_until(double time_s) const {
    return next_ < sightings_.size() && sightings_[next_].time_s <= time_s;
  }

  bool stop_until(double time_s) const {
    return next_stop_ < options_.also_at_s.size() && options_.also_at_s[next_stop_] <= time_s;
  }

  void skip_sightings_before(double time_s) {
    while (next_ < sightings_.size() && sightings_[next_].time_s < time_s) ++next_;
    outside_ = next_;
  }

  /// An interval, cut where something is seen.
  void advance_through(const Increment& increment, bool bridged) {
    const double end_s = increment.time_s;
    const double start_s = end_s - increment.duration_s;
    while (sighting_until(end_s) || stop_until(end_s)) {
      double stop_s = end_s;
      if (sighting_until(end_s)) stop_s = sightings_[next_].time_s;
      if (stop_until(stop_s)) stop_s = options_.also_at_s[next_stop_];
      move_to(stop_s, share_of(increment, (stop_s - now_s_) / (end_s - start_s)), bridged);
      if (sighting_until(now_s_))
        look();
      else if (now_s_ > last_step_s_)
        finish_step();
      while (stop_until(now_s_)) ++next_stop_;
    }
    if (end_s <= now_s_) return;
    move_to(end_s, share_of(increment, (end_s - now_s_) / (end_s - start_s)), bridged);
    if (end_s - last_step_s_ >= options_.longest_step_s - kSameTime_s) finish_step();
  }

  void move_to(double time_s, const Increment& part, bool bridged) {
    if (time_s > now_s_) motion_.add(part, bridged);
    now_s_ = time_s;
  }

  /// `sees`: something is seen at its end. That moves with the sensor's clock, and the motion's end with it.
  void finish_step(bool sees = false) {
    motion_.finish_step(now_s_, input_);
    last_step_s_ = now_s_;
    const Vector3 at_end = sees ? motion_.rate() : Vector3::Zero();
    input_.by_sensor_clock.push_back(at_end -
                                     adjoint(input_.steps.back().motion.mean.inverse()) * at_last_end_);
    at_last_end_ = at_end;
  }

  /// All that is seen now, if anything is.
  void look() {
    if (!sighting_until(now_s_)) return;
    finish_step(true);
    std::vector<std::size_t> seen;
    for (const std::size_t first = next_; sighting_until(now_s_); ++next_) {
      if (is_repeated(first))
        ++repeated_;
      else
        seen.push_back(next_);
    }
    thin_out(seen);
    for (const std::size_t number : seen) {
      input_.steps.back().observations.push_back(observed(sightings_[number]));
      input_.sighting_numbers.push_back(number);
    }
  }

  void thin_out(std::vector<std::size_t>& seen) {
    const std::size_t all = seen.size();
    if (all <= kMostSightingsAtOnce) return;
    for (std::size_t i = 0; i < kMostSightingsAtOnce; ++i) seen[i] = seen[i * all / kMostSightingsAtOnce];
    seen.resize(kMostSightingsAtOnce);
    crowded_ += all - kMostSightingsAtOnce;
  }

  /// The next sighting is one of those since `first` told twice.
  bool is_repeated(std::size_t first) const {
    const Sighting& next = sightings_[next_];
    return std::any_of(sightings_.begin() + static_cast<std::ptrdiff_t>(first),
                       sightings_.begin() + static_cast<std::ptrdiff_t>(next_), [&](const Sighting& s) {
                         return s.range_m == next.range_m && s.bearing_rad == next.bearing_rad &&
                                s.landmark == next.landmark && s.time_s == next.time_s;
                       });
  }

  Observation observed(const Sighting& sighting) {
    const bool has_name = !options_.hide_ids && !sighting.landmark.empty();
    return observation_of(sensor_, has_name ? names_.id_of(sighting.landmark) : kUnknownLandmark,
                          sighting.range_m, sighting.bearing_rad);
  }

  void report_left_out() {
    outside_ += sightings_.size() - next_;
    note(outside_, FindingCode::sighting_without_odometry);
    note(repeated_, FindingCode::repeated_sighting);
    note(crowded_, FindingCode::crowded_instant, payload::Amount{static_cast<double>(kMostSightingsAtOnce)});
  }

  void report_unidentified() {
    std::size_t unidentified = 0;
    for (const SlamStep& step : input_.steps)
      unidentified += static_cast<std::size_t>(
          std::ranges::count(step.observations, kUnknownLandmark, &Observation::landmark));
    if (unidentified == input_.observations()) return;
    note(unidentified, FindingCode::sighting_without_name);
  }

  void note(std::size_t count, FindingCode code, const Payload& payload = {}) {
    if (count > 0) input_.findings.push_back({Severity::note, code, "sightings", count, {}, payload});
  }

  /// Stamps closer than their own resolution (nanoseconds in every log) are one instant.
  static constexpr double kSameTime_s = 1e-9;
  SlamInputOptions options_;
  LandmarkSensor sensor_;
  SystematicErrors systematic_;
  MotionSum motion_;
  std::vector<Sighting> sightings_;
  Names names_;
  std::size_t next_ = 0;       ///< of sightings_
  std::size_t next_stop_ = 0;  ///< of SlamInputOptions::also_at_s
  std::size_t outside_ = 0;    ///< sightings without odometry
  std::size_t repeated_ = 0;
  std::size_t crowded_ = 0;  ///< sightings, of instants with too many
  double now_s_ = 0.0;
  double last_step_s_ = 0.0;
  Vector3 at_last_end_ = Vector3::Zero();  ///< rate there, if something was seen
  SlamInput input_;
};

/// Ranges that this sensor cannot have measured: a wrong unit, or the wrong sensor.
void report_ranges_beyond(const LandmarkSensor& sensor, const std::vector<Sighting>& sightings,
                          std::vector<Finding>& findings) {
  std::size_t beyond = 0;
  double farthest_m = 0.0;
  for (const Sighting& sighting : sightings) {
    beyond += sighting.range_m > 2.0 * sensor.max_range_m ? 1 : 0;
    farthest_m = std::max(farthest_m, sighting.range_m);
  }
  if (2 * beyond <= sightings.size()) return;
  findings.push_back({.severity = Severity::warning,
                      .code = FindingCode::range_unit,
                      .place = "sightings",
                      .count = beyond,
                      .payload = payload::Excess{
                          .farthest = farthest_m, .limit = sensor.max_range_m, .all = sightings.size()}});
}

}  // namespace

std::size_t SlamInput::observations() const {
  std::size_t count = 0;
  for (const SlamStep& step : steps) count += step.observations.size();
  return count;
}

bool SlamInput::has_unidentified() const {
  return std::ranges::any_of(steps, [](const SlamStep& step) {
    return std::ranges::any_of(step.observations, [](const Observation& o) { return o.landmark < 0; });
  });
}

SlamInput slam_input(const Recording& recording, const Robot& robot, const SlamInputOptions& options) {
  return slam_input(recording, align(recording, robot), robot, options);
}

SlamInput slam_input(const Recording& recording, const AlignedReadings& readings, const Robot& robot,
                     const SlamInputOptions& options) {
  if (!robot.landmark_sensor)
    throw InputError(place_of(robot), "has no landmark sensor", "[landmark_sensor]");
  Cutter cutter(robot, options, timely_sightings(recording, *robot.landmark_sensor));
  SlamInput input = cutter.cut(readings);
  report_ranges_beyond(*robot.landmark_sensor, recording.sightings, input.findings);
  input.findings.insert(input.findings.begin(), readings.findings.begin(), readings.findings.end());
  return input;
}

}  // namespace trundle::slam
