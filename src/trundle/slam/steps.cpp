#include "trundle/slam/steps.hpp"

#include <algorithm>

#include "trundle/io/error.hpp"
#include "trundle/slam/step_cutter.hpp"

namespace trundle::slam {
namespace {

/// Sightings on the odometry's clock, in time order, those of one instant as they were recorded.
std::vector<Sighting> timely_sightings(const Recording& recording, const LandmarkSensor& sensor) {
  std::vector<Sighting> sightings = recording.sightings;
  for (Sighting& sighting : sightings) sighting.time_s += sensor.time_offset_s;
  std::ranges::stable_sort(sightings, {}, &Sighting::time_s);
  return sightings;
}

/// Goes through increments and sightings side by side.
SlamInput cut(const std::vector<Sighting>& sightings, const AlignedReadings& readings, const Robot& robot,
              SlamInputOptions options) {
  if (!options.parameters.empty())
    options.reading_noise = calibration::noise_in_readings(readings.increments, robot.chassis);
  StepCutter cutter(robot, options);
  std::size_t next = 0;
  const auto see_until = [&](double time_s) {
    for (; next < sightings.size() && sightings[next].time_s <= time_s; ++next)
      cutter.add_sighting(sightings[next]);
  };
  see_until(readings.start_s);
  cutter.start(readings.start_s);
  for (std::size_t i = 0; i < readings.increments.size(); ++i) {
    const Increment increment = readings.increments[i];
    see_until(increment.time_s);
    cutter.advance(increment, i < readings.bridged.size() && readings.bridged[i]);
  }
  for (; next < sightings.size(); ++next) cutter.add_sighting(sightings[next]);
  cutter.finish();
  SlamInput input = cutter.take();
  input.start_s = readings.start_s;
  input.findings = cutter.findings();
  input.landmarks = cutter.names();
  input.rest_s = cutter.motion().rest_s();
  input.systematic = cutter.systematic();
  return input;
}

void report_unidentified(SlamInput& input) {
  std::size_t unidentified = 0;
  for (const SlamStep& step : input.steps)
    unidentified += static_cast<std::size_t>(
        std::ranges::count(step.observations, kUnknownLandmark, &Observation::landmark));
  if (unidentified == 0 || unidentified == input.observations()) return;
  input.findings.push_back(
      {Severity::note, FindingCode::sighting_without_name, "sightings", unidentified, {}, {}});
}

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
  AlignedReadings readings = align(recording, robot);
  if (contains(options.parameters, ParameterKind::tyre_growth)) add_speeds(robot.chassis, readings);
  return slam_input(recording, readings, robot, options);
}

SlamInput slam_input(const Recording& recording, const AlignedReadings& readings, const Robot& robot,
                     const SlamInputOptions& options) {
  if (!robot.landmark_sensor)
    throw InputError(place_of(robot), "has no landmark sensor", "[landmark_sensor]");
  SlamInput input = cut(timely_sightings(recording, *robot.landmark_sensor), readings, robot, options);
  report_unidentified(input);
  report_ranges_beyond(*robot.landmark_sensor, recording.sightings, input.findings);
  input.findings.insert(input.findings.begin(), readings.findings.begin(), readings.findings.end());
  return input;
}

}  // namespace trundle::slam
