#pragma once

#include <array>
#include <vector>

#include "trundle/simulation/scenario.hpp"

namespace trundle::simulation {

/// The robot at the end of an interval of constant twist.
struct Moment {
  double time_s = 0.0;  ///< true time
  Pose2 body;           ///< world_from_body
  /// What the measured rows have seen since time 0, as Increment::turned: revolutions of each wheel; without
  /// wheels forward travel [m] and turn [rad].
  std::array<double, kMaxWheels> turned{};
  std::array<double, kMaxWheels> steering_rad{};         ///< what each steering reads without noise
  std::array<double, kMaxWheels> steering_within_rad{};  ///< and halfway since the moment before
};

/// The true motion, from time 0 on. Among its moments are all sampling times of the encoders.
struct Drive {
  std::vector<Moment> moments;
  std::vector<SlipTruth> slips;
};

/// Moves the true robot along the scenario's path. docs/theory/simulation.md, eq. 1 to 3.
Drive drive(const Scenario& scenario);

}  // namespace trundle::simulation
