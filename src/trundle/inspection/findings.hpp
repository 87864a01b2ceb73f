#pragma once

#include <optional>
#include <string>
#include <vector>

#include "trundle/inspection/inspect.hpp"
#include "trundle/odometry/effective_track.hpp"
#include "trundle/odometry/gyro_noise.hpp"
#include "trundle/recording/time_offset.hpp"

namespace trundle::inspection {

/// All that can be determined of one recording before anything is done with it.
struct Findings {
  std::vector<StreamSummary> streams;
  std::vector<SteeringSummary> steerings;
  std::vector<Finding> problems;     ///< of reading, aligning and comparing the sensors
  std::vector<std::string> missing;  ///< and what to add, in sentences
  // With a robot:
  std::optional<Abilities> abilities;
  bool compares_clocks = false;  ///< wheels that see turns and a gyro are there
  std::optional<TimeOffset> gyro_time_offset;
  bool compares_steering_clock = false;  ///< steered wheels, and turns measured otherwise
  std::optional<TimeOffset> steering_time_offset;
  bool compares_reference_clock = false;  ///< motion on board and a reference of positions are there
  std::optional<TimeOffset> reference_time_offset;
  bool compares_sighting_clock = false;  ///< motion on board and sightings are there
  std::optional<TimeOffset> sighting_time_offset;
  std::vector<TrackOnGround> tracks;  ///< where wheels must scrub in turns
};

/// Looks at a recording, and at how it fits the robot. Readings are aligned once; where they cannot be,
/// `missing` says why.
Findings find_in(const Recording& recording, const Robot* robot = nullptr);

}  // namespace trundle::inspection
