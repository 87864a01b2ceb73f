#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

#include "trundle/recording/time_offset.hpp"

namespace trundle::pipeline {

/// What tells it.
enum class ClockSource { sensors, estimate, stated };

/// What holds for the stamps of a reference instead of reference.time_offset_s of the robot file.
struct ReferenceClock {
  double offset_s = 0.0;
  std::optional<double> sigma_s = {};  ///< nothing: stated
  ClockSource source = ClockSource::stated;
};

/// As the sensors on board show it, where it is off. Trajectories that sightings fix go by the landmark
/// sensor's clock: nothing where there are sightings that do not tell theirs, for it may be the reference's.
std::optional<ReferenceClock> clock_by_sensors(const Recording& recording, const AlignedReadings& readings,
                                               const Robot& robot);
/// As a trajectory of the body shows it, where it is off.
std::optional<ReferenceClock> clock_by_estimate(const Trajectory& reference,
                                                const Trajectory& world_from_body, double longest_gap_s,
                                                const Robot& robot);

/// "reference.time_offset_s 0.2013 ± 0.0021 s, from the ways and turns that reference and robot show".
std::string sentence_of(const ReferenceClock& clock);
nlohmann::ordered_json json_of(const std::optional<ReferenceClock>& clock);

}  // namespace trundle::pipeline
