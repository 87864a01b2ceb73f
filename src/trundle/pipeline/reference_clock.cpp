#include "trundle/pipeline/reference_clock.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "trundle/io/words.hpp"
#include "trundle/report/or_null.hpp"

namespace trundle::pipeline {
namespace {

std::optional<ReferenceClock> clock_if_off(const std::optional<TimeOffset>& found, const Robot& robot,
                                           ClockSource source) {
  if (!found || !is_off(*found, robot.reference_time_offset_s)) return std::nullopt;
  return ReferenceClock{.offset_s = found->offset_s, .sigma_s = found->sigma_s, .source = source};
}

std::string_view word_of(ClockSource source) {
  switch (source) {
    case ClockSource::sensors:
      return "sensors";
    case ClockSource::estimate:
      return "estimate";
    case ClockSource::stated:
      return "stated";
  }
  return {};
}

}  // namespace

std::optional<ReferenceClock> clock_by_sensors(const Recording& recording, const AlignedReadings& readings,
                                               const Robot& robot) {
  const bool has_sightings = robot.landmark_sensor && !recording.sightings.empty();
  if (has_sightings && !sighting_time_offset(recording.sightings, readings, robot)) return std::nullopt;
  return clock_if_off(reference_time_offset(recording.reference, readings, robot), robot,
                      ClockSource::sensors);
}

std::optional<ReferenceClock> clock_by_estimate(const Trajectory& reference,
                                                const Trajectory& world_from_body, double longest_gap_s,
                                                const Robot& robot) {
  return clock_if_off(reference_time_offset(reference, world_from_body, longest_gap_s, robot), robot,
                      ClockSource::estimate);
}

std::string sentence_of(const ReferenceClock& clock) {
  if (!clock.sigma_s) return fmt::format("reference.time_offset_s {} s, as stated", clock.offset_s);
  return fmt::format("reference.time_offset_s {} s, from the ways and turns that reference and {} show",
                     with_sigma(clock.offset_s, *clock.sigma_s),
                     clock.source == ClockSource::sensors ? "robot" : "estimate");
}

nlohmann::ordered_json json_of(const std::optional<ReferenceClock>& clock) {
  if (!clock) return nullptr;
  return {{"time_offset_s", clock->offset_s},
          {"sigma_s", report::or_null(clock->sigma_s)},
          {"from", word_of(clock->source)}};
}

}  // namespace trundle::pipeline
